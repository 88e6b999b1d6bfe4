//! Developer entry of the repository: `cargo xtask <subcommand>`.
//!
//! Each subcommand has a file of its own. This crate links no native library, because it fetches
//! them.

// A developer tool prints to the terminal.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod bench;
mod binaries;
mod deny;
mod environment;
mod fuzz;
mod library;
mod lint;
mod miri;
mod peers;
mod python;
mod same;
mod setup;
mod slurm;
mod stage;
mod test;
mod wheel;

use std::process::ExitCode;

use anyhow::{Result, bail};

const HELP: &str = "\
Usage: cargo xtask <subcommand>

  setup [--only mujoco|torch]  fetches the native libraries into .native/ (quick when all is there)
  lint                         formatting, clippy and rustdoc over the workspace, all features
  deny                         licences, versions and sources of the dependencies, by a pinned `cargo deny`
  test                         setup, lint, deny and every test: what CI runs
  wheel                        the Python package as a wheel, into target/wheels/release
  python [--release]           the Python package's tests, on a wheel in a fresh virtual environment
  miri                         the engine ABI's unsafe code under Miri, where a toolchain has it
  slurm [--program FILE]       comparisons as job arrays of a real Slurm, where its packages can be had
  same OLD NEW                 whether two builds of asid give the same results: for changes that
                               are meant to change none
  bench [--quick] [--out FILE.json] [--markdown FILE.md]
                               speed beside the engines' own loops, a table and a JSON file
  bench --peers [--quick] [--out FILE.json] [--markdown FILE.md]
                               against Stable-Baselines3 and mujoco.sysid in a virtual environment of
                               its own in the target folder (2.3 GB of packages)
  fuzz [READER…] [--inputs N] [--seed S] [--minutes M]
                               damaged files for every reader: 10^6 each; docs/reliability.md
  fuzz repeat READER FILE      one file, such as a finding
  kill [COMMAND…] [--times N]  commands that write, killed at random moments and called again

A library that you have already wins: set MUJOCO_DYNAMIC_LINK_DIR to the folder of libmujoco.so,
LIBTORCH to the folder that holds lib/ and include/, or LIBTORCH_USE_PYTORCH=1.
Without a network: PIP_NO_INDEX=1 PIP_FIND_LINKS=<folder of wheels> cargo xtask setup";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Runs one subcommand; false if it ran and found a problem.
fn run(arguments: &[String]) -> Result<bool> {
    let Some((subcommand, rest)) = arguments.split_first() else {
        bail!("no subcommand\n{HELP}");
    };
    match subcommand.as_str() {
        "setup" => setup::run(&setup::selection(rest)?).map(|()| true),
        "lint" => without_arguments(rest).and_then(|()| lint::run()),
        "deny" => without_arguments(rest).and_then(|()| deny::run()),
        "test" => without_arguments(rest).and_then(|()| test::run()),
        "miri" => without_arguments(rest).and_then(|()| miri::run()),
        "wheel" => python::wheel(rest),
        "python" => python::tests(rest),
        "same" => same::run(rest),
        "slurm" => slurm::run(rest),
        "bench" => bench::run(rest),
        "fuzz" => fuzz::run("read", rest),
        "kill" => fuzz::run("kill", rest),
        "help" | "--help" | "-h" => {
            println!("{HELP}");
            Ok(true)
        }
        other => bail!(
            "unknown subcommand `{other}`; known: setup, lint, deny, test, wheel, python, miri, slurm, same, bench, fuzz, kill, help"
        ),
    }
}

fn without_arguments(rest: &[String]) -> Result<()> {
    match rest.first() {
        Some(argument) => bail!("unexpected argument `{argument}`; this subcommand takes none"),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(arguments: &[&str]) -> String {
        let arguments: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
        run(&arguments).unwrap_err().to_string()
    }

    #[test]
    fn wrong_calls_say_what_is_known() {
        assert!(error_of(&[]).starts_with("no subcommand"));
        assert!(error_of(&["tset"]).contains("known: setup, lint, deny, test"));
        assert!(error_of(&["test", "--fast"]).contains("`--fast`"));
        assert!(error_of(&["setup", "--only", "bullet"]).contains("known: mujoco, torch"));
    }
}
