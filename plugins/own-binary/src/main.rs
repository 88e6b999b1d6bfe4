//! The whole command line of asid, and a task of one's own.

use payload_swing as _;

fn main() -> std::process::ExitCode {
    asid::cli::main()
}
