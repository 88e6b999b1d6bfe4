//! Gripping, lifting and laying down a rod with an articulated gripper, all by contact.

#![allow(clippy::unwrap_used)]

mod support;

use support::{Bench, scene};

const SCENE: &str = r#"<option timestep="0.002"/>
  <worldbody>
    <geom type="plane" size="2 2 .1" friction="0.2 0 0"/>
    <body name="ledge" pos="0.4 0 0.075"><geom type="box" size="0.02 0.05 0.075" friction="1 0 0"/></body>
    <body name="rod" pos="0 0 0.02" quat="0.7071067811865476 0 0 -0.7071067811865476"><freejoint name="rod"/>
      <geom type="box" size="0.02 0.15 0.02" mass="0.05" friction="0.2 0 0"/>
      <geom name="weight" type="sphere" size="0.01" mass="0.15" contype="0" conaffinity="0"/></body>
    <body name="carriage" pos="0 0 0.1" gravcomp="1"><joint name="along" type="slide" axis="1 0 0" armature="1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
      <body name="hand" gravcomp="1"><joint name="lift" type="slide" axis="0 0 1" armature="1"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
        <body name="left" gravcomp="1"><joint name="left" type="slide" axis="0 1 0" range="0 0.05" armature="0.1" damping="1"/>
          <geom type="box" pos="-0.008 0.007 -0.08" size="0.004 0.007 0.01" mass="0.01" friction="0.6 0 0"/>
          <geom type="box" pos="0.008 0.007 -0.08" size="0.004 0.007 0.01" mass="0.01" friction="0.6 0 0"/></body>
        <body name="right" gravcomp="1"><joint name="right" type="slide" axis="0 -1 0" range="0 0.05" armature="0.1" damping="1"/>
          <geom type="box" pos="-0.008 -0.007 -0.08" size="0.004 0.007 0.01" mass="0.01" friction="0.6 0 0"/>
          <geom type="box" pos="0.008 -0.007 -0.08" size="0.004 0.007 0.01" mass="0.01" friction="0.6 0 0"/></body>
      </body></body>
  </worldbody>
  <actuator>
    <position joint="along" kp="4000" kv="400"/><position joint="lift" kp="4000" kv="400"/>
    <position joint="left" kp="2500" kv="60"/><position joint="right" kp="2500" kv="60"/>
  </actuator>"#;

/// Command of an open finger, m. Closed is zero; the rod's half width of 0.02 m blocks a finger at
/// that distance.
const OPEN: f64 = 0.045;

/// Moves linearly from one command to the next, and returns the last row.
fn go(bench: &mut Bench, from: [f64; 4], to: [f64; 4], frames: usize) -> Vec<f64> {
    let mut last = Vec::new();
    for i in 0..frames {
        let s = (i + 1) as f64 / frames as f64;
        let ctrl: [f64; 4] = std::array::from_fn(|k| from[k] + s * (to[k] - from[k]));
        last = bench.run(1, &ctrl).pop().unwrap();
    }
    last
}

/// Lays the rod's point `pick` (m from its centre of mass) over the ledge and releases it. Returns
/// the readings in the grip and at the end.
fn lay_down(offset: f64, pick: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let channels = [
        "qpos.rod",
        "qpos.lift",
        "qpos.along",
        "contact.left/rod",
        "contact.right/rod",
    ];
    let mut bench = Bench::with(&scene(SCENE), &channels, 1, 1, &["geom/weight/pos/1"]);
    bench.simulator.set_parameters(&[0], &[offset]).unwrap();
    // The rod's own y axis points along the world's x.
    let at = 0.75 * offset + pick;
    let mut now = [0.0, 0.0, OPEN, OPEN];
    for (to, frames) in [
        ([at, 0.0, OPEN, OPEN], 300),
        ([at, 0.0, 0.0, 0.0], 150),
        ([at, 0.16, 0.0, 0.0], 400),
    ] {
        go(&mut bench, now, to, frames);
        now = to;
    }
    let held = go(&mut bench, now, now, 300);
    let carried = [0.4, 0.16, 0.0, 0.0];
    go(&mut bench, now, carried, 600);
    // The rod is released half a millimetre above the ledge's 0.15 m.
    let low = [0.4, 0.1505, 0.0, 0.0];
    go(&mut bench, carried, low, 150);
    let before = go(&mut bench, low, low, 200);
    let free = [0.4, 0.1505, OPEN, OPEN];
    go(&mut bench, low, free, 100);
    (held, before, go(&mut bench, free, free, 900))
}

fn tilt_deg(row: &[f64]) -> f64 {
    let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
        row[3], row[4], row[5], row[6],
    ));
    (q * nalgebra::Vector3::y()).z.asin().to_degrees().abs()
}

#[test]
fn a_grip_carries_its_weight_without_slip() {
    let (held, before, _) = lay_down(0.05, 0.0);
    // The servos press with kp times the distance that the rod blocks.
    for force in &held[9..11] {
        assert!((force - 50.0).abs() < 2.0, "{force} N");
    }
    let lifted = held[2] - 0.02 - held[7];
    assert!(lifted.abs() < 1e-3, "slips {lifted} m down");
    let along = (before[0] - before[8]) - (held[0] - held[8]);
    assert!(along.abs() < 1e-3, "slips {along} m along");
    assert!(
        tilt_deg(&held) < 1.0,
        "{} degrees in the grip",
        tilt_deg(&held)
    );
}

#[test]
fn a_rod_balances_only_over_its_center_of_mass() {
    // The ledge is 0.04 m wide: with an offset of 10 mm the rod stays, with 30 mm it falls, on
    // either side.
    for (pick, stays) in [(-0.01, true), (0.01, true), (-0.03, false), (0.03, false)] {
        let (_, _, end) = lay_down(0.06, pick);
        let level = tilt_deg(&end) < 1.0 && (end[2] - 0.17).abs() < 2e-3;
        assert_eq!(
            level,
            stays,
            "pick {pick}: {} degrees at {} m",
            tilt_deg(&end),
            end[2]
        );
    }
}
