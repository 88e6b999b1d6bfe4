//! An asymmetric body that is thrown and tumbles; cameras measure its pose.

use crate::machine::{Half, Machine, fit, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "free-flight",
    about: "a thrown body tumbles through the air",
    half: Half::Test,
    model: r#"<mujoco model="free-flight">
  <option timestep="0.0005" integrator="implicitfast"/>
  <worldbody>
    <body name="club" pos="0 0 1">
      <freejoint name="club"/>
      <geom name="club" type="capsule" fromto="-0.12 0 0 0.1 0 0" size="0.015" mass="0.12"/>
      <geom name="head" type="box" size="0.03 0.04 0.015" pos="0.12 0.01 0" mass="0.2"/>
    </body>
  </worldbody>
  <sensor>
    <framepos name="club_pos" objtype="xbody" objname="club"/>
    <framequat name="club_quat" objtype="xbody" objname="club"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("head_mass", "geom/head/mass", 0.1, 0.4)],
    noise: &[("club_pos", 0.002), ("club_quat", 0.01)],
    commands: &[],
    starts: &[start(
        "club",
        &[[0.0, 0.1], [0.0, 0.1], [1.0, 0.1], [0.0, 3.0]],
        &[
            [0.0, 2.5],
            [0.0, 2.5],
            [4.0, 1.0],
            [0.0, 4.0],
            [0.0, 4.0],
            [0.0, 4.0],
        ],
    )],
    contacts: &[],
    seconds: 0.9,
    rate: 200.0,
};
