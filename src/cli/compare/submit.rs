//! `asid compare --submit slurm`: a comparison as a job array.

use std::io::Write as _;
use std::process::Command;

use anyhow::Result;
use asid_comparison::slurm::Script;
use asid_comparison::store::{Store, write};
use asid_core::Error;
use asid_results::naming::count;

use super::folder::claim;
use super::request::document;
use super::resume::same_comparison;
use super::{Arguments, work};
use crate::cli::failure;
use crate::cli::output::OutFolder;

/// Default limit of an array's simultaneous tasks: what a cluster typically allows one user.
const JOBS: usize = 32;

/// Writes the script of a job array into the comparison's folder and submits it. A dry run only
/// prints the script.
///
/// # Errors
/// When the call is wrong, the folder holds another comparison or cannot be written, or sbatch
/// refuses.
pub fn submit(arguments: &Arguments) -> Result<()> {
    if arguments.shard.is_some() {
        return Err(Error::Config {
            key: "--shard".into(),
            message: "is chosen by the tasks of the array; leave it out".into(),
        }
        .into());
    }
    let document = document(arguments)?;
    work::check(&document)?;
    let store = match &arguments.out {
        // To claim the next free folder makes it.
        None if arguments.print_script => Store::new(&OutFolder::claim(None, "compare")?.path()),
        out => claim(out.as_deref())?,
    };
    same_comparison(arguments, &store, &document)?;
    let failed = |what: &str, e: std::io::Error| Error::Failed(format!("{what}: {e}"));
    // A folder that is not there yet has no canonical path.
    let root = (store.root().canonicalize())
        .or_else(|_| std::path::absolute(store.root()))
        .map_err(|e| failed(&store.root().display().to_string(), e))?;
    let program = std::env::current_exe().map_err(|e| failed("this program's file", e))?;
    let cells = document.plan.cells().len();
    let script = Script {
        program: &program,
        out: &root,
        jobs: arguments.jobs.unwrap_or(JOBS).clamp(1, cells),
        threads: arguments.threads.unwrap_or(1),
        options: &arguments.sbatch,
    };
    let text = script.text();
    let mut stdout = std::io::stdout().lock();
    if arguments.print_script {
        write!(stdout, "{text}")?;
        return Ok(());
    }
    write(&store.config(), &document.text()?)?;
    let logs = root.join("slurm");
    std::fs::create_dir_all(&logs).map_err(|e| failed(&logs.display().to_string(), e))?;
    let file = root.join("slurm.sh");
    write(&file, &text)?;
    let output = Command::new("sbatch").arg(&file).output().map_err(|e| {
        let how = format!("sbatch {} submits it where Slurm is", file.display());
        Error::Failed(format!("cannot start sbatch: {e}; {how}"))
    })?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(Error::Failed(format!("sbatch refused: {}", said.trim())).into());
    }
    failure::note(&format!(
        "{} in {}; the tables are written when the last one is done",
        count(cells, "run"),
        root.display()
    ));
    write!(stdout, "{}", String::from_utf8_lossy(&output.stdout))?;
    Ok(())
}
