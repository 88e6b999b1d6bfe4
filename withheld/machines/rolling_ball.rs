//! A ball that is thrown onto a floor, bounces and rolls on.

use crate::machine::{Contact, Half, Machine, Shows, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "rolling-ball",
    about: "a thrown ball bounces and rolls on",
    half: Half::Training,
    model: r#"<mujoco model="rolling-ball">
  <option timestep="0.001" integrator="implicitfast" cone="elliptic"/>
  <worldbody>
    <geom name="floor" type="plane" size="9 9 0.1" friction="0.3 0.005 0.002" solref="-6000 -16" condim="6"/>
    <body name="ball" pos="0 0 0.2">
      <freejoint name="ball"/>
      <geom name="ball" type="sphere" size="0.04" mass="0.08" friction="0.3 0.005 0.002" solref="-6000 -16" condim="6"/>
    </body>
  </worldbody>
  <sensor><framepos name="ball_pos" objtype="xbody" objname="ball"/></sensor>
</mujoco>"#,
    parameters: &[],
    noise: &[("ball_pos", 0.003)],
    commands: &[],
    starts: &[start(
        "ball",
        &[[0.0, 0.05], [0.0, 0.05], [0.12, 0.06], [0.0, 0.0]],
        &[
            [0.7, 0.5],
            [0.0, 0.5],
            [-0.2, 0.3],
            [0.0, 10.0],
            [0.0, 10.0],
            [0.0, 10.0],
        ],
    )],
    contacts: &[Contact {
        site: "floor",
        movers: &["ball"],
        shows: Shows {
            sliding: true,
            torsion: false,
            rolling: true,
            impact: true,
        },
    }],
    seconds: 2.5,
    rate: 100.0,
};
