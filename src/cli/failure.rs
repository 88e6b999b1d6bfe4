//! How an error reaches the user: one line on standard error, and the exit status.

use std::io::Write as _;
use std::process::ExitCode;

/// Exit status of work that failed.
const FAILED: u8 = 1;
/// Exit status of a call that was wrong.
const WRONG_CALL: u8 = 2;

/// A problem with the command line itself; help and version are no problem.
pub fn usage(error: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind::{DisplayHelp, DisplayVersion};
    let _ = error.print();
    match error.kind() {
        DisplayHelp | DisplayVersion => ExitCode::SUCCESS,
        _ => ExitCode::from(WRONG_CALL),
    }
}

/// Writes the error and tells whether the call or the work was wrong.
pub fn report(error: &anyhow::Error) -> ExitCode {
    let line = format!("{error:#}").split_whitespace().collect::<Vec<_>>().join(" ");
    let _ = writeln!(std::io::stderr(), "asid: {line}");
    match error.downcast_ref::<asid_core::Error>() {
        Some(e) if e.is_usage() => ExitCode::from(WRONG_CALL),
        _ => ExitCode::from(FAILED),
    }
}
