//! Scores diagnoses of cases whose cause was withheld.
//!
//! A case is a study with a sealed label, and a diagnosis answers it with a `result.json`. This
//! crate compares the two. It reads the answer as a file and not as types of the diagnosis, and
//! shares none of its code. It replays the physics that it needs itself, with the engines and the
//! catalogue of effects.
//!
//! - [`label`] and [`answer`] are the two files.
//! - [`catalogue`], [`sites`] and [`dirt`] decide when names agree; [`judge`] decides whether an
//!   answer is right.
//! - [`physics`] refits the named sets and decides which of them are the same physics.
//! - [`case`] is one case with all its scores: [`localization`], [`values`], [`wiring`].
//! - [`baseline`] answers studies in simple ways that a diagnosis must surpass.
//! - [`oracle`] is the answer that cannot be wrong: a check of the scorer itself.
//! - [`board`] is all cases together, with the intervals and calibration of [`statistics`];
//!   [`lines`] and [`page`] show it.

pub mod answer;
pub mod baseline;
pub mod board;
pub mod case;
pub mod catalogue;
pub mod dirt;
pub mod judge;
pub mod label;
pub mod lines;
pub mod localization;
pub mod oracle;
pub mod page;
pub mod physics;
pub mod sites;
pub mod statistics;
pub mod values;
pub mod wiring;
