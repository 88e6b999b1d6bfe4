//! Checks what each cause does against closed forms, conservation of energy and momentum, and
//! forces by hand.
//!
//! The tolerances are those of a first-order integrator at a time step of 0.5 ms: a few parts in a
//! thousand.

mod bodies;
mod commands;
mod contacts;
mod joints;
mod readings;
mod rig;
