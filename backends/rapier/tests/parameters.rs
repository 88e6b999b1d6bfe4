//! Every kind of parameter has an effect, and the right one.

#![allow(clippy::unwrap_used)]

mod support;

use asid_core::simulator::ParameterChange;
use asid_core::{Backend, BatchConfig, Control, Error, Rollout, Target};
use asid_rapier::Rapier;
use support::{Bench, scene};

const G: f64 = 9.81;

const SCENE: &str = r#"<option timestep="0.002"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 .1" condim="6" friction="0.1 0.001 0.001"/>
    <body name="crate" pos="0 0 0.05"><freejoint name="crate"/>
      <geom name="crate" type="box" size=".05 .05 .05" mass=".4" condim="6" friction="0.1 0.001 0.001"/>
      <geom name="weight" type="sphere" size=".01" mass=".2" contype="0" conaffinity="0"/></body>
    <body name="ball" pos="1 0 0.05"><freejoint name="ball"/>
      <geom name="ball" type="sphere" size=".05" mass=".3" condim="6" friction="1 0.001 0.001"/></body>
    <body name="arm" pos="0 2 1"><joint name="arm" axis="0 1 0" damping="0.05" armature="0.01"/>
      <geom name="bob" type="sphere" size=".05" pos="0.3 0 0" mass="0.5"/></body>
  </worldbody>
  <actuator><position name="servo" joint="arm" kp="20" kv="2"/></actuator>"#;

fn value_after(target: &str, value: Option<f64>, channel: &str, steps: usize) -> f64 {
    let mut bench = Bench::with(&scene(SCENE), &[channel], 1, 1, &[target]);
    if let Some(value) = value {
        bench.simulator.set_parameters(&[0], &[value]).unwrap();
    }
    let layout = bench.simulator.layout().clone();
    let mut qpos = vec![0.0; layout.nq];
    qpos[..7].copy_from_slice(&[0., 0., 0.05, 1., 0., 0., 0.]);
    qpos[7..14].copy_from_slice(&[1., 0., 0.05, 1., 0., 0., 0.]);
    let mut qvel = vec![0.0; layout.nv];
    qvel[..6].copy_from_slice(&[0.5, 0., 0., 0., 0., 5.]);
    qvel[6..12].copy_from_slice(&[0.5, 0., 0., 0., 10., 5.]);
    bench.place(&qpos, &qvel);
    bench.run(steps, &[0.2])[steps - 1][0]
}

#[test]
fn every_parameter_acts() {
    let cases = [
        ("geom/crate/friction/0", 0.4, "qpos.crate"),
        ("geom/ball/friction/1", 0.01, "qvel.ball"),
        ("geom/ball/friction/2", 0.01, "qpos.ball"),
        ("geom/crate/pos/2", 0.01, "qpos.crate"),
        ("geom/weight/pos/0", 0.04, "qpos.crate"),
        ("geom/weight/mass", 2.0, "contact.world/crate"),
        ("body/ball/mass", 0.6, "contact.world/ball"),
        ("body/ball/ipos/0", 0.02, "qpos.ball"),
        ("body/ball/inertia/1", 0.01, "qpos.ball"),
        ("body/arm/mass", 1.0, "qpos.arm"),
        ("joint/arm/damping", 1.0, "qpos.arm"),
        ("joint/arm/frictionloss", 0.5, "qpos.arm"),
        ("joint/arm/stiffness", 5.0, "qpos.arm"),
        ("joint/arm/armature", 0.1, "qpos.arm"),
        ("actuator/servo/kp", 40.0, "qpos.arm"),
        ("actuator/servo/kv", 1.0, "qpos.arm"),
        ("actuator/servo/gear", 2.0, "qpos.arm"),
        ("option/gravity/2", -5.0, "qpos.arm"),
    ];
    for (target, value, channel) in cases {
        // For some, the y and z components matter: the first that differs decides.
        let mut nominal = Bench::with(&scene(SCENE), &[channel], 2, 1, &[target]);
        let model = Rapier.load(&scene(SCENE)).unwrap();
        let parsed: Target = target.parse().unwrap();
        let now = model.nominal(&parsed).unwrap();
        nominal
            .simulator
            .set_parameters(&[0, 1], &[now, value])
            .unwrap();
        let layout = nominal.simulator.layout().clone();
        let mut qvel = vec![0.0; 2 * layout.nv];
        for sim in 0..2 {
            let v = &mut qvel[sim * layout.nv..(sim + 1) * layout.nv];
            v[..6].copy_from_slice(&[0.5, 0., 0., 0., 0., 5.]);
            v[6..12].copy_from_slice(&[0.5, 0., 0., 0., 10., 5.]);
        }
        let one = [
            0., 0., 0.05, 1., 0., 0., 0., 1., 0., 0.05, 1., 0., 0., 0., 0.,
        ];
        let qpos = [one, one].concat();
        nominal.simulator.set_state(&[0, 1], &qpos, &qvel).unwrap();
        let rows = nominal.run(200, &[0.2]);
        let gap = rows[199]
            .iter()
            .zip(&rows[399])
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max);
        assert!(gap > 1e-4, "{target} changes `{channel}` by {gap}");
        // Setting the nominal value changes nothing, to the bit.
        let untouched = value_after(target, None, channel, 200);
        assert_eq!(
            untouched,
            value_after(target, Some(now), channel, 200),
            "{target}"
        );
        assert_eq!(untouched, rows[199][0], "{target}");
    }
}

