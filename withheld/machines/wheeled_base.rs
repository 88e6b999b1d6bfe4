//! A base with two driven wheels and a caster.

use crate::machine::{Contact, Half, Machine, Shows, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "wheeled-base",
    about: "a base with two driven wheels and a caster",
    half: Half::Test,
    model: r#"<mujoco model="wheeled-base">
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="5"/>
  <worldbody>
    <geom name="ground" type="plane" size="9 9 0.1" friction="0.7 0.01 0.002" solref="-6000 -120" condim="6"/>
    <body name="base" pos="0 0 0.05">
      <freejoint name="base"/>
      <geom name="base" type="box" size="0.1 0.07 0.02" pos="0.02 0 0.02" mass="1.4" contype="0" conaffinity="0"/>
      <geom name="caster" type="sphere" size="0.015" pos="0.1 0 -0.035" mass="0.05" friction="0.02 0.001 0.0001" priority="1" solref="-6000 -120" condim="3"/>
      <body name="left_wheel" pos="0 0.09 0">
        <joint name="left" type="hinge" axis="0 1 0" damping="0.01" armature="0.002"/>
        <geom name="left_wheel" type="ellipsoid" size="0.05 0.012 0.05" mass="0.15" friction="0.7 0.01 0.002" solref="-6000 -120" condim="6"/>
      </body>
      <body name="right_wheel" pos="0 -0.09 0">
        <joint name="right" type="hinge" axis="0 1 0" damping="0.01" armature="0.002"/>
        <geom name="right_wheel" type="ellipsoid" size="0.05 0.012 0.05" mass="0.15" friction="0.7 0.01 0.002" solref="-6000 -120" condim="6"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <velocity name="v_left" joint="left" kv="0.15" forcerange="-1.5 1.5"/>
    <velocity name="v_right" joint="right" kv="0.15" forcerange="-1.5 1.5"/>
  </actuator>
  <sensor>
    <jointvel name="w_left" joint="left"/>
    <jointvel name="w_right" joint="right"/>
    <framepos name="base_pos" objtype="xbody" objname="base"/>
    <framequat name="base_quat" objtype="xbody" objname="base"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("base_mass", "geom/base/mass", 0.8, 2.5)],
    noise: &[
        ("w_left", 0.05),
        ("w_right", 0.05),
        ("base_pos", 0.002),
        ("base_quat", 0.004),
    ],
    commands: &[
        sines("v_left", 3.0, 9.0, 0.3, 1.5),
        sines("v_right", 3.0, 9.0, 0.3, 1.5),
    ],
    starts: &[start(
        "base",
        &[[0.0, 0.05], [0.0, 0.05], [0.05, 0.0], [0.0, 1.0]],
        &[],
    )],
    contacts: &[Contact {
        site: "ground",
        movers: &["left_wheel", "right_wheel"],
        shows: Shows {
            sliding: true,
            torsion: true,
            rolling: true,
            impact: false,
        },
    }],
    seconds: 1.4,
    rate: 100.0,
};
