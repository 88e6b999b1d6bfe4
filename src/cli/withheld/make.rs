//! Making new cases.

use std::path::Path;

use anyhow::Result;
use asid_core::Error;
#[cfg(feature = "mujoco")]
use asid_withheld::faults::Fault;
#[cfg(feature = "mujoco")]
use asid_withheld::plan::Kind;
#[cfg(feature = "mujoco")]
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::Arguments;

/// Half of the machines.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Half {
    /// Settings of a diagnosis may be chosen on it
    Training,
    /// Nothing may be chosen on it
    Test,
}

/// Kinds of cases by their names.
#[cfg(feature = "mujoco")]
fn kinds() -> impl TypedValueParser<Value = Kind> {
    let kind = |kind: Kind| PossibleValue::new(kind.name()).help(kind.about());
    PossibleValuesParser::new(Kind::ALL.map(kind))
        .try_map(|name| Kind::named(&name).ok_or("is no kind of case"))
}

/// Faults of logs by their names.
#[cfg(feature = "mujoco")]
fn faults() -> impl TypedValueParser<Value = Fault> {
    PossibleValuesParser::new(Fault::all().map(Fault::name))
        .try_map(|name| Fault::named(&name).ok_or("is no fault of a log"))
}

/// Which cases are made: those of a set for one question, or all.
#[cfg(feature = "mujoco")]
#[derive(clap::Args)]
pub struct Wanted {
    /// Make only cases of this kind (repeatable)
    #[arg(long, value_name = "KIND", value_parser = kinds(), requires = "make")]
    kind: Vec<Kind>,
    /// Make only cases with this cause, such as backlash (repeatable)
    #[arg(long, value_name = "NAME", requires = "make")]
    cause: Vec<String>,
    /// Make only worlds where nothing else is off
    #[arg(long, requires = "make", conflicts_with = "dirty")]
    clean: bool,
    /// Make only worlds where everything else is a little off
    #[arg(long, requires = "make")]
    dirty: bool,
    /// Plan causes for at least this excess gap, in noise floors; in dirty worlds for so many times
    /// that of the dirt
    #[arg(long, value_name = "N", default_value_t = 0.0, requires = "make")]
    size: f64,
    /// Give every log this fault, or none; the same seed with another fault of the log makes the
    /// same worlds [default: as they are dealt]
    #[arg(long, value_name = "NAME", value_parser = faults(), requires = "make")]
    fault: Option<Fault>,
}

#[cfg(feature = "mujoco")]
impl Wanted {
    fn of_plan(&self) -> asid_withheld::plan::Wanted {
        asid_withheld::plan::Wanted {
            kinds: self.kind.clone(),
            causes: self.cause.clone(),
            dirty: (self.clean || self.dirty).then_some(self.dirty),
            size: self.size,
            fault: self.fault,
        }
    }
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
    let order = asid_withheld::make::Order {
        half,
        seed: common.seed.unwrap_or(0),
        count: arguments.count,
        wanted: arguments.wanted.of_plan(),
    };
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
        asid_withheld::make::make(folder, &order, &outside, &done)
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
