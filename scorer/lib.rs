//! Scores diagnoses of cases whose cause was withheld: the eyes behind the measuring stick.
//!
//! A case is a study with a sealed label; a diagnosis answers it with a `result.json`. This crate compares both. It
//! reads the answer as a file and not as types of the diagnosis, and shares none of its code: what it has to know of
//! physics it replays itself, with the engines and the catalogue of effects.
//!
//! - [`label`] and [`answer`] are the two files.
//! - [`catalogue`], [`sites`] and [`dirt`] say when names agree; [`judge`] says whether an answer is right.
//! - [`physics`] refits the sets that were named, and says which of them are the same physics.
//! - [`case`] is one case with everything that is scored of it: [`localization`], [`values`], [`wiring`].
//! - [`baseline`] answers studies in ways that a diagnosis has to be better than.
//! - [`oracle`] is the answer that cannot be wrong: a check of the scorer itself.
//! - [`board`] is all cases together, with the intervals and calibration of [`statistics`]; [`lines`] and [`page`] show it.

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
