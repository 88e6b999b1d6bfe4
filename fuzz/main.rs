//! Damaged files for every reader, and commands that are killed while they write.
//!
//! `cargo xtask fuzz` builds and calls it. Readers run in a child process, so that a stack overflow
//! or exhausted memory becomes a finding and does not end the run. Input `i` of a seed always has
//! the same bytes, so its number alone reproduces a finding.

// A measuring tool prints to the terminal.
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod child;
mod corpus;
mod damage;
mod finding;
mod kill;
mod memory;
mod parent;
mod readers;
mod work_time;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

/// Counts every allocation of this program.
#[global_allocator]
static COUNTED: memory::Counted = memory::Counted;

/// Damages files and reads them; kills commands and looks at what they leave.
#[derive(Parser)]
#[command(name = "cargo xtask fuzz")]
struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Give readers damaged files
    Read(parent::Arguments),
    /// Read one file, such as a finding
    Repeat {
        /// Reader: see `read --list`
        reader: String,
        /// The file
        file: PathBuf,
    },
    /// Kill commands that write, at random moments
    Kill(kill::Arguments),
    /// Read inputs in this process; `read` starts it.
    #[command(hide = true)]
    Child(child::Arguments),
}

fn main() -> ExitCode {
    let ended = match Arguments::parse().what {
        What::Read(arguments) => parent::read(&arguments),
        What::Repeat { reader, file } => repeat(&reader, &file),
        What::Kill(arguments) => kill::kill(&arguments),
        What::Child(arguments) => child::run(&arguments).map(|()| true),
    };
    match ended {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("fuzz: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Reads one file as a reader does, and prints the result.
fn repeat(reader: &str, file: &std::path::Path) -> Result<bool> {
    let reader = readers::named(reader)?;
    let scratch = tempfile::tempdir()?;
    (reader.prepare)(scratch.path())?;
    let input = scratch.path().join(reader.file);
    if let Some(folder) = input.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::copy(file, &input)?;
    match (reader.read)(&input) {
        Ok(()) => println!("read"),
        Err(message) => println!("refused: {message}"),
    }
    Ok(true)
}
