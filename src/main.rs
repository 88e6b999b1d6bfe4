//! The `asid` command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    asid::cli::main()
}
