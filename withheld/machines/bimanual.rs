//! Two arms of two joints side by side, with position servos.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "bimanual",
    about: "two arms side by side with position servos",
    half: Half::Training,
    model: r#"<mujoco model="bimanual">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="left_upper" pos="0 0.2 0.9">
      <joint name="left_shoulder" type="hinge" axis="0 1 0" damping="0.4" armature="0.02"/>
      <geom name="left_upper" type="capsule" fromto="0 0 0 0 0 -0.28" size="0.025" mass="1.1"/>
      <body name="left_fore" pos="0 0 -0.28">
        <joint name="left_elbow" type="hinge" axis="0 1 0" damping="0.2" armature="0.01"/>
        <geom name="left_fore" type="capsule" fromto="0 0 0 0.03 0 -0.24" size="0.02" mass="0.6"/>
      </body>
    </body>
    <body name="right_upper" pos="0 -0.2 0.9">
      <joint name="right_shoulder" type="hinge" axis="0 1 0" damping="0.4" armature="0.02"/>
      <geom name="right_upper" type="capsule" fromto="0 0 0 0 0 -0.28" size="0.025" mass="1.1"/>
      <body name="right_fore" pos="0 0 -0.28">
        <joint name="right_elbow" type="hinge" axis="0 1 0" damping="0.2" armature="0.01"/>
        <geom name="right_fore" type="capsule" fromto="0 0 0 0.03 0 -0.24" size="0.02" mass="0.6"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="s_left_shoulder" joint="left_shoulder" kp="60" kv="3" forcerange="-20 20"/>
    <position name="s_left_elbow" joint="left_elbow" kp="30" kv="1.2" forcerange="-8 8"/>
    <position name="s_right_shoulder" joint="right_shoulder" kp="60" kv="3" forcerange="-20 20"/>
    <position name="s_right_elbow" joint="right_elbow" kp="30" kv="1.2" forcerange="-8 8"/>
  </actuator>
  <sensor>
    <jointpos name="q_left_shoulder" joint="left_shoulder"/>
    <jointpos name="q_left_elbow" joint="left_elbow"/>
    <jointpos name="q_right_shoulder" joint="right_shoulder"/>
    <jointpos name="q_right_elbow" joint="right_elbow"/>
  </sensor>
</mujoco>"#,
    parameters: &[
        fit("left_fore_mass", "geom/left_fore/mass", 0.3, 1.1),
        fit("right_fore_mass", "geom/right_fore/mass", 0.3, 1.1),
    ],
    noise: &[
        ("q_left_shoulder", 0.002),
        ("q_left_elbow", 0.002),
        ("q_right_shoulder", 0.002),
        ("q_right_elbow", 0.002),
    ],
    commands: &[
        sines("s_left_shoulder", 0.0, 0.7, 0.2, 1.5),
        sines("s_left_elbow", 0.0, 0.7, 0.2, 1.5),
        sines("s_right_shoulder", 0.0, 0.7, 0.2, 1.5),
        sines("s_right_elbow", 0.0, 0.7, 0.2, 1.5),
    ],
    starts: &[
        start("left_shoulder", &[[0.0, 0.1]], &[[0.0, 0.2]]),
        start("left_elbow", &[[0.0, 0.1]], &[[0.0, 0.2]]),
        start("right_shoulder", &[[0.0, 0.1]], &[[0.0, 0.2]]),
        start("right_elbow", &[[0.0, 0.1]], &[[0.0, 0.2]]),
    ],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
