//! Generates worlds whose effect is withheld, to measure the diagnosis.
//!
//! A [`case`] is a study: a model, logs, and the parameters that its owner fits. The machine
//! differs from its model by [`causes`] that only the case's [`label`] names. The generator must
//! not depend on what it measures. This crate therefore shares no code with effects, diagnosis or
//! tasks. It drives MuJoCo itself, edits the model's text, and implements forces and filters by
//! hand, at another time step than the study's model.
//!
//! - [`machines`]: one file each, in two halves by kind of machine.
//! - [`outside`]: machines that other authors modelled.
//! - [`causes`]: one file each.
//! - [`world`], [`simulate`], [`rotor`]: a machine with causes, and its run.
//! - [`gap`], [`size`]: how far a world is from its model, and how large a cause must be for a
//!   wanted gap.
//! - [`regime`]: the regime of motion of each reading.
//! - [`dirt`], [`faults`], [`log`]: small deviations of every machine, faults of logs, and writing
//!   logs.
//! - [`plan`], [`case`], [`make`], [`seal`]: which cases there are, and how they are written and
//!   sealed.

pub mod anatomy;
pub mod case;
pub mod cause;
pub mod causes;
pub mod dirt;
pub mod document;
pub mod engine;
pub mod error;
pub mod faults;
pub mod gap;
pub mod label;
pub mod log;
pub mod machine;
pub mod machines;
pub mod make;
pub mod motion;
pub mod outside;
pub mod plan;
pub mod random;
pub mod regime;
pub mod rotor;
pub mod seal;
pub mod simulate;
pub mod size;
pub mod world;

pub use error::{Error, Result};
pub use machine::Half;
