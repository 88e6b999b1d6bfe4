//! Small machines with known motion, and a run of one with a cause.

use asid_withheld::anatomy::Anatomy;
use asid_withheld::cause::Place;
use asid_withheld::causes;
use asid_withheld::machine::{Contact, Half, Machine, Shows, fit};
use asid_withheld::motion::Motion;
use asid_withheld::simulate::{Record, Typical, simulate};
use asid_withheld::world::World;

/// Time step of the runs, s.
pub const STEP: f64 = 0.0005;
/// Gravity of the models, m/s².
pub const G: f64 = 9.81;

const PLAIN: Machine = Machine {
    name: "rig",
    about: "",
    half: Half::Training,
    model: "",
    parameters: &[],
    noise: &[("x", 0.001), ("v", 0.001), ("pos", 0.001), ("quat", 0.001)],
    commands: &[],
    starts: &[],
    contacts: &[],
    seconds: 1.0,
    rate: 100.0,
};

/// A mass of 2 kg on a level slide without friction, with a motor.
pub const SLIDE: Machine = Machine {
    model: r#"<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="mass">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <geom name="mass" type="box" size="0.1 0.1 0.1" mass="2"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="rail"/></actuator>
  <sensor><jointpos name="x" joint="rail"/><jointvel name="v" joint="rail"/></sensor>
</mujoco>"#,
    parameters: &[fit("mass", "geom/mass/mass", 1.0, 3.0)],
    ..PLAIN
};

/// A ring of 1 kg at 0.2 m about a vertical axis: 0.04 kg m² of point masses, with a motor.
pub const WHEEL: Machine = Machine {
    model: r#"<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="wheel">
      <inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.04"/>
      <joint name="axle" type="hinge" axis="0 0 1"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="axle"/></actuator>
  <sensor><jointpos name="x" joint="axle"/><jointvel name="v" joint="axle"/></sensor>
</mujoco>"#,
    ..PLAIN
};

/// A pendulum with a motor: 1 kg hung by 0.5 m. Its own moments of inertia are small, in the axes
/// of its frame.
pub const PENDULUM: Machine = Machine {
    model: r#"<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="bob" pos="0 0 0">
      <inertial pos="0 0 -0.5" mass="1" diaginertia="1e-6 1e-6 1e-6"/>
      <joint name="pivot" type="hinge" axis="0 1 0"/>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="pivot"/></actuator>
  <sensor><jointpos name="x" joint="pivot"/><jointvel name="v" joint="pivot"/></sensor>
</mujoco>"#,
    ..PLAIN
};

/// A load of 1 kg on a vertical slide, held by a position servo.
pub const SERVO: Machine = Machine {
    model: r#"<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="load">
      <joint name="rail" type="slide" axis="0 0 1" damping="2"/>
      <geom name="load" type="box" size="0.1 0.1 0.1" mass="1"/>
    </body>
  </worldbody>
  <actuator><position name="servo" joint="rail" kp="1000" kv="60"/></actuator>
  <sensor><jointpos name="x" joint="rail"/><jointvel name="v" joint="rail"/></sensor>
</mujoco>"#,
    ..PLAIN
};

/// A ball of 0.1 kg in the air.
pub const BALL: Machine = Machine {
    model: r#"<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="ball"><freejoint name="ball"/><geom name="ball" type="sphere" size="0.05" mass="0.1"/></body>
  </worldbody>
  <sensor>
    <framepos name="pos" objtype="xbody" objname="ball"/>
    <framequat name="quat" objtype="xbody" objname="ball"/>
  </sensor>
</mujoco>"#,
    ..PLAIN
};

/// A puck on a level board, friction 0.2.
pub const PUCK: Machine = Machine {
    model: r#"<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="20"/>
  <worldbody>
    <geom name="board" type="plane" size="9 9 0.1" friction="0.2 0.003 0.0001" solref="-20000 -280" condim="3"/>
    <body name="puck">
      <joint name="px" type="slide" axis="1 0 0"/>
      <joint name="py" type="slide" axis="0 1 0"/>
      <joint name="pz" type="slide" axis="0 0 1"/>
      <geom name="puck" type="sphere" size="0.03" mass="0.3" friction="0.2 0.003 0.0001" solref="-20000 -280" condim="3"/>
    </body>
  </worldbody>
  <sensor><framepos name="pos" objtype="xbody" objname="puck"/></sensor>
</mujoco>"#,
    contacts: &[Contact {
        site: "board",
        movers: &["puck"],
        shows: Shows {
            sliding: true,
            torsion: false,
            rolling: false,
            impact: true,
        },
    }],
    ..PLAIN
};

