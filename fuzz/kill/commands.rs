//! The commands that write, with settings that make them quick, and their input files.

use std::path::Path;
use std::sync::OnceLock;

use anyhow::{Context, Result, ensure};

use crate::corpus::root;

/// A command.
pub struct Case {
    /// Name in the table.
    pub name: &'static str,
    /// Its arguments, for a call in a folder of its own.
    pub arguments: &'static [&'static str],
    /// Further settings that it takes by `--set`.
    pub settings: &'static [&'static [&'static str]],
    /// Path of its output.
    pub out: &'static str,
    /// Whether the output is a folder that may already exist, empty.
    pub folder: bool,
    /// Whether it may be called again if its result is complete.
    pub repeats: bool,
    /// Writes the command's input files into the folder; the second path is that of the program.
    pub prepare: fn(&Path, &Path) -> Result<()>,
}

/// Settings that make each part of a command quick.
const EXPLORER: &[&str] = &[
    "explorer.iterations=1",
    "explorer.population=4",
    "explorer.prior_samples=1",
];
const IDENTIFIER: &[&str] = &[
    "identifier.iterations=1",
    "identifier.population=8",
    "identifier.sampling.rounds=1",
    "identifier.sampling.draws=8",
    "expected.rounds=0",
];
const SOLVER: &[&str] = &[
    "solver.iterations=1",
    "solver.population=2",
    "solver.belief_samples=1",
];
const DESIGN: &[&str] = &["design.iterations=1", "design.population=4"];

impl Case {
    /// All its arguments.
    pub fn call(&self) -> Vec<&'static str> {
        let set = |s: &&'static str| ["--set", *s];
        let settings = self.settings.iter().copied().flatten().flat_map(set);
        self.arguments.iter().copied().chain(settings).collect()
    }
}

/// Commands that write files. `conformance` and the figures of `compare` use the same code to write
/// as `run` and `compare`.
pub const COMMANDS: &[Case] = &[
    Case {
        name: "run",
        arguments: &[
            "run",
            "rod-balancing",
            "--set",
            "condition=left",
            "--quiet",
            "--out",
            "out",
        ],
        settings: &[EXPLORER, IDENTIFIER, SOLVER],
        out: "out",
        folder: true,
        repeats: false,
        prepare: nothing,
    },
    Case {
        name: "explore",
        arguments: &[
            "explore",
            "study",
            "--quiet",
            "--seconds",
            "1",
            "--out",
            "out",
            "--limit-position",
            "pan:-1:1",
            "--limit-position",
            "gripper:0:0.08",
            "--limit-speed",
            "pan:4",
            "--limit-speed",
            "gripper:1",
        ],
        settings: &[DESIGN],
        out: "out",
        folder: true,
        repeats: false,
        prepare: study,
    },
    Case {
        name: "identify",
        arguments: &["identify", "study", "--quiet", "--out", "out"],
        settings: &[],
        out: "out",
        folder: true,
        repeats: false,
        prepare: study,
    },
    Case {
        name: "solve",
        arguments: &[
            "solve",
            "rod-balancing",
            "--posterior",
            "prior",
            "--quiet",
            "--out",
            "out",
        ],
        settings: &[SOLVER],
        out: "out",
        folder: true,
        repeats: false,
        prepare: nothing,
    },
    Case {
        name: "compare",
        arguments: &[
            "compare",
            "rod-balancing",
            "--method",
            "dr",
            "--condition",
            "left",
            "--seeds",
            "2",
            "--quiet",
            "--out",
            "out",
        ],
        settings: &[SOLVER],
        out: "out",
        folder: true,
        repeats: true,
        prepare: nothing,
    },
    Case {
        name: "diagnose",
        arguments: &["diagnose", "study", "--quiet", "--out", "out"],
        settings: &[],
        out: "out",
        folder: true,
        repeats: false,
        prepare: study,
    },
    Case {
        name: "import",
        arguments: &[
            "import",
            "study/train_0.csv",
            "study/test_0.csv",
            "--model",
            "study/model.xml",
            "--out",
            "out",
        ],
        settings: &[],
        out: "out",
        folder: true,
        repeats: false,
        prepare: study,
    },
    Case {
        name: "export-log",
        arguments: &["export-log", "study", "--out", "out"],
        settings: &[],
        out: "out",
        folder: true,
        repeats: false,
        prepare: study,
    },
    Case {
        name: "export",
        arguments: &["export", "rod-balancing", "--mjcf", "scene.xml"],
        settings: &[],
        out: "scene.xml",
        folder: false,
        repeats: false,
        prepare: nothing,
    },
    Case {
        name: "report",
        arguments: &["report", "diagnosis"],
        settings: &[],
        out: "diagnosis",
        folder: false,
        repeats: true,
        prepare: diagnosis,
    },
    Case {
        name: "withheld",
        arguments: &[
            "withheld",
            "--cases",
            "cases",
            "--method",
            "identify-only",
            "--names-only",
            "--quiet",
            "--out",
            "out",
        ],
        settings: &[],
        out: "out",
        folder: true,
        repeats: true,
        prepare: cases,
    },
    Case {
        name: "new",
        arguments: &["new", "task", "my-task"],
        settings: &[],
        out: "my-task",
        folder: true,
        repeats: false,
        prepare: nothing,
    },
];

