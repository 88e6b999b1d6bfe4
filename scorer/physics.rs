//! What the scorer's own replays say: whether a verdict is the same physics as the truth, and how much of the gap that
//! could be closed it closed.
//!
//! Nothing here searches. A set of effects that somebody names is put into the study's model and fitted, from the
//! values that its author gives: the label's for the truth, the diagnosis' own for its verdict.

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

/// Gaps on the logs held out, root mean square in units of the noise, all by the same replays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gaps {
    /// With the study's parameters fitted.
    pub identified: f64,
    /// As the diagnosis left the model: its parameters, its effects, its values.
    pub refined: f64,
    /// With the true effects fitted.
    pub best: f64,
    /// Share of what the true effects close that the diagnosis closed; null where they close nothing.
    pub closed_of_possible: Option<f64>,
}

/// What replays say of a case.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Physics {
    /// Whether the verdict's effects are the same physics as the truth; null where that was not asked: the names agree,
    /// or one of both is no set of effects.
    pub same_as_truth: Option<bool>,
    /// Root mean square difference of their noise-free predictions, in units of the noise.
    pub distance: Option<f64>,
    /// Gaps; null where the truth cannot be fitted.
    pub gaps: Option<Gaps>,
    /// Why there are no replays, where there are none.
    pub skipped: Option<String>,
}

impl Physics {
    /// Of a case without replays, with the reason.
    #[must_use]
    pub fn skipped(why: impl ToString) -> Self {
        Self {
            skipped: Some(why.to_string()),
            ..Self::default()
        }
    }
}

/// What the machine of the study in a folder says of names.
///
/// # Errors
/// When the study cannot be read.
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