/// The result of a run with a cause.
pub struct Run {
    record: Record,
    /// True values of the cause's parameters.
    pub values: Vec<(&'static str, f64)>,
    /// Quantisation steps of the readings.
    pub steps: Vec<(usize, f64)>,
}

impl Run {
    /// A reading at a time.
    pub fn at(&self, time: f64, column: usize) -> f64 {
        self.in_episode(0, time, column)
    }

    /// A reading at a time of an episode.
    pub fn in_episode(&self, episode: usize, time: f64, column: usize) -> f64 {
        self.record.at(episode, time, column)
    }

    /// The value of a parameter.
    pub fn value(&self, name: &str) -> f64 {
        let found = self.values.iter().find(|(n, _)| *n == name);
        found.map_or(f64::NAN, |(_, v)| *v)
    }
}

/// Describes a run.
pub struct Setup {
    /// The machine.
    pub machine: Machine,
    /// Cause, site and size; several causes act in this order.
    pub causes: Vec<(&'static str, &'static str, f64)>,
    /// Random numbers for everything but the size.
    pub draw: [f64; 4],
    /// Initial position and velocity.
    pub start: (Vec<f64>, Vec<f64>),
    /// Length, s.
    pub seconds: f64,
    /// Number of episodes, all alike.
    pub episodes: usize,
}

impl Setup {
    /// One cause at a machine, for one second, from rest at the origin.
    pub fn new(machine: Machine, cause: &'static str, site: &'static str, size: f64) -> Self {
        let anatomy = Anatomy::of(&machine).expect("a model");
        Self {
            start: (anatomy.qpos0.clone(), vec![0.0; anatomy.nv]),
            machine,
            causes: vec![(cause, site, size)],
            // These draws give positive signs and no offset of dry friction.
            draw: [0.9, 0.1, 0.9, 0.1],
            seconds: 1.0,
            episodes: 1,
        }
    }

    pub fn repeated(mut self, episodes: usize) -> Self {
        self.episodes = episodes;
        self
    }

    pub fn from(mut self, qpos: &[f64], qvel: &[f64]) -> Self {
        self.start = (qpos.to_vec(), qvel.to_vec());
        self
    }

    pub fn lasting(mut self, seconds: f64) -> Self {
        self.seconds = seconds;
        self
    }

    pub fn drawn(mut self, draw: [f64; 4]) -> Self {
        self.draw = draw;
        self
    }

    /// Runs it with commands that are held for rows of 10 ms.
    pub fn run(self, command: impl Fn(f64) -> f64) -> Run {
        let anatomy = Anatomy::of(&self.machine).expect("a model");
        let rows = (self.seconds * 100.0).round() as usize + 1;
        let nu = anatomy.drives.len();
        let motion = Motion {
            qpos: self.start.0.clone(),
            qvel: self.start.1.clone(),
            commands: (0..rows * nu).map(|i| command(i as f64 / 100.0)).collect(),
            rows,
            period: 0.01,
        };
        let middle: Vec<f64> = self.machine.parameters.iter().map(|_| 2.0).collect();
        // The typical values only scale random draws, so all are 1.
        let typical = Typical {
            speed: vec![1.0; anatomy.nv],
            drive: vec![1.0; anatomy.nv],
            weight: vec![1.0; anatomy.nv],
            command: vec![1.0; nu],
            peak: vec![10.0; anatomy.nv],
            spread: vec![1.0; anatomy.width()],
            mean: vec![0.0; anatomy.qpos0.len()],
            roam: vec![1.0; anatomy.qpos0.len()],
        };
        let mut world = World::new(&anatomy, &middle, STEP, "implicitfast").expect("a world");
        let mut values = Vec::new();
        for &(name, site, size) in &self.causes {
            let place = Place {
                machine: &anatomy,
                typical: &typical,
                site,
                draw: self.draw,
            };
            let cause = causes::named(name).expect("a cause");
            values.extend(cause.act(&place, size, &mut world));
        }
        let motions = vec![motion; self.episodes];
        let record = simulate(&anatomy, &mut world, &motions).expect("a run");
        Run {
            record,
            values,
            steps: world.steps,
        }
    }
}

/// Asserts that two numbers agree within a share of the second, or within 1e-5.
#[track_caller]
pub fn near(found: f64, expected: f64, share: f64) {
    let tolerance = (share * expected.abs()).max(1e-5);
    assert!(
        (found - expected).abs() <= tolerance,
        "found {found}, expected {expected} within {tolerance}"
    );
}
