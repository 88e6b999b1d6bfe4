//! The machines, one file each.

use crate::machine::{Half, Machine};

pub mod arm3;
pub mod pushed_puck;
pub mod servo;

/// All machines.
pub const ALL: &[&Machine] = &[
    &servo::MACHINE,
    &pushed_puck::MACHINE,
    &arm3::MACHINE,
];

/// The machines of a half.
pub fn of(half: Half) -> impl Iterator<Item = &'static Machine> {
    ALL.iter().copied().filter(move |m| m.half == half)
}
