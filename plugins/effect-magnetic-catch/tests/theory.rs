//! The catch against theory: energy is conserved and gives the speed over the magnet.

#![allow(clippy::unwrap_used)]

use asid_core::{BatchConfig, Control, Model as _, Rollout, Scene};
use asid_effects::EffectSpec;
use asid_effects::refined::Refined;

// Linking the crate registers the effect.
use magnetic_catch as _;

/// A rotor of 0.5 kg m² on which nothing else acts.
const ROTOR: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
  <worldbody><body name="rotor"><joint name="spin" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.5 0.5 0.5"/></body></worldbody>
  <sensor><jointpos name="angle" joint="spin"/><jointvel name="speed" joint="spin"/></sensor></mujoco>"#;

const INERTIA: f64 = 0.5;
const FRAMES: usize = 1000;

/// Angle and speed after each step of 2 ms, from an initial angle and speed.
fn motion(effect: Option<&str>, angle: f64, speed: f64) -> Vec<[f64; 2]> {
    let scene = Scene::from_xml("rotor", ROTOR, &[]).unwrap();
    let specs: Vec<EffectSpec> = effect.iter().map(|e| e.parse().unwrap()).collect();
    let model = Refined::load(&asid_rapier::Rapier, &scene, &specs).unwrap();
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: Vec::new(),
    };
    let mut simulator = model.simulator(&config).unwrap();
    simulator.set_state(&[0], &[angle], &[speed]).unwrap();
    let recording = model.layout().recording(&["angle", "speed"]).unwrap();
    let rollout = Rollout::new(&[0], FRAMES, 1, Control::Shared(&[]), &recording);
    let mut out = vec![0.0; FRAMES * 2];
    simulator.rollout(&rollout, &mut out).unwrap();
    out.chunks_exact(2).map(|row| [row[0], row[1]]).collect()
}

#[test]
fn the_speed_over_the_magnet_follows_from_its_energy() {
    let (depth, place, width, speed) = (0.4, 0.2, 0.1, 1.0);
    let effect = format!("magnetic-catch@spin:depth={depth},place={place},width={width}");
    let energy = |[q, v]: [f64; 2]| {
        let x = (q - place) / width;
        0.5 * INERTIA * v * v - depth * (-0.5 * x * x).exp()
    };
    let path = motion(Some(&effect), -0.5, speed);
    let total = 0.5 * INERTIA * speed * speed;
    // The error of a semi-implicit step is the work of half a step: F v dt / 2, at most 0.007 J
    // here.
    for &row in &path {
        let error = energy(row) - total;
        assert!(error.abs() < 0.007, "{row:?}: energy is off by {error} J");
    }
    let fastest = path.iter().map(|row| row[1]).fold(0.0, f64::max);
    let expected = (speed * speed + 2.0 * depth / INERTIA).sqrt();
    assert!(
        (fastest / expected - 1.0).abs() < 0.01,
        "{fastest}, expected {expected}"
    );
    let last = path[FRAMES - 1];
    assert!(
        last[0] > 1.0 && (last[1] - speed).abs() < 0.01,
        "it does not leave as it came: {last:?}"
    );
}

#[test]
fn a_slow_rotor_is_caught() {
    // The energy is below zero, so the rotor cannot leave the well.
    let path = motion(Some("magnetic-catch@spin:depth=0.4"), 0.15, 0.2);
    assert!(path.iter().all(|row| row[0].abs() < 0.3));
}

#[test]
fn off_at_its_null_value_to_the_bit() {
    assert_eq!(
        motion(Some("magnetic-catch@spin"), 0.05, 0.3),
        motion(None, 0.05, 0.3)
    );
}

#[test]
fn a_width_of_zero_is_refused() {
    let scene = Scene::from_xml("rotor", ROTOR, &[]).unwrap();
    let spec: EffectSpec = "magnetic-catch@spin:width=0".parse().unwrap();
    let refined = Refined::load(&asid_rapier::Rapier, &scene, &[spec]);
    let error = refined.map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("not above 0"), "{error}");
}
