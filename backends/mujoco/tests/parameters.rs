//! Parameters: each target has an effect, and mass properties change as if compiled.

#![allow(clippy::unwrap_used)]

mod common;

use asid_core::simulator::{ExternalForce, ParameterChange};
use asid_core::{Control, Error, Rollout};
use common::*;

/// Every target of the table in `asid_core::layout`, with a value that is not the nominal one.
const TARGETS: [(&str, f64, f64); 20] = [
    ("geom/floor/friction/0", 0.6, 0.1),
    ("geom/ball/friction/1", 0.005, 0.2),
    ("geom/ball/friction/2", 0.0001, 0.05),
    ("geom/ball/solref/0", 0.02, 0.08),
    ("geom/ball/solref/1", 1.0, 0.3),
    ("geom/bob/pos/0", 0.3, 0.2),
    ("geom/bob/mass", 0.3, 0.8),
    ("body/lower/mass", 0.7, 1.4),
    ("body/lower/ipos/2", 0.0, 0.05),
    ("body/ball/inertia/1", 0.002, 0.003),
    ("joint/shoulder/damping", 0.1, 3.0),
    ("joint/elbow/frictionloss", 0.02, 0.4),
    ("joint/elbow/stiffness", 0.0, 5.0),
    ("joint/elbow/armature", 0.0, 0.1),
    ("actuator/shoulder/kp", 40.0, 15.0),
    ("actuator/shoulder/kv", 4.0, 1.0),
    ("actuator/elbow/gear", 2.0, 0.5),
    ("option/gravity/2", -9.81, -3.0),
    ("option/gravity/0", 0.0, 1.0),
    ("joint/ball/damping", 0.0, 0.5),
];

#[test]
fn every_target_reads_its_nominal_value_and_acts() {
    let model = load(ARM);
    let record = recording(&model, &["qpos.shoulder", "qpos.elbow", "qpos.ball"]);
    let plain = roll(&mut batch(&model, 1, 1, &[]), 100, 5, &waves(100), &record);
    for (target, nominal, value) in TARGETS {
        let found = model.nominal(&target.parse().unwrap()).unwrap();
        assert!(
            (found - nominal).abs() < 1e-12,
            "{target}: {found} is not {nominal}"
        );
        let mut simulator = batch(&model, 2, 1, &[target]);
        simulator.set_parameters(&[1], &[value]).unwrap();
        let out = roll(&mut simulator, 100, 5, &waves(100), &record);
        let (same, changed) = out.split_at(plain.len());
        let apart = |x: &[f64]| {
            x.iter()
                .zip(&plain)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max)
        };
        // A batch that moves mass is compiled without shortcuts for diagonal inertia: the same
        // motion up to rounding, which contact amplifies.
        assert!(
            apart(same) < 1e-8,
            "{target}: nominal moved {}",
            apart(same)
        );
        assert!(
            apart(changed) > 1e-6,
            "{target}: moved only {}",
            apart(changed)
        );
        // Back to nominal: as if it had never changed.
        simulator.set_parameters(&[1], &[found]).unwrap();
        simulator.reset(&[0, 1]).unwrap();
        let out = roll(&mut simulator, 100, 5, &waves(100), &record);
        let (a, b) = out.split_at(plain.len());
        assert_eq!(bits(a), bits(b), "{target}");
    }
}

#[test]
fn a_changed_geom_is_as_if_compiled() {
    // The same change written into the document and compiled.
    let changed = ARM
        .replace(
            r#"type="sphere" pos="0.3 0 0" size="0.04" mass="0.3""#,
            r#"type="sphere" pos="0.25 0.02 0.03" size="0.04" mass="0.55""#,
        )
        .replace(
            r#"size="0.15 0.02 0.03" mass="0.4""#,
            r#"size="0.15 0.02 0.03" mass="0.25""#,
        );
    let expected = load(&changed);
    let model = load(ARM);
    let mut simulator = batch(
        &model,
        1,
        1,
        &[
            "geom/bob/pos/0",
            "geom/bob/pos/1",
            "geom/bob/pos/2",
            "geom/bob/mass",
            "geom/lower/mass",
        ],
    );
    simulator
        .set_parameters(&[0], &[0.25, 0.02, 0.03, 0.55, 0.25])
        .unwrap();
    let record = recording(
        &model,
        &["qpos.shoulder", "qpos.elbow", "qvel.elbow", "torque"],
    );
    let got = roll(&mut simulator, 100, 5, &waves(100), &record);
    let want = roll(
        &mut batch(&expected, 1, 1, &[]),
        100,
        5,
        &waves(100),
        &record,
    );
    let worst = got
        .iter()
        .zip(&want)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    // Two ways to sum the same inertia differ by rounding; a second of a two-link arm amplifies it
    // little.
    assert!(worst < 1e-9, "{worst}");
}

