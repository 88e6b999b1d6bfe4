//! Effects compared with theory on every built-in engine, and bitwise without any effect at their
//! null value.

#![allow(clippy::unwrap_used)]

mod bench;
mod bodies;
mod commands;
mod contacts;
mod contract;
mod general;
mod joints;
mod limits;
mod motor_side;
mod page;
mod sensors;
mod servos;
mod supply;
mod transmitted;

use asid::core::Scene;
use asid::core::registry::{BackendEntry, all};
use asid::effects::refined::Refined;

/// Inertia of the rotor, kg m².
pub const INERTIA: f64 = 0.5;

/// Time step of the scenes, s.
pub const DT: f64 = 0.002;

/// A motor on a hinge about the vertical axis, with an inertia of 0.5 kg m² from the rotor alone.
pub const ROTOR: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
  <worldbody><body name="rotor"><joint name="spin" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.5 0.5 0.5"/></body></worldbody>
  <actuator><motor name="drive" joint="spin" gear="1"/></actuator>
  <sensor><jointpos name="angle" joint="spin"/><jointvel name="speed" joint="spin"/></sensor></mujoco>"#;

#[test]
fn unknown_sites_and_parameters_list_the_near_ones() {
    let scene = Scene::from_xml("rotor", ROTOR, &[]).unwrap();
    let backend = (all::<BackendEntry>()[0].make)().unwrap();
    for (text, expected) in [
        (
            "actuator-gian@drive",
            "did you mean `actuator-bias`, `actuator-gain`, ",
        ),
        ("actuator-gain@driv", "did you mean `drive`?"),
        ("actuator-gain@drive:gian=1", "did you mean `gain`?"),
    ] {
        let Err(error) = Refined::load(&*backend, &scene, &[text.parse().unwrap()]) else {
            panic!("{text} was accepted");
        };
        assert!(error.to_string().contains(expected), "{error}");
    }
}
