//! Runs the program and reads its output.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// Runs the program.
pub fn asid(arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_asid");
    Command::new(program).args(arguments).output().unwrap()
}

/// A path as an argument.
pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Reads a JSON file.
pub fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}
