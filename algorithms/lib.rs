//! Algorithms of ASID that need no native library: Fisher information, optimisers, exploration,
//! identification and solving.
//!
//! The crate names no engine and no task.

pub mod explore;
pub mod fisher;
pub mod identify;
pub mod optimise;
pub mod solve;
