//! A cart on a rail, driven by a motor over a belt, with a pole that hangs from it.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "cart-pole",
    about: "a motor drives a cart from which a pole hangs",
    half: Half::Training,
    model: r#"<mujoco model="cart-pole">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="cart" pos="0 0 0.5">
      <joint name="rail" type="slide" axis="1 0 0" damping="3" armature="0.05"/>
      <geom name="cart" type="box" size="0.06 0.04 0.03" mass="0.8"/>
      <body name="pole" pos="0 0 0">
        <joint name="pivot" type="hinge" axis="0 1 0" damping="0.003"/>
        <geom name="pole" type="capsule" fromto="0 0 0 0 0 -0.35" size="0.008" mass="0.15"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="belt" joint="rail" ctrlrange="-15 15"/></actuator>
  <sensor>
    <jointpos name="x" joint="rail"/>
    <jointvel name="dx" joint="rail"/>
    <jointpos name="phi" joint="pivot"/>
  </sensor>
</mujoco>"#,
    parameters: &[
        fit("cart_mass", "geom/cart/mass", 0.4, 1.6),
        fit("pole_mass", "geom/pole/mass", 0.08, 0.3),
    ],
    noise: &[("x", 0.002), ("dx", 0.02), ("phi", 0.004)],
    commands: &[sines("belt", 0.0, 5.0, 0.3, 2.0)],
    starts: &[
        start("rail", &[[0.0, 0.1]], &[[0.0, 0.2]]),
        start("pivot", &[[0.0, 0.3]], &[[0.0, 0.5]]),
    ],
    contacts: &[],
    seconds: 3.0,
    rate: 100.0,
};
