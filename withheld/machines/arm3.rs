//! An arm of three joints with torque motors, the first about the vertical.

use crate::machine::{Command, Half, Machine, Parameter, Start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "arm3",
    about: "an arm of three joints, driven by torques",
    half: Half::Test,
    model: r#"<mujoco model="arm3">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="turret" pos="0 0 0.2">
      <joint name="yaw" type="hinge" axis="0 0 1" damping="0.12" armature="0.01"/>
      <geom name="turret" type="cylinder" size="0.05 0.04" mass="0.8"/>
      <body name="upper" pos="0 0 0.06">
        <joint name="lift" type="hinge" axis="0 1 0" damping="0.15" armature="0.012"/>
        <geom name="upper" type="capsule" fromto="0 0 0 0 0 -0.26" size="0.02" mass="0.6"/>
        <body name="fore" pos="0 0 -0.26">
          <joint name="bend" type="hinge" axis="0 1 0" damping="0.06" armature="0.004"/>
          <geom name="fore" type="capsule" fromto="0 0 0 0.02 0 -0.22" size="0.016" mass="0.35"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="m_yaw" joint="yaw"/>
    <motor name="m_lift" joint="lift"/>
    <motor name="m_bend" joint="bend"/>
  </actuator>
  <sensor>
    <jointpos name="q_yaw" joint="yaw"/>
    <jointpos name="q_lift" joint="lift"/>
    <jointpos name="q_bend" joint="bend"/>
  </sensor>
</mujoco>"#,
    parameters: &[
        Parameter {
            name: "fore_mass",
            target: "geom/fore/mass",
            range: [0.2, 0.6],
        },
        Parameter {
            name: "upper_mass",
            target: "geom/upper/mass",
            range: [0.35, 1.0],
        },
    ],
    noise: &[("q_yaw", 0.003), ("q_lift", 0.003), ("q_bend", 0.003)],
    commands: &[
        Command {
            actuator: "m_yaw",
            center: 0.0,
            amplitude: 0.5,
            band: [0.3, 2.0],
        },
        Command {
            actuator: "m_lift",
            center: 0.0,
            amplitude: 1.5,
            band: [0.3, 2.0],
        },
        Command {
            actuator: "m_bend",
            center: 0.0,
            amplitude: 0.4,
            band: [0.3, 3.0],
        },
    ],
    starts: &[
        Start {
            joint: "yaw",
            position: &[[0.0, 0.5]],
            velocity: &[[0.0, 0.5]],
        },
        Start {
            joint: "lift",
            position: &[[0.0, 0.4]],
            velocity: &[[0.0, 0.5]],
        },
        Start {
            joint: "bend",
            position: &[[0.3, 0.4]],
            velocity: &[[0.0, 0.5]],
        },
    ],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
