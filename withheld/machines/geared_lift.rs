//! A motor that lifts a load on a beam through a gear with a ratio of 40.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "geared-lift",
    about: "a geared motor lifts a load on a beam",
    half: Half::Test,
    model: r#"<mujoco model="geared-lift">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="beam" pos="0 0 0.6">
      <joint name="pivot" type="hinge" axis="0 -1 0" damping="0.4" armature="0.12" stiffness="3"/>
      <geom name="beam" type="capsule" fromto="0 0 0 0.4 0 0" size="0.015" mass="0.5"/>
      <body name="load" pos="0.4 0 0">
        <geom name="load" type="box" size="0.04 0.04 0.04" mass="0.6"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="pivot" gear="40" forcerange="-0.35 0.35"/></actuator>
  <sensor>
    <jointpos name="angle" joint="pivot"/>
    <jointvel name="rate" joint="pivot"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("load_mass", "geom/load/mass", 0.3, 1.2)],
    noise: &[("angle", 0.002), ("rate", 0.02)],
    commands: &[sines("motor", 0.06, 0.14, 0.3, 2.0)],
    starts: &[start("pivot", &[[0.0, 0.3]], &[[0.0, 0.3]])],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
