//! Effects against theory on every engine that is built in, and off at their null value to the bit.

#![allow(clippy::unwrap_used)]

use asid::core::effect::EffectSpec;
use asid::core::refined::Refined;
use asid::core::registry::{BackendEntry, EffectEntry, all};
use asid::core::{BatchConfig, Capabilities, Control, Model as _, Plant, Rollout, Scene};

/// A motor on a hinge about the vertical axis: inertia 0.5 kg m² about it, from the rotor alone.
const ROTOR: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
  <worldbody><body name="rotor"><joint name="spin" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.5 0.5 0.5"/></body></worldbody>
  <actuator><motor name="drive" joint="spin" gear="1"/></actuator>
  <sensor><jointvel name="speed" joint="spin"/></sensor></mujoco>"#;

const INERTIA: f64 = 0.5;
const STEPS: usize = 500;
const DT: f64 = 0.002;

/// Speed after one second from `speed` under a constant command, with an effect; one row an engine
/// with the tolerance of its arithmetic.
fn speeds(effect: Option<&str>, speed: f64, command: f64) -> Vec<(String, f64, f64)> {
    let scene = Scene::from_xml("rotor", ROTOR, &[]).unwrap();
    let mut rows = Vec::new();
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        if !backend.capabilities().contains(Capabilities::STEP_HOOKS) {
            continue;
        }
        let specs: Vec<EffectSpec> = effect.iter().map(|e| e.parse().unwrap()).collect();
        let model = Refined::load(&*backend, &scene, &specs).unwrap();
        let layout = model.layout();
        let config = BatchConfig {
            size: 1,
            threads: 1,
            targets: Vec::new(),
        };
        let mut simulator = model.simulator(&config).unwrap();
        simulator.set_state(&[0], &[0.0], &[speed]).unwrap();
        let recording = layout.recording(&["speed"]).unwrap();
        let control = [command];
        let rollout = Rollout::new(&[0], 1, STEPS, Control::Shared(&control), &recording);
        let mut out = [0.0];
        simulator.rollout(&rollout, &mut out).unwrap();
        let double = backend
            .capabilities()
            .contains(Capabilities::DOUBLE_PRECISION);
        rows.push((
            entry.name.to_owned(),
            out[0],
            if double { 1e-9 } else { 1e-4 },
        ));
    }
    rows
}

#[test]
fn viscous_friction_slows_a_rotor_step_by_step() {
    // Explicit in time: each step takes the share damping * dt / inertia.
    let damping = 0.8;
    let expected = 3.0 * (1.0 - damping * DT / INERTIA).powi(STEPS as i32);
    for (engine, speed, tolerance) in speeds(Some("viscous-friction@spin:damping=0.8"), 3.0, 0.0) {
        assert!(
            (speed - expected).abs() < tolerance * 3.0,
            "{engine}: {speed}, expected {expected}"
        );
    }
}

#[test]
fn gain_and_bias_change_the_torque() {
    for (effect, torque) in [
        ("actuator-gain@drive:gain=0.7", 0.7),
        ("actuator-bias@drive:bias=-0.05", 0.95),
    ] {
        // Torque over inertia, for one second.
        let expected = torque / INERTIA;
        for (engine, speed, tolerance) in speeds(Some(effect), 0.0, 1.0) {
            assert!(
                (speed - expected).abs() < 10.0 * tolerance,
                "{engine}, {effect}: {speed}, expected {expected}"
            );
        }
    }
}

#[test]
fn every_effect_is_off_at_its_null_value_to_the_bit() {
    let without = speeds(None, 1.0, 0.3);
    for entry in all::<EffectEntry>() {
        for site in ["drive", "spin"] {
            let scene = Scene::from_xml("rotor", ROTOR, &[]).unwrap();
            let backend = (all::<BackendEntry>()[0].make)().unwrap();
            let effect = (entry.make)();
            let sites = effect.sites(&Plant::of(&scene).unwrap());
            if !sites.iter().any(|s| s == site) {
                continue;
            }
            let with = speeds(Some(&format!("{}@{site}", entry.name)), 1.0, 0.3);
            assert_eq!(with, without, "{}@{site}", entry.name);
        }
    }
}

#[test]
fn unknown_sites_and_parameters_list_the_near_ones() {
    let scene = Scene::from_xml("rotor", ROTOR, &[]).unwrap();
    let backend = (all::<BackendEntry>()[0].make)().unwrap();
    for (text, expected) in [
        (
            "actuator-gian@drive",
            "known: `actuator-bias`, `actuator-gain`",
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
