//! Making new cases.

use std::path::Path;

use anyhow::Result;
use asid_core::Error;

use super::Arguments;

/// Half of the machines.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Half {
    /// Settings of a diagnosis may be chosen on it
    Training,
    /// Nothing may be chosen on it
    Test,
}

/// Makes new cases in a folder.
#[cfg(feature = "mujoco")]
pub fn make(folder: &Path, arguments: &Arguments) -> Result<()> {
    use std::io::Write as _;

    use asid_core::Progress as _;

    use crate::cli::failure;
    use crate::cli::progress::Bars;

    let common = &arguments.common;
    let half = match arguments.half {
        Half::Training => asid_withheld::Half::Training,
        Half::Test => asid_withheld::Half::Test,
    };
    let seed = common.seed.unwrap_or(0);
    let bars = Bars::new(common.quiet);
    bars.begin("cases", arguments.count as u64);
    let done = || bars.advance(1);
    let make = || {
        let outside = match &arguments.models {
            Some(models) => {
                let found = asid_withheld::outside::read(models, half)?;
                for why in &found.refused {
                    failure::note(why);
                }
                found.machines
            }
            None => Vec::new(),
        };
        asid_withheld::make::make(folder, half, seed, arguments.count, &outside, &done)
    };
    let made = asid_withheld::make::with_threads(common.threads.unwrap_or(0), make)
        .map_err(|e| Error::Failed(e.to_string()))?;
    bars.end();
    let mut stdout = std::io::stdout().lock();
    if common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&made)?)?;
    } else {
        for line in made.lines() {
            writeln!(stdout, "{line}")?;
        }
    }
    Ok(())
}

/// Without MuJoCo there are no worlds.
#[cfg(not(feature = "mujoco"))]
pub fn make(folder: &Path, arguments: &Arguments) -> Result<()> {
    let message = format!(
        "{}: {} cases of the {:?} half are worlds in MuJoCo: build with --features mujoco",
        folder.display(),
        arguments.count,
        arguments.half,
    );
    Err(Error::Failed(message).into())
}
