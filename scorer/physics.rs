//! The scorer's own replays: whether a verdict is the same physics as the truth, and how much of
//! the closable gap it closed.
//!
//! Nothing here searches. A named set of effects is put into the study's model and fitted, starting
//! from the values that its author gives. The truth starts from the label's values, the verdict
//! from those of the diagnosis.

mod bench;
pub(crate) mod fit;
pub(crate) mod logs;
pub(crate) mod model;
pub(crate) mod start;
mod study;

use std::path::Path;
use std::sync::Arc;

use asid_core::{Backend, Result};
use serde::Serialize;

use crate::answer::Answer;
use crate::judge::Judge;
use crate::sites::Sites;
pub use study::Study;

use bench::Bench;

/// Gaps on the held-out logs: root mean squares in units of the noise, all by the same replays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gaps {
    /// Gap with the study's parameters fitted.
    pub identified: f64,
    /// Gap of the model of the diagnosis: its parameters, its effects, its values.
    pub refined: f64,
    /// Gap with the true effects fitted.
    pub best: f64,
    /// Share of what the true effects close that the diagnosis closed; null if they close nothing.
    pub closed_of_possible: Option<f64>,
}

/// Results of the replays of a case.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Physics {
    /// Whether the verdict's effects are the same physics as the truth.
    ///
    /// Null if the question does not arise: the names agree, or truth or verdict is no set of
    /// effects.
    pub same_as_truth: Option<bool>,
    /// Root mean square difference of the noise-free predictions of both, in units of the noise.
    pub distance: Option<f64>,
    /// Gaps; null if the truth cannot be fitted.
    pub gaps: Option<Gaps>,
    /// Reason why there are no replays.
    pub skipped: Option<String>,
}

impl Physics {
    /// The result for a case without replays, with the reason.
    #[must_use]
    pub fn skipped(why: impl ToString) -> Self {
        Self {
            skipped: Some(why.to_string()),
            ..Self::default()
        }
    }
}

/// Meaning of names in the machine of the study in a folder.
///
/// # Errors
/// If the study cannot be read.
pub fn sites_of(folder: &Path) -> Result<Sites> {
    Ok(Sites::of(&Study::read(folder)?.plant))
}

/// Replays a case whose study lies in `folder`.
#[must_use]
pub fn examine(
    backend: Arc<dyn Backend>,
    folder: &Path,
    judge: &Judge<'_>,
    answer: &Answer,
) -> Physics {
    let examined = Study::read(folder)
        .and_then(|study| Bench::new(backend, &study, judge.label, answer)?.examine(judge, answer));
    examined.unwrap_or_else(Physics::skipped)
}