#[test]
fn a_free_ball_with_its_weight_moved_tumbles_as_if_compiled() {
    // A centred ball is compiled with shortcuts that are invalid once its centre of mass moves.
    let changed = FALLING.replace(
        r#"size="0.1" mass="0.5""#,
        r#"size="0.1" mass="0.5" pos="0.03 0 0.01""#,
    );
    let model = load(FALLING);
    let mut simulator = batch(&model, 1, 1, &["geom/ball/pos/0", "geom/ball/pos/2"]);
    simulator.set_parameters(&[0], &[0.03, 0.01]).unwrap();
    let mut compiled = batch(&load(&changed), 1, 1, &[]);
    let record = recording(&model, &["qpos.ball"]);
    let spin = [0.0, 0.0, 0.0, 1.0, 2.0, 3.0];
    let pose = [0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0];
    simulator.set_state(&[0], &pose, &spin).unwrap();
    compiled.set_state(&[0], &pose, &spin).unwrap();
    let got = roll(&mut simulator, 30, 1, &[], &record);
    let want = roll(&mut compiled, 30, 1, &[], &record);
    for (a, b) in got.iter().zip(&want) {
        assert!((a - b).abs() < 1e-10, "{a} {b}");
    }
}

#[test]
fn a_body_mass_scales_its_inertia() {
    // A uniform body of twice the mass with twice the torque moves the same.
    let xml = |density: f64, gear: f64| {
        format!(
            r#"<mujoco><option gravity="0 0 0"/><worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>
            <geom type="box" size="0.2 0.03 0.02" pos="0.1 0 0" density="{density}"/></body></worldbody>
            <actuator><motor name="drive" joint="hinge" gear="{gear}"/></actuator></mujoco>"#
        )
    };
    let model = load(&xml(500.0, 1.0));
    let record = recording(&model, &["qpos.hinge"]);
    let mass = model.nominal(&"body/rod/mass".parse().unwrap()).unwrap();
    let mut simulator = batch(&model, 1, 1, &["body/rod/mass", "actuator/drive/gear"]);
    simulator.set_parameters(&[0], &[2.0 * mass, 2.0]).unwrap();
    let got = roll(&mut simulator, 50, 1, &[0.01; 50], &record);
    let want = roll(&mut batch(&model, 1, 1, &[]), 50, 1, &[0.01; 50], &record);
    for (a, b) in got.iter().zip(&want) {
        assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{a} {b}");
    }
}

#[test]
fn a_parameter_changes_at_its_frame() {
    // Free fall: gravity doubles at frame 5, so that v = -g h (5 + 2 * 5).
    let model = load(FALLING);
    let record = recording(&model, &["speed"]);
    let mut simulator = batch(&model, 2, 1, &["option/gravity/2"]);
    let changes = [ParameterChange {
        frame: 5,
        column: 0,
        values: &[-19.62, -9.81],
    }];
    let mut out = vec![0.0; 2 * 10 * 3];
    let rollout = Rollout {
        changes: &changes,
        ..Rollout::new(&[0, 1], 10, 1, Control::Shared(&[]), &record)
    };
    simulator.rollout(&rollout, &mut out).unwrap();
    assert!((out[4 * 3 + 2] + 9.81 * 0.05).abs() < 1e-12);
    assert!((out[9 * 3 + 2] + 9.81 * 0.15).abs() < 1e-12);
    assert!((out[30 + 9 * 3 + 2] + 9.81 * 0.10).abs() < 1e-12);
}

#[test]
fn a_force_accelerates_by_f_over_m() {
    let model = load(FALLING);
    let record = recording(&model, &["speed"]);
    let mut simulator = batch(&model, 1, 1, &[]);
    let wrench: Vec<f64> = [1.5, 0.0, 0.5 * 9.81, 0.0, 0.0, 0.0].repeat(8);
    let forces = [ExternalForce {
        body: model.layout().body("ball").unwrap(),
        wrench: &wrench,
    }];
    let mut out = vec![0.0; 8 * 3];
    let rollout = Rollout {
        forces: &forces,
        ..Rollout::new(&[0], 8, 2, Control::Shared(&[]), &record)
    };
    simulator.rollout(&rollout, &mut out).unwrap();
    // a = F / m = 3 m/s² along x for 16 steps of 10 ms; weight is balanced.
    assert!((out[21] - 3.0 * 0.16).abs() < 1e-12, "{}", out[21]);
    assert!(out[23].abs() < 1e-12, "{}", out[23]);
    // The force ends with the rollout.
    let after = roll(&mut simulator, 1, 1, &[], &record);
    assert!((after[0] - 0.48).abs() < 1e-12);
    assert!((after[2] + 0.0981).abs() < 1e-12);
}

