//! A puck that a slide pushes about on a board.

use crate::machine::{Command, Contact, Half, Machine, Parameter, Shows, Start};

/// The machine.
pub const MACHINE: Machine = Machine {
    name: "pushed-puck",
    about: "a slide of two axes pushes a puck on a board",
    half: Half::Training,
    model: r#"<mujoco model="pushed-puck">
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <worldbody>
    <geom name="board" type="plane" size="3 3 0.1" friction="0.12 0.003 0.0001" solref="-8000 -80" condim="4"/>
    <body name="slide_x" pos="-0.15 0 0.03">
      <joint name="px" type="slide" axis="1 0 0" damping="2"/>
      <geom name="slide_x" type="box" size="0.01 0.01 0.01" mass="0.5" contype="0" conaffinity="0"/>
      <body name="pusher">
        <joint name="py" type="slide" axis="0 1 0" damping="2"/>
        <geom name="pusher" type="capsule" fromto="0 0 -0.015 0 0 0.02" size="0.012" mass="0.3" friction="0.1 0.003 0.0001" solref="-8000 -80" condim="4"/>
      </body>
    </body>
    <body name="puck" pos="0 0 0.015">
      <freejoint name="puck"/>
      <geom name="puck" type="cylinder" size="0.05 0.015" mass="0.2" friction="0.12 0.003 0.0001" solref="-8000 -80" condim="4"/>
    </body>
  </worldbody>
  <actuator>
    <position name="s_x" joint="px" kp="400" kv="20" forcerange="-40 40"/>
    <position name="s_y" joint="py" kp="400" kv="20" forcerange="-40 40"/>
  </actuator>
  <sensor>
    <jointpos name="x" joint="px"/>
    <jointpos name="y" joint="py"/>
    <framepos name="puck_pos" objtype="xbody" objname="puck"/>
  </sensor>
</mujoco>"#,
    parameters: &[Parameter {
        name: "slide_friction",
        target: "geom/board/friction/0",
        range: [0.12, 0.3],
    }],
    noise: &[("x", 0.0005), ("y", 0.0005), ("puck_pos", 0.002)],
    commands: &[
        Command {
            actuator: "s_x",
            center: 0.08,
            amplitude: 0.18,
            band: [0.3, 1.2],
        },
        Command {
            actuator: "s_y",
            center: 0.0,
            amplitude: 0.05,
            band: [0.3, 1.0],
        },
    ],
    starts: &[
        Start {
            joint: "px",
            position: &[[0.08, 0.0]],
            velocity: &[[0.2, 0.1]],
        },
        Start {
            joint: "puck",
            position: &[[0.02, 0.01], [0.0, 0.015], [0.015, 0.0], [0.0, 3.0]],
            velocity: &[],
        },
    ],
    contacts: &[Contact {
        site: "board",
        movers: &["puck"],
        shows: Shows {
            sliding: true,
            torsion: true,
            rolling: false,
            impact: false,
        },
    }],
    seconds: 1.6,
    rate: 100.0,
};
