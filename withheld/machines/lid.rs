//! A spring-loaded lid that a motor opens.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "lid",
    about: "a motor moves a lid with a spring",
    half: Half::Test,
    model: r#"<mujoco model="lid">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="box" pos="0 0 0.1">
      <geom name="box" type="box" size="0.15 0.15 0.05" mass="2" contype="0" conaffinity="0"/>
      <body name="lid" pos="-0.15 0 0.06">
        <joint name="hinge" type="hinge" axis="0 -1 0" damping="0.15" stiffness="1.5" springref="1.2"/>
        <geom name="lid" type="box" size="0.15 0.15 0.006" pos="0.15 0 0" mass="0.5" contype="0" conaffinity="0"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="opener" joint="hinge" ctrlrange="-4 4"/></actuator>
  <sensor><jointpos name="opening" joint="hinge"/></sensor>
</mujoco>"#,
    parameters: &[fit("lid_mass", "geom/lid/mass", 0.25, 1.0)],
    noise: &[("opening", 0.003)],
    commands: &[sines("opener", 0.2, 0.6, 0.3, 2.0)],
    starts: &[start("hinge", &[[0.9, 0.2]], &[[0.0, 0.3]])],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
