//! A planar arm of two joints with torque motors.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "arm2",
    about: "a planar arm of two joints, driven by torques",
    half: Half::Training,
    model: r#"<mujoco model="arm2">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="upper" pos="0 0 0.8">
      <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.12" armature="0.01"/>
      <geom name="upper" type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.9"/>
      <body name="fore" pos="0 0 -0.3">
        <joint name="elbow" type="hinge" axis="0 1 0" damping="0.05" armature="0.004"/>
        <geom name="fore" type="capsule" fromto="0 0 0 0 0 -0.25" size="0.016" mass="0.5"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m_shoulder" joint="shoulder"/>
    <motor name="m_elbow" joint="elbow"/>
  </actuator>
  <sensor>
    <jointpos name="q_shoulder" joint="shoulder"/>
    <jointpos name="q_elbow" joint="elbow"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("fore_mass", "geom/fore/mass", 0.3, 0.9)],
    noise: &[("q_shoulder", 0.003), ("q_elbow", 0.003)],
    commands: &[
        sines("m_shoulder", 0.0, 2.0, 0.3, 2.0),
        sines("m_elbow", 0.0, 0.6, 0.3, 2.5),
    ],
    starts: &[
        start("shoulder", &[[0.0, 0.3]], &[[0.0, 0.5]]),
        start("elbow", &[[0.0, 0.3]], &[[0.0, 0.5]]),
    ],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
