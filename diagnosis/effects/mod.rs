//! Effects by where they act: on the command, or as a force.

pub mod command;
pub mod force;
