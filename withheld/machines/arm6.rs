//! An arm of six joints with position servos.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "arm6",
    about: "an arm of six joints with position servos",
    half: Half::Training,
    model: r#"<mujoco model="arm6">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="turret" pos="0 0 0.1">
      <joint name="pan" type="hinge" axis="0 0 1" damping="0.8" armature="0.05"/>
      <geom name="turret" type="capsule" fromto="0 0 0 0 0 0.08" size="0.04" mass="1.2" contype="0" conaffinity="0"/>
      <body name="upper" pos="0 0 0.1">
        <joint name="shoulder" type="hinge" axis="0 1 0" damping="0.8" armature="0.05"/>
        <geom name="upper" type="capsule" fromto="0 0 0 0 0 0.22" size="0.03" mass="1.0" contype="0" conaffinity="0"/>
        <body name="fore" pos="0 0 0.22">
          <joint name="elbow" type="hinge" axis="0 1 0" damping="0.5" armature="0.03"/>
          <geom name="fore" type="capsule" fromto="0 0 0 0.2 0 0.02" size="0.025" mass="0.7" contype="0" conaffinity="0"/>
          <body name="roll" pos="0.2 0 0.02">
            <joint name="forearm_roll" type="hinge" axis="1 0 0" damping="0.2" armature="0.01"/>
            <geom name="roll" type="capsule" fromto="0 0 0 0.06 0 0" size="0.02" mass="0.3" contype="0" conaffinity="0"/>
            <body name="wrist" pos="0.06 0 0">
              <joint name="wrist_pitch" type="hinge" axis="0 1 0" damping="0.15" armature="0.008"/>
              <geom name="wrist" type="capsule" fromto="0 0 0 0.06 0 0" size="0.02" mass="0.25" contype="0" conaffinity="0"/>
              <body name="hand" pos="0.06 0 0">
                <joint name="wrist_roll" type="hinge" axis="1 0 0" damping="0.1" armature="0.005"/>
                <geom name="hand" type="capsule" fromto="0 0 0 0.07 0 0.01" size="0.02" mass="0.25" contype="0" conaffinity="0"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="s_pan" joint="pan" kp="120" kv="7.20" forcerange="-40 40"/>
    <position name="s_shoulder" joint="shoulder" kp="160" kv="9.60" forcerange="-40 40"/>
    <position name="s_elbow" joint="elbow" kp="90" kv="5.40" forcerange="-25 25"/>
    <position name="s_forearm_roll" joint="forearm_roll" kp="25" kv="1.50" forcerange="-8 8"/>
    <position name="s_wrist_pitch" joint="wrist_pitch" kp="25" kv="1.50" forcerange="-8 8"/>
    <position name="s_wrist_roll" joint="wrist_roll" kp="15" kv="0.90" forcerange="-5 5"/>
  </actuator>
  <sensor>
    <jointpos name="q_pan" joint="pan"/>
    <jointpos name="q_shoulder" joint="shoulder"/>
    <jointpos name="q_elbow" joint="elbow"/>
    <jointpos name="q_forearm_roll" joint="forearm_roll"/>
    <jointpos name="q_wrist_pitch" joint="wrist_pitch"/>
    <jointpos name="q_wrist_roll" joint="wrist_roll"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("hand_mass", "geom/hand/mass", 0.1, 0.8)],
    noise: &[
        ("q_pan", 0.0015),
        ("q_shoulder", 0.0015),
        ("q_elbow", 0.0015),
        ("q_forearm_roll", 0.0015),
        ("q_wrist_pitch", 0.0015),
        ("q_wrist_roll", 0.0015),
    ],
    commands: &[
        sines("s_pan", 0.0, 0.7, 0.2, 1.2),
        sines("s_shoulder", 0.3, 0.5, 0.2, 1.2),
        sines("s_elbow", 0.3, 0.6, 0.2, 1.2),
        sines("s_forearm_roll", 0.0, 0.8, 0.2, 1.2),
        sines("s_wrist_pitch", 0.3, 0.7, 0.2, 1.2),
        sines("s_wrist_roll", 0.0, 0.8, 0.2, 1.2),
    ],
    starts: &[
        start("pan", &[[0.0, 0.05]], &[[0.0, 0.1]]),
        start("shoulder", &[[0.3, 0.05]], &[[0.0, 0.1]]),
        start("elbow", &[[0.3, 0.05]], &[[0.0, 0.1]]),
        start("forearm_roll", &[[0.0, 0.05]], &[[0.0, 0.1]]),
        start("wrist_pitch", &[[0.3, 0.05]], &[[0.0, 0.1]]),
        start("wrist_roll", &[[0.0, 0.05]], &[[0.0, 0.1]]),
    ],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
