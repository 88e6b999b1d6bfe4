//! A hopper of one leg on a vertical guide.

use crate::machine::{Contact, Half, Machine, Shows, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "hopper",
    about: "a leg on a vertical guide hops",
    half: Half::Test,
    model: r#"<mujoco model="hopper">
  <option timestep="0.001" integrator="implicitfast" cone="elliptic"/>
  <worldbody>
    <geom name="ground" type="plane" size="3 3 0.1" friction="0.8 0.005 0.0001" solref="-5000 -60"/>
    <body name="trunk" pos="0 0 0.5">
      <joint name="guide" type="slide" axis="0 0 1" damping="1.0"/>
      <geom name="trunk" type="box" size="0.06 0.05 0.04" mass="1.5" contype="0" conaffinity="0"/>
      <body name="leg" pos="0 0 -0.3">
        <joint name="knee" type="slide" axis="0 0 1" damping="4" stiffness="600"/>
        <geom name="leg" type="capsule" fromto="0 0 0.2 0 0 0" size="0.012" mass="0.15" contype="0" conaffinity="0"/>
        <geom name="foot" type="sphere" size="0.02" pos="0 0 0" mass="0.08" friction="0.8 0.005 0.0001" solref="-5000 -60"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="thrust" joint="knee" ctrlrange="-60 60"/></actuator>
  <sensor>
    <jointpos name="height" joint="guide"/>
    <jointpos name="leg_length" joint="knee"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("trunk_mass", "geom/trunk/mass", 0.8, 2.5)],
    noise: &[("height", 0.002), ("leg_length", 0.001)],
    commands: &[sines("thrust", 0.0, 14.0, 0.8, 3.0)],
    starts: &[start("guide", &[[-0.1, 0.04]], &[[0.0, 0.2]])],
    contacts: &[Contact {
        site: "ground",
        movers: &["foot"],
        shows: Shows {
            sliding: false,
            torsion: false,
            rolling: false,
            impact: true,
        },
    }],
    seconds: 2.0,
    rate: 100.0,
};
