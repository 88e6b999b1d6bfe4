//! A stone that slides over a sheet and turns at the same time.

use crate::machine::{Contact, Half, Machine, Shows, fit, start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "curling-stone",
    about: "a stone slides over a sheet and turns",
    half: Half::Test,
    model: r#"<mujoco model="curling-stone">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <geom name="sheet" type="plane" size="9 9 0.1" friction="0.08 0.003 0.0001" solref="-3000 -80" condim="4"/>
    <body name="stone" pos="0 0 0.03">
      <freejoint name="stone"/>
      <geom name="stone" type="cylinder" size="0.09 0.03" mass="1.2" friction="0.08 0.003 0.0001" solref="-3000 -80" condim="4"/>
      <geom name="handle" type="capsule" fromto="-0.04 0 0.05 0.04 0 0.05" size="0.008" mass="0.1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <sensor>
    <framepos name="stone_pos" objtype="xbody" objname="stone"/>
    <framequat name="stone_quat" objtype="xbody" objname="stone"/>
  </sensor>
</mujoco>"#,
    parameters: &[fit("sheet_friction", "geom/sheet/friction/0", 0.08, 0.2)],
    noise: &[("stone_pos", 0.005), ("stone_quat", 0.01)],
    commands: &[],
    starts: &[start(
        "stone",
        &[[0.0, 0.1], [0.0, 0.1], [0.03, 0.0], [0.0, 3.0]],
        &[
            [1.2, 0.5],
            [0.0, 0.6],
            [0.0, 0.0],
            [0.0, 0.0],
            [0.0, 0.0],
            [0.0, 4.0],
        ],
    )],
    contacts: &[Contact {
        site: "sheet",
        movers: &["stone"],
        shows: Shows {
            sliding: true,
            torsion: true,
            rolling: false,
            impact: false,
        },
    }],
    seconds: 2.0,
    rate: 100.0,
};
