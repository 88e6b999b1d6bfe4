//! A position servo that swings a payload on a link.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "servo",
    about: "a position servo swings a payload",
    half: Half::Training,
    model: r#"<mujoco model="servo">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="link" pos="0 0 0.5">
      <joint name="hinge" type="hinge" axis="0 1 0" damping="0.03" armature="0.004"/>
      <geom name="link" type="capsule" fromto="0 0 0 0 0 -0.2" size="0.01" mass="0.08"/>
      <body name="bob" pos="0 0 -0.22">
        <geom name="bob" type="sphere" size="0.03" mass="0.35"/>
      </body>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="hinge" kp="8" kv="0.25" forcerange="-2.5 2.5"/></actuator>
  <sensor><jointpos name="angle" joint="hinge"/></sensor>
</mujoco>"#,
    parameters: &[fit("payload_mass", "geom/bob/mass", 0.15, 0.7)],
    noise: &[("angle", 0.003)],
    commands: &[sines("servo", 0.0, 0.8, 0.2, 1.5)],
    starts: &[start("hinge", &[[0.0, 0.3]], &[[0.0, 0.5]])],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