#[test]
fn a_resting_ball_is_carried_by_its_weight() {
    let model = load(
        r#"<mujoco><worldbody><geom name="floor" type="plane" size="1 1 0.1"/>
        <body name="ball" pos="0 0 0.1"><freejoint/><geom size="0.1" mass="0.5"/></body>
        <body name="other" pos="0.5 0 0.1"><freejoint/><geom size="0.1" mass="0.7"/></body>
        </worldbody></mujoco>"#,
    );
    let record = recording(
        &model,
        &[
            "contact.ball/world",
            "contact.world/other",
            "contact.ball/other",
        ],
    );
    let out = roll(&mut batch(&model, 1, 1, &[]), 1, 2000, &[], &record);
    // Soft contact settles exponentially; after 4 s it carries m g.
    assert!((out[0] - 0.5 * 9.81).abs() < 1e-4, "{}", out[0]);
    assert!((out[1] - 0.7 * 9.81).abs() < 1e-4, "{}", out[1]);
    assert_eq!(out[2], 0.0);
}

#[test]
fn bad_targets_say_what_is_wrong() {
    let model = load(ARM);
    for (target, part) in [
        ("geom/bal/mass", "did you mean `ball`"),
        ("geom/ball/colour", "friction, pos, mass, solref"),
        ("body/ball/pos/0", "its state"),
        ("joint/ball/axis/0", "hinge or slide"),
        ("joint/elbow/range/0", "not limited"),
        ("actuator/elbow/forcerange/0", "not limited"),
        ("geom/ball/friction/3", "3 entries"),
        ("geom/floor/mass", "the world has no mass"),
        ("body/world/mass", "the world"),
        ("joint/elbow/kp", "damping"),
        ("actuator/elbow/kp", "no servo"),
        ("option/wind/0", "gravity"),
        ("equality/x/active", "cannot be changed"),
    ] {
        let error = model.nominal(&target.parse().unwrap()).unwrap_err();
        let text = error.to_string();
        assert!(text.contains(part) && error.is_usage(), "{target}: {text}");
    }
    let config = |targets: &[&str]| asid_core::BatchConfig {
        size: 1,
        threads: 1,
        targets: targets.iter().map(|t| t.parse().unwrap()).collect(),
    };
    for (targets, part) in [
        (["geom/bob/mass", "geom/bob/mass"], "twice"),
        (["geom/bob/mass", "body/lower/mass"], "same mass properties"),
    ] {
        let Err(error) = model.simulator(&config(&targets)) else {
            panic!("{targets:?} were taken");
        };
        assert!(error.to_string().contains(part), "{error}");
    }
}

#[test]
fn friction_without_effect_is_refused() {
    let target = "geom/ball/friction/0".parse().unwrap();
    let nominal = |xml: &str| load(xml).nominal(&target).map_err(|e| e.to_string());
    assert_eq!(nominal(ARM), Ok(0.3));
    // The floor and the arm have priority over the ball.
    let above = ARM.replace("<geom name=", "<geom priority=\"2\" name=");
    let above = above.replace("<geom priority=\"2\" name=\"ball\"", "<geom name=\"ball\"");
    let error = nominal(&above).unwrap_err();
    assert!(error.contains("higher priority"), "{error}");
    // With only the floor above it, the ball's friction still counts with the arm.
    let floor = ARM.replace(
        "<geom name=\"floor\"",
        "<geom priority=\"1\" name=\"floor\"",
    );
    assert_eq!(nominal(&floor), Ok(0.3));
    // A pair, and contact bits that allow nothing else.
    let pair = floor
        .replace(
            "<keyframe>",
            "<contact><pair geom1=\"ball\" geom2=\"floor\" friction=\"0.5 0.5 0.1 0.1 0.1\"/></contact><keyframe>",
        )
        .replace("<geom name=\"ball\"", "<geom contype=\"0\" conaffinity=\"0\" name=\"ball\"");
    let error = nominal(&pair).unwrap_err();
    assert!(
        error.contains("<pair>") && error.contains("`floor`"),
        "{error}"
    );
}

#[test]
fn values_that_are_not_physical_are_refused_and_change_nothing() {
    let model = load(ARM);
    let targets = [
        "geom/bob/mass",
        "geom/ball/friction/0",
        "body/ball/inertia/0",
    ];
    let mut simulator = batch(&model, 2, 1, &targets);
    let record = recording(&model, &["qpos.elbow", "qpos.ball"]);
    for bad in [
        [-0.1, 1.0, 0.002],
        [0.3, -1.0, 0.002],
        [0.3, f64::NAN, 0.002],
        [0.3, 1.0, 0.1],
        [f64::INFINITY, 1.0, 0.002],
    ] {
        let values = [[0.5, 0.2, 0.002], bad].concat();
        let error = simulator.set_parameters(&[0, 1], &values).unwrap_err();
        assert!(matches!(error, Error::Parameter { .. }), "{error}");
    }
    let out = roll(&mut simulator, 20, 5, &waves(20), &record);
    let fresh = roll(
        &mut batch(&model, 2, 1, &targets),
        20,
        5,
        &waves(20),
        &record,
    );
    assert_eq!(bits(&out), bits(&fresh));
    assert!(simulator.set_parameters(&[0], &[0.3]).is_err());
    assert!(simulator.set_parameters(&[2], &[0.3, 1.0, 0.002]).is_err());
}
