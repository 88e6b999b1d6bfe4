//! The machines, one file each: the training half, then the test half.

use crate::machine::{Half, Machine};

pub mod arm2;
pub mod arm3;
pub mod arm6;
pub mod arm7;
pub mod belt_slide;
pub mod bimanual;
pub mod cart_pole;
pub mod curling_stone;
pub mod free_flight;
pub mod geared_lift;
pub mod gripper;
pub mod hopper;
pub mod lid;
pub mod pushed_puck;
pub mod quadrotor;
pub mod rolling_ball;
pub mod servo;
pub mod tendon_finger;
pub mod wheeled_base;

/// All machines.
pub const ALL: &[&Machine] = &[
    &servo::MACHINE,
    &belt_slide::MACHINE,
    &cart_pole::MACHINE,
    &arm2::MACHINE,
    &arm6::MACHINE,
    &bimanual::MACHINE,
    &gripper::MACHINE,
    &pushed_puck::MACHINE,
    &rolling_ball::MACHINE,
    &geared_lift::MACHINE,
    &lid::MACHINE,
    &arm3::MACHINE,
    &arm7::MACHINE,
    &tendon_finger::MACHINE,
    &wheeled_base::MACHINE,
    &quadrotor::MACHINE,
    &hopper::MACHINE,
    &curling_stone::MACHINE,
    &free_flight::MACHINE,
];

/// The machines of a half.
pub fn of(half: Half) -> impl Iterator<Item = &'static Machine> {
    ALL.iter().copied().filter(move |m| m.half == half)
}