#[test]
fn a_mass_off_the_middle_loads_that_side() {
    // A beam on two feet; the weight at a fifth of the span loads one foot more.
    let inside = r#"<worldbody>
      <body name="left" pos="-0.1 0 0.05"><geom type="box" size=".01 .05 .05"/></body>
      <body name="right" pos="0.1 0 0.05"><geom type="box" size=".01 .05 .05"/></body>
      <body name="beam" pos="0 0 0.12"><freejoint name="beam"/><geom type="box" size=".15 .02 .02" mass="0.1"/>
        <geom name="weight" type="sphere" size=".01" mass="0.4" contype="0" conaffinity="0"/></body></worldbody>"#;
    let channels = ["contact.left/beam", "contact.right/beam"];
    let mut bench = Bench::with(
        &scene(inside),
        &channels,
        1,
        1,
        &["geom/weight/pos/0", "geom/weight/mass"],
    );
    bench.simulator.set_parameters(&[0], &[0.05, 0.6]).unwrap();
    let end = bench.run(500, &[]).pop().unwrap();
    // Each foot bears somewhere within its 0.02 m width, so moments are only known to that
    // accuracy.
    let total = 0.7 * G;
    assert!((end[0] + end[1] - total).abs() < 0.01, "{end:?}");
    let lean = (end[1] - end[0]) * 0.1 / total;
    let center = 0.6 * 0.05 / 0.7;
    assert!((lean - center).abs() < 0.01, "{lean} against {center}");
}

#[test]
fn a_change_acts_from_its_frame_on() {
    let inside = r#"<worldbody><body pos="0 0 9"><freejoint name="b"/><geom type="sphere" size=".1" mass="1"/></body></worldbody>"#;
    let mut bench = Bench::with(&scene(inside), &["qvel.b"], 2, 1, &["option/gravity/2"]);
    let record = bench.simulator.layout().recording(&["qvel.b"]).unwrap();
    let mut out = vec![0.0; 2 * 100 * 6];
    let mut rollout = Rollout::new(&[0, 1], 100, 1, Control::Shared(&[]), &record);
    let changes = [ParameterChange {
        frame: 50,
        column: 0,
        values: &[0.0, 9.81],
    }];
    rollout.changes = &changes;
    bench.simulator.rollout(&rollout, &mut out).unwrap();
    let z = |sim: usize, frame: usize| out[(sim * 100 + frame) * 6 + 2];
    assert!((z(0, 49) + 0.981).abs() < 1e-4 && (z(0, 99) + 0.981).abs() < 1e-4);
    assert!(z(1, 99).abs() < 1e-4);
}

#[test]
fn a_moved_center_keeps_the_origins_velocity() {
    let mut bench = Bench::with(&scene(SCENE), &["qvel.crate"], 1, 1, &["body/crate/ipos/0"]);
    let layout = bench.simulator.layout().clone();
    let mut qpos = vec![0.0; layout.nq];
    qpos[..7].copy_from_slice(&[0., 0., 1.0, 1., 0., 0., 0.]);
    qpos[7..14].copy_from_slice(&[1., 0., 1.0, 1., 0., 0., 0.]);
    let mut qvel = vec![0.0; layout.nv];
    qvel[..6].copy_from_slice(&[0.1, 0.2, 0.3, 1., 2., 3.]);
    bench.place(&qpos, &qvel);
    bench.simulator.set_parameters(&[0], &[0.03]).unwrap();
    for (read, set) in bench.read().iter().zip(&qvel) {
        assert!((read - set).abs() < 1e-6, "{read} against {set}");
    }
}

