//! Two fingers that hold a block between them while a slide lifts it.

use crate::machine::{Contact, Half, Machine, Shows, fit, sines};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "gripper",
    about: "two fingers hold a block that a slide lifts",
    half: Half::Training,
    model: r#"<mujoco model="gripper">
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="20"/>
  <worldbody>
    <body name="palm" pos="0 0 0.4">
      <joint name="lift" type="slide" axis="0 0 1" damping="8"/>
      <geom name="palm" type="box" size="0.06 0.03 0.01" mass="0.5" pos="0 0 0.07" contype="0" conaffinity="0"/>
      <body name="left" pos="-0.03 0 0">
        <joint name="left" type="slide" axis="1 0 0" damping="6"/>
        <geom name="left" type="box" size="0.006 0.012 0.03" mass="0.06" friction="0.5 0.01 0.0001" solref="-10000 -150" condim="4"/>
      </body>
      <body name="right" pos="0.03 0 0">
        <joint name="right" type="slide" axis="-1 0 0" damping="6"/>
        <geom name="right" type="box" size="0.006 0.012 0.03" mass="0.06" friction="0.5 0.01 0.0001" solref="-10000 -150" condim="4"/>
      </body>
    </body>
    <body name="block" pos="0 0 0.4">
      <freejoint name="block"/>
      <geom name="block" type="box" size="0.024 0.02 0.02" mass="0.12" friction="0.5 0.01 0.0001" solref="-10000 -150" condim="4"/>
    </body>
  </worldbody>
  <actuator>
    <position name="hoist" joint="lift" kp="600" kv="40"/>
    <motor name="grip_left" joint="left"/>
    <motor name="grip_right" joint="right"/>
  </actuator>
  <sensor>
    <jointpos name="height" joint="lift"/>
    <jointpos name="q_left" joint="left"/>
    <jointpos name="q_right" joint="right"/>
    <framepos name="block_pos" objtype="xbody" objname="block"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("block_mass", "geom/block/mass", 0.06, 0.25)],
    noise: &[
        ("height", 0.0005),
        ("q_left", 0.0003),
        ("q_right", 0.0003),
        ("block_pos", 0.001),
    ],
    commands: &[
        sines("hoist", 0.0, 0.06, 0.4, 2.0),
        sines("grip_left", 2.6, 1.3, 0.4, 2.0),
        sines("grip_right", 2.6, 1.3, 0.4, 2.0),
    ],
    starts: &[],
    contacts: &[Contact {
        site: "left",
        movers: &["block"],
        shows: Shows {
            sliding: true,
            torsion: false,
            rolling: false,
            impact: true,
        },
    }],
    seconds: 1.2,
    rate: 100.0,
};
