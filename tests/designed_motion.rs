//! A designed motion identifies simulated true machines better than one without design.

#![cfg(feature = "mujoco")]
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use asid::cli::{MotionConfig, MotionSetup, Subject};
use asid::core::Streams;
use asid::core::progress::Silent;
use asid::sysid::fit::{fit, smooth};
use asid::sysid::method::Method;

/// A cart on a rail with a hanging pole.
const CART: &str = r#"<mujoco model="hanging">
  <option timestep="0.005"/>
  <worldbody>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0" range="-1.5 1.5" limited="true" damping="0.5"/>
      <geom name="cart" type="box" size=".1 .1 .05" mass="1"/>
      <body name="pole">
        <joint name="pivot" type="hinge" axis="0 1 0" damping="0.01"/>
        <geom name="pole" type="capsule" fromto="0 0 0 0 0 -0.6" size="0.02" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="belt" joint="rail" ctrlrange="-8 8"/></actuator>
  <sensor><jointpos name="x" joint="rail"/><jointpos name="turn" joint="pivot"/></sensor>
</mujoco>"#;

/// Four unknowns, limits, and a short search.
const SETTINGS: &str = r#"
seconds = 2.0
period = 0.02
rest_seconds = 0.0
settle = 0.0
ends_at_rest = false
unknown = [
    "geom/cart/mass:0.5:1.5",
    "geom/pole/mass:0.1:0.3",
    "joint/rail/damping:0.1:1",
    "joint/pivot/damping:0.002:0.02",
]
limit_speed = ["rail:2", "pivot:8"]
[noise]
x = 0.001
turn = 0.002
[design]
population = 24
iterations = 12
"#;

/// Number of true machines that play each motion.
const WORLDS: u64 = 6;

fn root_mean_square(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt()
}

/// Writes a model and the settings of a motion into a folder; returns the model's path and the
/// settings as read.
fn written(folder: &Path, model: &str, settings: &str) -> (PathBuf, MotionConfig) {
    let (xml, toml) = (folder.join("model.xml"), folder.join("motion.toml"));
    std::fs::write(&xml, model).unwrap();
    std::fs::write(&toml, settings).unwrap();
    let config = MotionConfig::of_file(&xml, &toml).unwrap();
    (xml, config)
}

/// Expected and actual standard deviations of a method's motion, relative to those of the prior.
///
/// They are root mean squares over unknowns and machines. No machine may exceed a limit.
fn deviations(folder: &Path, method: Method) -> [f64; 2] {
    let (model, config) = written(folder, CART, SETTINGS);
    let subject = Subject::open(&model, Some("mujoco")).unwrap();
    let mut setup = MotionSetup::new(&subject, &config, 2).unwrap();
    let motion = setup.design(&config, method, 0, &Silent).unwrap();
    let mut errors = Vec::new();
    for seed in 0..WORLDS {
        let (truth, real, data) = setup.true_machine(&motion.commands, seed).unwrap();
        assert!(real.excess.is_none(), "{seed}: {:?}", real.excess.worst);
        let (model, search) = (&*subject.model, (&smooth(), Streams::new(seed)));
        let found = fit(model, &setup.parameters, &data, search, 2, &Silent).unwrap();
        let pairs = setup.parameters.iter().zip(found.values.iter().zip(&truth));
        errors.extend(pairs.map(|(p, (x, y))| p.to_scaled(*x) - p.to_scaled(*y)));
    }
    [
        root_mean_square(&motion.told.deviations()),
        root_mean_square(&errors),
    ]
}

#[test]
fn a_designed_motion_beats_a_multisine_in_true_machines() {
    let folder = tempfile::tempdir().unwrap();
    let [expected, actual] = deviations(folder.path(), Method::FisherCem);
    let [baseline, baseline_actual] = deviations(folder.path(), Method::Multisine);
    assert!(expected < 0.7 * baseline, "{expected} {baseline}");
    assert!(actual < baseline_actual, "{actual} {baseline_actual}");
    // Twenty-four errors give a standard deviation to 14 %. The machines are anywhere in the
    // ranges, where a motion is more or less informative.
    assert!(
        (0.4..2.5).contains(&(actual / expected)),
        "{actual} {expected}"
    );
    let ratio = baseline_actual / baseline;
    assert!((0.4..2.5).contains(&ratio), "{baseline_actual} {baseline}");
}

