//! A carriage that a position servo moves on a slide over a belt.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "belt-slide",
    about: "a position servo moves a carriage over a belt",
    half: Half::Training,
    model: r#"<mujoco model="belt-slide">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="carriage" pos="0 0 0.2">
      <joint name="axis" type="slide" axis="1 0 0" damping="12" armature="0.6"/>
      <geom name="carriage" type="box" size="0.08 0.05 0.03" mass="1.6"/>
    </body>
  </worldbody>
  <actuator><position name="drive" joint="axis" kp="900" kv="45" forcerange="-60 60"/></actuator>
  <sensor>
    <jointpos name="position" joint="axis"/>
    <jointvel name="speed" joint="axis"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("carriage_mass", "geom/carriage/mass", 0.8, 3.0)],
    noise: &[("position", 0.0005), ("speed", 0.01)],
    commands: &[sines("drive", 0.0, 0.2, 0.3, 2.5)],
    starts: &[start("axis", &[[0.0, 0.02]], &[[0.0, 0.1]])],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