fn nothing(_: &Path, _: &Path) -> Result<()> {
    Ok(())
}

/// The study of a machine with two joints and one parameter.
fn study(folder: &Path, _: &Path) -> Result<()> {
    let (from, to) = (root().join("logs/tests/fixtures"), folder.join("study"));
    std::fs::create_dir_all(&to)?;
    std::fs::copy(from.join("nominal.xml"), to.join("model.xml"))?;
    for (name, new) in [("train_0", "train_0"), ("test_3", "test_0")] {
        let file = from.join("csv").join(name).with_extension("csv");
        std::fs::copy(file, to.join(new).with_extension("csv"))?;
    }
    let text = "model = 'model.xml'\ntrain = ['train_0.csv']\ntest = ['test_0.csv']\n\
                [[parameter]]\nname = 'damping'\ntarget = 'joint/pan/damping'\nrange = [0.01, 0.5]\n";
    std::fs::write(to.join("study.toml"), text)?;
    Ok(())
}

/// Two withheld cases of that study, with their labels.
fn cases(folder: &Path, asid: &Path) -> Result<()> {
    let cases = folder.join("cases");
    for case in ["a", "b"] {
        study(folder, asid)?;
        std::fs::create_dir_all(&cases)?;
        std::fs::rename(folder.join("study"), cases.join(case))?;
    }
    let labels = r#"{"a": {"effects": []}, "b": {"effects": []}}"#;
    std::fs::write(cases.join("labels.json"), labels)?;
    Ok(())
}

/// A finished diagnosis of that study, made only once.
fn diagnosis(folder: &Path, asid: &Path) -> Result<()> {
    static MADE: OnceLock<tempfile::TempDir> = OnceLock::new();
    if MADE.get().is_none() {
        let made = tempfile::tempdir()?;
        study(made.path(), asid)?;
        let mut call = std::process::Command::new(asid);
        let call = call.args(["diagnose", "study", "--quiet", "--out", "diagnosis"]);
        let done = call.current_dir(made.path()).output()?;
        ensure!(
            done.status.success(),
            "{}",
            String::from_utf8_lossy(&done.stderr)
        );
        let _ = MADE.set(made);
    }
    let made = MADE.get().context("no diagnosis")?.path().join("diagnosis");
    let to = folder.join("diagnosis");
    std::fs::create_dir_all(&to)?;
    for entry in std::fs::read_dir(made)? {
        let entry = entry?;
        std::fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    Ok(())
}