/// A servo that dry friction holds, and one beside it that may only move slowly.
const HELD: &str = r#"<mujoco model="held">
  <option timestep="0.005" gravity="0 0 0"/>
  <worldbody>
    <body name="held">
      <joint name="held" type="slide" axis="1 0 0" range="-0.5 0.5" limited="true" frictionloss="10"/>
      <geom type="box" size=".1 .1 .1" mass="1"/>
    </body>
    <body name="light" pos="0 1 0">
      <joint name="light" type="slide" axis="1 0 0" range="-0.5 0.5" limited="true" damping="1"/>
      <geom type="box" size=".1 .1 .1" mass="0.1"/>
    </body>
  </worldbody>
  <actuator>
    <position name="held" joint="held" kp="200"/>
    <position name="light" joint="light" kp="100" kv="5"/>
  </actuator>
  <sensor><jointpos name="q" joint="held"/></sensor>
</mujoco>"#;

/// Settings of a motion for that machine.
const HELD_SETTINGS: &str = r#"
seconds = 2.0
period = 0.02
rest_seconds = 0.2
settle = 0.0
unknown = ["joint/held/frictionloss:5:15"]
limit_speed = ["light:0.05"]
limit_force = ["held:18"]
[noise]
q = 0.001
[design]
population = 16
iterations = 8
"#;

/// The servo of stiffness `k` slips when its command is `F / k` = 0.05 m away, and then follows at
/// that distance.
///
/// One reading with 1 mm of noise therefore determines the friction `F` to 0.2 N. The other servo,
/// at the same share of its range, may move only a few millimetres.
#[test]
fn a_joint_that_dry_friction_holds_is_made_to_slip() {
    let folder = tempfile::tempdir().unwrap();
    let (model, config) = written(folder.path(), HELD, HELD_SETTINGS);
    let subject = Subject::open(&model, Some("mujoco")).unwrap();
    let mut setup = MotionSetup::new(&subject, &config, 2).unwrap();
    let motion = setup
        .design(&config, Method::FisherCem, 0, &Silent)
        .unwrap();
    assert!(motion.excess.is_none(), "{:?}", motion.excess.worst);
    let of_one_reading = 0.001 * 200.0 / (10.0 / 12.0_f64.sqrt());
    let found = motion.told.deviations()[0];
    assert!(found < of_one_reading, "{found} {of_one_reading}");
}

/// rapier has no target `joint/NAME/range`. If the engine is asked for the range, there silently is
/// none, and a motion leaves the range.
#[test]
fn a_motion_keeps_the_ranges_of_joints_on_every_engine() {
    let folder = tempfile::tempdir().unwrap();
    let (model, config) = written(folder.path(), CART, SETTINGS);
    for engine in ["mujoco", "rapier"] {
        let subject = Subject::open(&model, Some(engine)).unwrap();
        let setup = MotionSetup::new(&subject, &config, 2).unwrap();
        let joints = &setup.player.limits().joints;
        // Two hundredths of the range of 3 m are kept free at each end.
        let [low, high] = joints[0].position.unwrap();
        assert!(
            (low + 1.44).abs() < 1e-12 && (high - 1.44).abs() < 1e-12,
            "{engine}: {low} {high}"
        );
        assert_eq!(joints[1].position, None, "{engine}");
    }
}

/// Symptom: a motion of zeros under `--limit-force 1e-6` was a success, "all limits hold".
///
/// Cause: a motion was looked at for the limits that it breaks, and one that stands still breaks
/// none.
#[test]
fn a_motion_that_stands_still_is_refused_with_the_limit_that_binds() {
    let folder = tempfile::tempdir().unwrap();
    let force = |limit: &str| format!("limit_force = [\"{limit}\"]\n{SETTINGS}");
    let size = |limit: &str| {
        let (model, config) = written(folder.path(), CART, &force(limit));
        let subject = Subject::open(&model, Some("mujoco")).unwrap();
        let mut setup = MotionSetup::new(&subject, &config, 2).unwrap();
        let motion = setup
            .design(&config, Method::Multisine, 0, &Silent)
            .unwrap();
        setup.refuse_standstill(&motion)
    };
    let said = size("0.000001").unwrap_err().to_string();
    let parts = ["would stand still", "force of `belt`", "limit 0.000001"];
    assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    assert!(size("4").is_ok());
}
