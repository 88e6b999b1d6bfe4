//! Positions, axes, limits and rest positions as parameters: a changed value acts as if it were in
//! the document.

#![allow(clippy::unwrap_used)]

mod common;

use common::*;

/// An arm with a limited, sprung elbow whose servo is limited too, as `<general>` actuators.
const ARM: &str = r#"
<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" damping="0.1"/>
      <geom name="upper" type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="1"/>
      <body name="lower" pos="0.3 0 0">
        <joint name="elbow" axis="0 1 0" damping="0.05" range="-0.6 0.4" stiffness="3" springref="0.2"/>
        <geom name="lower" type="box" pos="0.15 0 0" size="0.15 0.02 0.03" mass="0.4"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <general name="shoulder" joint="shoulder" gainprm="40" biastype="affine" biasprm="0 -40 -4" forcerange="-3 3"/>
    <general name="elbow" joint="elbow" gainprm="2"/>
  </actuator>
</mujoco>"#;

/// Targets with values, and the piece of the document that sets them, before and after.
const CASES: [(&[&str], &[f64], &str, &str); 7] = [
    (
        &["body/lower/pos/0", "body/lower/pos/2"],
        &[0.25, 0.05],
        r#""lower" pos="0.3 0 0""#,
        r#""lower" pos="0.25 0 0.05""#,
    ),
    (
        &["joint/elbow/axis/0", "joint/elbow/axis/2"],
        &[0.2, -0.1],
        r#""elbow" axis="0 1 0""#,
        r#""elbow" axis="0.2 1 -0.1""#,
    ),
    (
        &["joint/elbow/range/0", "joint/elbow/range/1"],
        &[-0.1, 0.1],
        "-0.6 0.4",
        "-0.1 0.1",
    ),
    (
        &["joint/elbow/springref"],
        &[-0.4],
        r#"springref="0.2""#,
        r#"springref="-0.4""#,
    ),
    (
        &[
            "actuator/shoulder/forcerange/0",
            "actuator/shoulder/forcerange/1",
        ],
        &[-1.0, 1.5],
        r#"forcerange="-3 3""#,
        r#"forcerange="-1 1.5""#,
    ),
    (
        &["actuator/shoulder/kp"],
        &[25.0],
        r#"gainprm="40" biastype="affine" biasprm="0 -40 -4""#,
        r#"gainprm="25" biastype="affine" biasprm="0 -25 -4""#,
    ),
    (
        &["actuator/shoulder/kv"],
        &[1.0],
        r#"biasprm="0 -40 -4""#,
        r#"biasprm="0 -40 -1""#,
    ),
];

#[test]
fn a_changed_parameter_is_as_if_written_in_the_document() {
    let model = load(ARM);
    let record = recording(&model, &["qpos.shoulder", "qpos.elbow"]);
    let plain = roll(&mut batch(&model, 1, 1, &[]), 100, 5, &waves(100), &record);
    for (targets, values, old, new) in CASES {
        let xml = ARM.replace(old, new);
        assert_ne!(xml, ARM, "{targets:?}");
        let written = load(&xml);
        let expected = roll(
            &mut batch(&written, 1, 1, &[]),
            100,
            5,
            &waves(100),
            &record,
        );
        let mut simulator = batch(&model, 2, 1, targets);
        simulator.set_parameters(&[1], values).unwrap();
        let out = roll(&mut simulator, 100, 5, &waves(100), &record);
        let (same, changed) = out.split_at(plain.len());
        let apart = |x: &[f64], y: &[f64]| {
            let pairs = x.iter().zip(y);
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        // Rounding: the engine's shortcuts differ if an axis may turn.
        assert!(apart(same, &plain) < 1e-9, "{targets:?}");
        assert!(
            apart(changed, &expected) < 1e-9,
            "{targets:?}: {}",
            apart(changed, &expected)
        );
        assert!(apart(&expected, &plain) > 1e-3, "{targets:?} shows nothing");
        // Back to the scene's values.
        let nominal: Vec<f64> = targets
            .iter()
            .map(|t| model.nominal(&t.parse().unwrap()).unwrap())
            .collect();
        simulator.set_parameters(&[1], &nominal).unwrap();
        simulator.reset(&[0, 1]).unwrap();
        let out = roll(&mut simulator, 100, 5, &waves(100), &record);
        assert_eq!(
            bits(&out[..plain.len()]),
            bits(&out[plain.len()..]),
            "{targets:?}"
        );
    }
}

#[test]
fn an_axis_without_direction_is_refused() {
    let mut simulator = batch(&load(ARM), 1, 1, &["joint/elbow/axis/1"]);
    let error = simulator.set_parameters(&[0], &[0.0]).unwrap_err();
    assert!(error.to_string().contains("no direction"), "{error}");
}
