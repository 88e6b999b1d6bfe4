//! A small quadrotor near hover for a second and a half.

use crate::machine::{Half, Machine, fit, sines, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "quadrotor",
    about: "a quadrotor about hovering",
    half: Half::Test,
    model: r#"<mujoco model="quadrotor">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="frame" pos="0 0 1.5">
      <joint name="frame" type="free" damping="0.02"/>
      <geom name="frame" type="box" size="0.09 0.06 0.02" mass="0.6" contype="0" conaffinity="0"/>
      <site name="r1" pos="0.12 0.12 0.01"/>
      <site name="r2" pos="-0.12 0.12 0.01"/>
      <site name="r3" pos="-0.12 -0.12 0.01"/>
      <site name="r4" pos="0.12 -0.12 0.01"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="t1" site="r1" gear="0 0 1 0 0 0.02"/>
    <motor name="t2" site="r2" gear="0 0 1 0 0 -0.02"/>
    <motor name="t3" site="r3" gear="0 0 1 0 0 0.02"/>
    <motor name="t4" site="r4" gear="0 0 1 0 0 -0.02"/>
  </actuator>
  <sensor>
    <framepos name="pos" objtype="xbody" objname="frame"/>
    <framequat name="att" objtype="xbody" objname="frame"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("frame_mass", "geom/frame/mass", 0.45, 0.75)],
    noise: &[("pos", 0.005), ("att", 0.006)],
    commands: &[
        sines("t1", 1.4715, 0.35, 0.8, 3.0),
        sines("t2", 1.4715, 0.35, 0.8, 3.0),
        sines("t3", 1.4715, 0.35, 0.8, 3.0),
        sines("t4", 1.4715, 0.35, 0.8, 3.0),
    ],
    starts: &[start(
        "frame",
        &[[0.0, 0.1], [0.0, 0.1], [1.5, 0.1], [0.0, 1.0]],
        &[
            [0.0, 0.3],
            [0.0, 0.3],
            [0.0, 0.3],
            [0.0, 0.2],
            [0.0, 0.2],
            [0.0, 0.2],
        ],
    )],
    contacts: &[],
    seconds: 1.5,
    rate: 100.0,
};
