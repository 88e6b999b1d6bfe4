//! A cell: one run of one method, and its outcome.

use serde::{Deserialize, Serialize};

use crate::method::{NONE, TRUTH};
use crate::number;

/// Key that identifies a cell.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CellKey {
    /// Task.
    pub task: String,
    /// Condition of the task.
    pub condition: String,
    /// Name of the method.
    pub method: String,
    /// Kind of real world.
    pub world: String,
    /// Engine of the method's simulator.
    pub backend: String,
    /// Seed.
    pub seed: u64,
}

impl CellKey {
    /// Name of the cell's files without extension: the parts of the key, joined by dots.
    ///
    /// Any character of a part other than a letter, digit, `-` or `_` is written as `%XX`, so that
    /// different keys have different names.
    #[must_use]
    pub fn stem(&self) -> String {
        let seed = self.seed.to_string();
        let parts = [
            &self.task,
            &self.condition,
            &self.method,
            &self.world,
            &self.backend,
            &seed,
        ];
        parts.map(|p| escaped(p)).join(".")
    }

    /// The key in words: `rod-balancing, left, asid, matched, rapier, seed 0`.
    #[must_use]
    pub fn words(&self) -> String {
        format!(
            "{}, {}, {}, {}, {}, seed {}",
            self.task, self.condition, self.method, self.world, self.backend, self.seed
        )
    }

    /// Whether both are cells of one row.
    #[must_use]
    pub fn row_mate(&self, other: &Self) -> bool {
        self.condition == other.condition && self.arm_mate(other)
    }

    /// Whether both are of one method on one task in one world on one engine; such cells share
    /// their settings.
    #[must_use]
    pub fn arm_mate(&self, other: &Self) -> bool {
        (&self.task, &self.method, &self.world, &self.backend)
            == (&other.task, &other.method, &other.world, &other.backend)
    }
}

/// A key's part as it appears in a file name.
fn escaped(text: &str) -> String {
    text.bytes()
        .map(|b| match b {
            b'-' | b'_' | b'0'..=b'9' | b'a'..=b'z' | b'A'..=b'Z' => char::from(b).to_string(),
            other => format!("%{other:02X}"),
        })
        .collect()
}

/// Versions of what produced a cell.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Versions {
    /// Version of this program.
    pub asid: String,
    /// Engine and its version.
    pub engine: String,
    /// Commit; empty where it is unknown.
    pub git: String,
}

/// Identification result of one unknown in a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CellParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// True value in the real world.
    #[serde(with = "number::scalar")]
    pub truth: f64,
    /// Estimate.
    #[serde(with = "number::scalar")]
    pub estimate: f64,
    /// Posterior standard deviation.
    #[serde(with = "number::scalar")]
    pub std: f64,
    /// Central 95 % interval of the posterior.
    #[serde(with = "number::pair")]
    pub interval95: [f64; 2],
    /// Expected posterior standard deviation after the episode; `None` without exploration, and
    /// without the fits that it takes.
    #[serde(with = "number::option")]
    pub expected_std: Option<f64>,
}

/// One run and its outcome. Times are not part of it: they have files of their own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// Layout version.
    pub schema: u32,
    /// Key of the cell.
    #[serde(flatten)]
    pub key: CellKey,
    /// Explorer, or `none`.
    pub explorer: String,
    /// Identifier, `none`, or `truth`.
    pub identifier: String,
    /// Solver.
    pub solver: String,
    /// Hash of the resolved settings: [`crate::settings::hash`].
    pub settings: String,
    /// Versions of what produced it.
    pub versions: Versions,
    /// The unknowns.
    pub parameters: Vec<CellParameter>,
    /// Residual of the identification; `None` without identification.
    #[serde(with = "number::option")]
    pub residual: Option<f64>,
    /// Share of the exploration's control steps with contact; `None` without exploration.
    #[serde(with = "number::option")]
    pub contact_fraction: Option<f64>,
    /// Name of the task's metric; lower is better.
    pub metric: String,
    /// The metric's value.
    #[serde(with = "number::scalar")]
    pub value: f64,
    /// Whether the attempt succeeded.
    pub success: bool,
    /// Physics steps of the method.
    pub physics_steps: u64,
    /// Control steps of exploration episodes that the method simulated.
    pub env_steps: u64,
}

impl Cell {
    /// Whether its method identified the unknowns from an episode.
    #[must_use]
    pub fn identifies(&self) -> bool {
        ![NONE, TRUTH].contains(&&*self.identifier)
    }

    /// Whether both are of the same bytes as files; a number that is missing (NaN) equals another.
    #[must_use]
    pub fn is_same(&self, other: &Self) -> bool {
        let written = |cell: &Self| serde_json::to_value(cell).ok();
        written(self) == written(other)
    }
}

/// Layout version of a cell.
pub const SCHEMA: u32 = 1;

/// Why a cell is not there.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[schemars(rename = "FailedRun")]
pub struct Failure {
    /// Which one it is.
    #[serde(flatten)]
    pub key: CellKey,
    /// Why, in one line.
    pub reason: String,
    /// Whether no cell of this method, task, world and engine can be run, rather than this one.
    pub of_all: bool,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub fn key(task: &str, condition: &str, method: &str, seed: u64) -> CellKey {
        CellKey {
            task: task.into(),
            condition: condition.into(),
            method: method.into(),
            world: "matched".into(),
            backend: "rapier".into(),
            seed,
        }
    }

    pub fn cell(key: CellKey, value: f64, success: bool) -> Cell {
        let method = crate::method::Method::named(&key.method).unwrap();
        Cell {
            schema: SCHEMA,
            key,
            explorer: method.explorer,
            identifier: method.identifier,
            solver: method.solver,
            settings: "0".into(),
            versions: Versions {
                asid: "0".into(),
                engine: "rapier 1".into(),
                git: "c".into(),
            },
            parameters: vec![CellParameter {
                name: "mass_offset".into(),
                unit: "m".into(),
                truth: 0.1 + 0.2,
                estimate: 1.0 / 3.0,
                std: f64::INFINITY,
                interval95: [f64::NEG_INFINITY, f64::NAN],
                expected_std: None,
            }],
            residual: Some(1.5),
            contact_fraction: None,
            metric: "tilt_deg".into(),
            value,
            success,
            physics_steps: 10,
            env_steps: 1,
        }
    }

    #[test]
    fn names_of_files_tell_all_cells_apart() {
        let plain = key("rod-balancing", "left", "asid", 3);
        assert_eq!(plain.stem(), "rod-balancing.left.asid.matched.rapier.3");
        let [a, b] = [key("a.b", "c", "asid", 0), key("a", "b.c", "asid", 0)];
        assert_ne!(a.stem(), b.stem());
        assert_eq!(
            key("x@y", "c", "asid", 0).stem(),
            "x%40y.c.asid.matched.rapier.0"
        );
    }

    #[test]
    fn a_cell_that_is_read_is_written_the_same_to_the_byte() {
        let text = serde_json::to_string(&cell(key("t", "c", "asid", 1), 0.1, true)).unwrap();
        let read: Cell = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
        assert_eq!(read.parameters[0].std, f64::INFINITY);
        assert!(read.parameters[0].interval95[1].is_nan());
    }
}
