//! Worlds whose effect is withheld: the measuring stick of the diagnosis.
//!
//! A [`case`] is a study (a model, logs, what its owner fits) of a machine that differs from its model by
//! [`causes`] that only its [`label`] names. So that nothing of the diagnosis can be inside of the stick,
//! this crate shares no code with effects, diagnosis or tasks: it drives MuJoCo itself, edits the model's text,
//! and writes forces and filters by hand, at another time step than the study's model.
//!
//! - [`machines`]: one file each, in two halves by kind of machine.
//! - [`outside`]: machines that others modelled.
//! - [`causes`]: one file each.
//! - [`world`], [`simulate`], [`rotor`]: a machine with causes, and its run.
//! - [`gap`], [`size`]: how far a world is from its model, and how large a cause must be for that.
//! - [`regime`]: in which motion it is so.
//! - [`dirt`], [`faults`], [`log`]: what is off at every machine, and what happens to logs.
//! - [`plan`], [`case`], [`make`], [`seal`]: which cases there are, and how they are written and sealed.

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
