//! Runs the real binary in a folder of its own, with settings that make it quick.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Engine of the quick runs. With an arm of seven joints MuJoCo is four times as fast as rapier.
#[allow(dead_code)] // Not every test names it.
pub const ENGINE: &str = if cfg!(feature = "mujoco") {
    "mujoco"
} else {
    "rapier"
};

/// Settings under which a whole run takes a second or two; the results have no meaning.
pub const TINY: [&str; 12] = [
    if cfg!(feature = "mujoco") {
        "backend=mujoco"
    } else {
        "backend=rapier"
    },
    "explorer.iterations=1",
    "explorer.population=4",
    "explorer.prior_samples=1",
    "identifier.iterations=1",
    "identifier.population=8",
    "identifier.sampling.rounds=1",
    "identifier.sampling.draws=8",
    "solver.iterations=1",
    "solver.population=2",
    "solver.belief_samples=1",
    "expected.rounds=0",
];

/// A temporary folder in which commands run.
pub struct Workplace {
    folder: tempfile::TempDir,
}

impl Workplace {
    pub fn new() -> Self {
        Self {
            folder: tempfile::tempdir().unwrap(),
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Names in the folder, sorted, including hidden ones.
    pub fn names(&self) -> Vec<String> {
        names(self.folder.path())
    }

    /// The command, to be run in this folder.
    pub fn asid(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_asid"));
        command
            .current_dir(self.folder.path())
            .env_remove("RUST_BACKTRACE")
            .args(arguments);
        command
    }

    pub fn run(&self, arguments: &[&str]) -> Output {
        self.asid(arguments).output().unwrap()
    }
}

/// Names in a folder, sorted, including hidden ones.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// `arguments` with the quick settings.
pub fn tiny<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    let settings = TINY.iter().flat_map(|s| ["--set", s]);
    arguments.iter().copied().chain(settings).collect()
}
