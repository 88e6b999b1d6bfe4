//! Algorithms of ASID that need no native library: optimisers, exploration by
//! random actions and by Fisher information, identification and solving.
//!
//! Nothing here names an engine or a task.

pub mod explore;
pub mod identify;
pub mod optimise;
pub mod solve;
