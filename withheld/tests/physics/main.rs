//! The stick itself: what each cause does, against closed forms and energy, momentum and forces by hand.
//!
//! Tolerances are those of a time step of 0.5 ms of the first order: a few parts in a thousand.

mod bodies;
mod commands;
mod contacts;
mod joints;
mod readings;
mod rig;