#[test]
fn targets_that_make_no_sense_are_refused() {
    let model = Rapier.load(&scene(SCENE)).unwrap();
    let refused = |text: &str| {
        let target: Target = text.parse().unwrap();
        model.nominal(&target).unwrap_err()
    };
    for (target, says) in [
        ("geom/crat/mass", "did you mean `crate`"),
        ("geom/crate/friction/3", "out of 0..3"),
        ("geom/weight/friction/0", "no contact"),
        ("geom/floor/mass", "no primitive"),
        ("geom/crate/colour", "known: friction, pos, mass"),
        ("joint/arm/ref", "known: pos, axis, damping"),
        ("actuator/servo/gain", "known: kp"),
        ("body/world/mass", "neither place nor mass"),
        ("option/wind/0", "no such parameter"),
    ] {
        let error = refused(target);
        assert!(
            matches!(error, Error::Parameter { .. }),
            "{target}: {error}"
        );
        assert!(error.to_string().contains(says), "{target}: {error}");
    }
    for target in ["geom/crate/solref/0", "joint/crate/damping"] {
        assert!(matches!(refused(target), Error::Incapable { .. }));
    }
    let mut bench = Bench::with(&scene(SCENE), &["qpos.arm"], 1, 1, &["geom/crate/mass"]);
    for value in [-1.0, f64::NAN] {
        let error = bench.simulator.set_parameters(&[0], &[value]).unwrap_err();
        assert!(error.to_string().contains("geom/crate/mass"), "{error}");
    }
}

/// Symptom: a payload weighed nothing. Cause: it changes the masses of a body's geoms, and the mass
/// of the body, beside them, was put back to its own value.
#[test]
fn a_body_has_one_mass() {
    let model = Rapier.load(&scene(SCENE)).unwrap();
    let made = |targets: [&str; 2]| {
        let config = BatchConfig {
            size: 1,
            threads: 1,
            targets: targets.iter().map(|t| t.parse().unwrap()).collect(),
        };
        model.simulator(&config).map(|_| ())
    };
    let (body, weight) = ("body/crate/mass", "geom/weight/mass");
    for targets in [[body, weight], [weight, body], [body, "geom/weight/pos/0"]] {
        let error = made(targets).unwrap_err().to_string();
        let whole = error.contains(targets[1]) && error.contains(targets[0]);
        assert!(whole && error.contains("same mass properties"), "{error}");
    }
    let error = made(["option/gravity/2"; 2]).unwrap_err().to_string();
    assert!(error.contains("named twice"), "{error}");
    // Another body's geoms are no part of it.
    assert!(made([body, "geom/ball/mass"]).is_ok());
}

#[test]
fn a_friction_that_never_counts_is_refused() {
    let target: Target = "geom/crate/friction/0".parse().unwrap();
    let nominal = |inside: &str| Rapier.load(&scene(inside)).unwrap().nominal(&target);
    let refused = |inside: &str, says: [&str; 2]| {
        let error = nominal(inside).unwrap_err().to_string();
        let whole =
            error.contains("geom/crate/friction/0") && says.iter().all(|s| error.contains(s));
        assert!(whole && error.lines().count() == 1, "{error}");
    };
    // With an explicit pair for the floor, the crate's own friction matters only for the ball.
    let pair =
        r#"<contact><pair geom1="floor" geom2="crate" friction="0.5 0.5 0.1 0.1 0.1"/></contact>"#;
    let paired = format!("{SCENE}{pair}");
    assert!(nominal(&paired).is_ok());
    // Without contact bits the crate touches only the floor, by the pair.
    let own = r#"<geom name="crate" "#;
    let ghost = format!(r#"{own}contype="0" conaffinity="0" "#);
    let alone = paired.replace(own, &ghost);
    refused(&alone, ["<pair>", "`floor`"]);
    // A pair without friction takes that of its geoms.
    let plain = alone.replace(r#" friction="0.5 0.5 0.1 0.1 0.1""#, "");
    assert!(nominal(&plain).is_ok());
    // All others have priority over the crate; with one fewer its friction counts.
    let others = SCENE.replace("<geom ", r#"<geom priority="1" "#);
    let others = others.replace(
        r#"<geom priority="1" name="crate""#,
        r#"<geom name="crate""#,
    );
    refused(&others, ["higher priority", "`floor`"]);
    let equal = others.replace(r#"<geom priority="1" name="ball""#, r#"<geom name="ball""#);
    assert!(nominal(&equal).is_ok());
}
