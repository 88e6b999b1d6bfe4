//! Physical effects that a simulator can be given.
//!
//! An effect is attached at a *site* (a joint, an actuator, a sensor, a geom, …) with values of its
//! parameters. At their null values it does exactly nothing. It acts in one of four places: on the
//! model's parameters, on the command before it reaches the drive, as a force during the step, or
//! on the reading of a sensor. Each simulation has its own [`Acting`], which may hold state, as a
//! delay must, and needs no lock.
//!
//! [`refined`] gives a compiled scene its effects. Every algorithm then sees an ordinary model, and
//! an effect's parameter is a target like any other: `effect/actuator-delay@servo/delay`.
//!
//! [`catalogue`] has the effects of ASID, one file for each family. [`refined_model`] is the file
//! of a model with effects. [`native`] writes such a model as a plain MJCF document.

mod acts;
pub mod catalogue;
mod effect;
pub mod native;
mod reach;
pub mod refined;
pub mod refined_model;
mod spec;

pub use acts::Acts;
pub use effect::{
    Acting, Confusion, Effect, EffectEntry, EffectParameter, Native, Reference, Site, Start,
};
pub use reach::Reach;
pub use refined_model::RefinedModel;
pub use spec::EffectSpec;

#[doc(hidden)]
pub use asid_core as __core;
#[doc(hidden)]
pub use inventory as __inventory;
