//! A finger of two joints that two tendons bend and stretch.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "tendon-finger",
    about: "two tendons bend and stretch a finger",
    half: Half::Test,
    model: r#"<mujoco model="tendon-finger">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="proximal" pos="0 0 0.1">
      <joint name="mcp" type="hinge" axis="0 1 0" damping="0.012" stiffness="0.08" armature="0.0003"/>
      <geom name="proximal" type="capsule" fromto="0 0 0 0.05 0 0" size="0.009" mass="0.05"/>
      <body name="distal" pos="0.05 0 0">
        <joint name="pip" type="hinge" axis="0 1 0" damping="0.006" stiffness="0.05" armature="0.0002"/>
        <geom name="distal" type="capsule" fromto="0 0 0 0.035 0 0" size="0.008" mass="0.03"/>
      </body>
    </body>
  </worldbody>
  <tendon>
    <fixed name="flexor"><joint joint="mcp" coef="0.011"/><joint joint="pip" coef="0.008"/></fixed>
    <fixed name="extensor"><joint joint="mcp" coef="-0.009"/><joint joint="pip" coef="-0.004"/></fixed>
  </tendon>
  <actuator>
    <motor name="flex" tendon="flexor" ctrlrange="0 20"/>
    <motor name="extend" tendon="extensor" ctrlrange="0 20"/>
  </actuator>
  <sensor>
    <jointpos name="q_mcp" joint="mcp"/>
    <jointpos name="q_pip" joint="pip"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("distal_mass", "geom/distal/mass", 0.015, 0.06)],
    noise: &[("q_mcp", 0.004), ("q_pip", 0.004)],
    commands: &[
        sines("flex", 5.0, 4.5, 0.3, 2.0),
        sines("extend", 7.0, 5.0, 0.3, 2.0),
    ],
    starts: &[
        start("mcp", &[[0.1, 0.2]], &[[0.0, 0.5]]),
        start("pip", &[[0.2, 0.2]], &[[0.0, 0.5]]),
    ],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
