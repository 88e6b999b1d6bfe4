//! An arm of seven joints with position servos.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "arm7",
    about: "an arm of seven joints with position servos",
    half: Half::Test,
    model: r#"<mujoco model="arm7">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="base" pos="0 0 0.15">
      <joint name="j1" type="hinge" axis="0 0 1" damping="0.8" armature="0.05"/>
      <geom name="base" type="capsule" fromto="0 0 0 0 0 0.1" size="0.05" mass="2.0" contype="0" conaffinity="0"/>
      <body name="shoulder" pos="0 0 0.12">
        <joint name="j2" type="hinge" axis="0 1 0" damping="0.8" armature="0.05"/>
        <geom name="shoulder" type="capsule" fromto="0 0 0 0 0 0.16" size="0.045" mass="1.8" contype="0" conaffinity="0"/>
        <body name="upper" pos="0 0 0.16">
          <joint name="j3" type="hinge" axis="0 0 1" damping="0.6" armature="0.04"/>
          <geom name="upper" type="capsule" fromto="0 0 0 0.03 0 0.14" size="0.04" mass="1.4" contype="0" conaffinity="0"/>
          <body name="elbow" pos="0.03 0 0.14">
            <joint name="j4" type="hinge" axis="0 -1 0" damping="0.6" armature="0.04"/>
            <geom name="elbow" type="capsule" fromto="0 0 0 -0.03 0 0.14" size="0.04" mass="1.2" contype="0" conaffinity="0"/>
            <body name="fore" pos="-0.03 0 0.14">
              <joint name="j5" type="hinge" axis="0 0 1" damping="0.3" armature="0.02"/>
              <geom name="fore" type="capsule" fromto="0 0 0 0 0 0.14" size="0.035" mass="0.9" contype="0" conaffinity="0"/>
              <body name="wrist" pos="0 0 0.14">
                <joint name="j6" type="hinge" axis="0 -1 0" damping="0.3" armature="0.015"/>
                <geom name="wrist" type="capsule" fromto="0 0 0 0.05 0 0" size="0.03" mass="0.6" contype="0" conaffinity="0"/>
                <body name="flange" pos="0.05 0 0">
                  <joint name="j7" type="hinge" axis="0 0 1" damping="0.15" armature="0.008"/>
                  <geom name="flange" type="capsule" fromto="0 0 0 0.01 0 0.08" size="0.025" mass="0.5" contype="0" conaffinity="0"/>
                </body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="a1" joint="j1" kp="200" kv="14.00"/>
    <position name="a2" joint="j2" kp="260" kv="18.20"/>
    <position name="a3" joint="j3" kp="160" kv="11.20"/>
    <position name="a4" joint="j4" kp="140" kv="9.80"/>
    <position name="a5" joint="j5" kp="60" kv="4.20"/>
    <position name="a6" joint="j6" kp="50" kv="3.50"/>
    <position name="a7" joint="j7" kp="25" kv="1.75"/>
  </actuator>
  <sensor>
    <jointpos name="q1" joint="j1"/>
    <jointpos name="q2" joint="j2"/>
    <jointpos name="q3" joint="j3"/>
    <jointpos name="q4" joint="j4"/>
    <jointpos name="q5" joint="j5"/>
    <jointpos name="q6" joint="j6"/>
    <jointpos name="q7" joint="j7"/>
  </sensor>
</mujoco>"#,
    parameters: &[
        fit("flange_mass", "geom/flange/mass", 0.2, 1.5),
        fit("fore_mass", "geom/fore/mass", 0.5, 1.6),
    ],
    noise: &[
        ("q1", 0.001),
        ("q2", 0.001),
        ("q3", 0.001),
        ("q4", 0.001),
        ("q5", 0.001),
        ("q6", 0.001),
        ("q7", 0.001),
    ],
    commands: &[
        sines("a1", 0.0, 0.5, 0.2, 1.2),
        sines("a2", 0.3, 0.5, 0.2, 1.2),
        sines("a3", 0.0, 0.5, 0.2, 1.2),
        sines("a4", -0.9, 0.5, 0.2, 1.2),
        sines("a5", 0.0, 0.5, 0.2, 1.2),
        sines("a6", 0.8, 0.5, 0.2, 1.2),
        sines("a7", 0.0, 0.5, 0.2, 1.2),
    ],
    starts: &[
        start("j1", &[[0.0, 0.05]], &[[0.0, 0.1]]),
        start("j2", &[[0.3, 0.05]], &[[0.0, 0.1]]),
        start("j3", &[[0.0, 0.05]], &[[0.0, 0.1]]),
        start("j4", &[[-0.9, 0.05]], &[[0.0, 0.1]]),
        start("j5", &[[0.0, 0.05]], &[[0.0, 0.1]]),
        start("j6", &[[0.8, 0.05]], &[[0.0, 0.1]]),
        start("j7", &[[0.0, 0.05]], &[[0.0, 0.1]]),
    ],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
