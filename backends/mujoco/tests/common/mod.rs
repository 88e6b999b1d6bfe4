//! Scenes and helpers that the tests share.
#![allow(dead_code, clippy::unwrap_used)]

use std::sync::Arc;

use asid_core::{
    Backend, BatchConfig, Control, Error, Model, Recording, Rollout, Scene, Simulator,
};
use asid_mujoco::MujocoBackend;

/// A 2-joint arm with servos, a ball on a floor, sensors of every stage.
pub const ARM: &str = r#"
<mujoco>
  <option timestep="0.002" impratio="10" cone="elliptic"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1" friction="0.6 0.01 0.001"/>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.1"/>
      <geom name="upper" type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" density="800"/>
      <body name="lower" pos="0.3 0 0">
        <joint name="elbow" type="hinge" axis="0 1 0" damping="0.05" frictionloss="0.02"/>
        <geom name="lower" type="box" pos="0.15 0 0" size="0.15 0.02 0.03" mass="0.4"/>
        <geom name="bob" type="sphere" pos="0.3 0 0" size="0.04" mass="0.3"/>
      </body>
    </body>
    <body name="ball" pos="1 0 0.1">
      <freejoint name="ball"/>
      <geom name="ball" type="sphere" size="0.1" mass="0.5" condim="6" friction="0.3 0.005 0.0001"/>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder" joint="shoulder" kp="40" kv="4"/>
    <motor name="elbow" joint="elbow" gear="2"/>
  </actuator>
  <sensor>
    <jointpos name="angle" joint="elbow"/>
    <jointvel name="rate" joint="elbow"/>
    <framepos name="ball_pos" objtype="body" objname="ball"/>
    <framelinvel name="ball_vel" objtype="body" objname="ball"/>
    <framelinacc name="ball_acc" objtype="body" objname="ball"/>
    <actuatorfrc name="torque" actuator="elbow"/>
  </sensor>
  <keyframe>
    <key name="start" qpos="0.2 -0.3 1 0 0.15 1 0 0 0" qvel="0 0 0.5 0.2 0 0 1 3" ctrl="0.1 0"/>
  </keyframe>
</mujoco>"#;

/// A single ball under gravity that can touch nothing.
pub const FALLING: &str = r#"
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <body name="ball" pos="0 0 2">
      <freejoint name="ball"/>
      <geom name="ball" type="sphere" size="0.1" mass="0.5"/>
    </body>
  </worldbody>
  <sensor>
    <framepos name="place" objtype="body" objname="ball"/>
    <framelinvel name="speed" objtype="body" objname="ball"/>
  </sensor>
</mujoco>"#;

pub fn load(xml: &str) -> Arc<dyn Model> {
    try_load(xml).unwrap()
}

pub fn try_load(xml: &str) -> Result<Arc<dyn Model>, Error> {
    MujocoBackend::new()
        .unwrap()
        .load(&Scene::from_xml("test.xml", xml, &[])?)
}

pub fn batch(
    model: &Arc<dyn Model>,
    size: usize,
    threads: usize,
    targets: &[&str],
) -> Box<dyn Simulator> {
    let targets = targets.iter().map(|t| t.parse().unwrap()).collect();
    model
        .simulator(&BatchConfig {
            size,
            threads,
            targets,
        })
        .unwrap()
}

pub fn recording(model: &Arc<dyn Model>, names: &[&str]) -> Recording {
    model.layout().recording(names).unwrap()
}

/// A rollout of all simulations with one command trajectory.
pub fn roll(
    simulator: &mut Box<dyn Simulator>,
    frames: usize,
    substeps: usize,
    control: &[f64],
    record: &Recording,
) -> Vec<f64> {
    let sims: Vec<usize> = (0..simulator.batch_size()).collect();
    let mut out = vec![0.0; sims.len() * frames * record.width()];
    let rollout = Rollout::new(&sims, frames, substeps, Control::Shared(control), record);
    simulator.rollout(&rollout, &mut out).unwrap();
    out
}

/// A command trajectory for [`ARM`] that moves both joints.
pub fn waves(frames: usize) -> Vec<f64> {
    (0..frames)
        .flat_map(|k| {
            let t = k as f64 * 0.02;
            [0.4 * (3.0 * t).sin(), 0.5 * (5.0 * t).cos()]
        })
        .collect()
}

pub const CHANNELS: [&str; 9] = [
    "angle",
    "rate",
    "ball_pos",
    "ball_vel",
    "ball_acc",
    "torque",
    "qpos.ball",
    "qvel.ball",
    "contact.ball/world",
];

pub fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}
