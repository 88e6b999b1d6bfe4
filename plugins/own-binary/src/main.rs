//! The complete command line of asid with a custom task.

use payload_swing as _;

fn main() -> std::process::ExitCode {
    asid::cli::main()
}
