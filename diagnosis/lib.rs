//! Diagnosis of the sim-to-real gap: where it lies, which unmodelled effect causes it, and how far
//! it shrinks once that effect is added.
//!
//! - [`study`] is the user's input: a model, logs of the real machine, and the parameters that are
//!   already fitted.
//! - [`intake`] examines the logs before any physics: outliers, and [`wiring`].
//! - [`latent_force`] asks which force is missing at each moment, or what short replays leave where
//!   bodies touch, and which effects make up for it.
//! - [`predict`] replays the logs in a model for many parameter values at once; [`fit`] is least
//!   squares over such replays.

mod batch_columns;
pub mod bench;
pub mod calibration;
pub mod candidate;
pub mod ceiling;
pub mod chance;
pub mod checks;
pub mod confidence;
pub mod data;
pub mod decision;
pub mod diagnose;
pub mod experiment;
mod explained_noise;
pub mod findings;
pub mod fit;
pub mod forces;
mod home;
pub mod intake;
pub mod judgement;
pub mod latent_force;
pub mod linearise;
pub mod localise;
pub mod machine;
pub mod noise;
mod normal;
pub mod outliers;
mod physics;
pub mod predict;
pub mod prepare;
pub mod record;
pub mod sentence;
pub mod settings;
pub mod skill;
mod starts;
pub mod study;
mod telling;
pub mod trajectory;
pub mod windows;
pub mod wiring;
mod work;

pub use asid_results::{diagnosis as result, trace};
