//! Rod balancing: find where a rod carries its mass by pushing it, then lay it on
//! a ledge so that it stays level.
//!
//! The rod is 0.04 x 0.3 x 0.04 m: 0.05 kg spread along it and 0.15 kg at
//! `mass_offset`, so that its centre of mass lies at three quarters of that. The
//! closed gripper pushes it about on a table; how it turns tells the offset. The
//! task's action is the point along the rod at which it is picked and which is
//! laid over the middle of a ledge 0.04 m wide. Everything is done by simulated
//! contact, and the tilt is read from the rod's pose.
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.1 and its appendix.

mod metric;
mod placing;
mod stand_in;

use asid_core::parameter::{Parameter, Scale};
use asid_core::signal::{Signal, yaw};
use asid_core::task::{
    Commander, Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Outline,
    Task, TopView,
};
use asid_core::{Capabilities, Layout, Result, Scene};

use crate::panda;
use crate::steering::{self, Steering};

/// The closed gripper pushes the rod about on the table.
const STEERING: Steering = Steering {
    max_step: 0.04, // 0.4 m/s
    x: [0.30, 0.70],
    y: [-0.4, 0.4],
    reach: 0.74,
    fingers: 0.0,
};

/// Half sizes of the rod along its axes, m; the long one is y.
const ROD_HALF: [f64; 3] = [0.02, 0.15, 0.02];

/// Middle of the ledge's top, m.
const LEDGE: [f64; 3] = [0.2, -0.5, 0.15];

/// Half sizes of the ledge across and along, m.
const LEDGE_HALF: [f64; 2] = [0.02, 0.05];

/// Height of the rod's middle when it lies on the table, m.
const ROD_REST_HEIGHT: f64 = 0.02;

/// The task.
pub struct RodBalancing {
    scene: Scene,
    home: Vec<f64>,
    exploration: ExplorationProtocol,
    downstream: DownstreamProtocol,
}

asid_core::register!(TaskEntry {
    name: "rod-balancing",
    about: "find a rod's centre of mass by pushing it, then balance it on a ledge",
    make: || Ok(Box::new(RodBalancing::new()?)),
});

impl RodBalancing {
    /// The task with its published ranges.
    ///
    /// # Errors
    /// When the scene that is built in cannot be read.
    pub fn new() -> Result<Self> {
        let (scene, home) = panda::scene("rod-balancing", include_str!("scene.xml"))?;
        let pi = std::f64::consts::PI;
        let exploration = ExplorationProtocol {
            horizon: 20,
            frames_per_step: steering::FRAMES,
            frame_period: steering::FRAME_PERIOD,
            action: steering::action(),
            start: vec![
                Coordinate::new("x", "m", [0.5, 0.6]),
                Coordinate::new("y", "m", [-0.2, 0.2]),
                Coordinate::new("yaw", "rad", [0.0, pi]),
            ],
            signals: vec![
                Signal {
                    sensor: "rod_pos".into(),
                    noise: 0.002,
                },
                Signal {
                    sensor: "rod_quat".into(),
                    noise: 0.01,
                },
            ],
            proprioception: panda::proprioception(),
            contact: ["finger_left", "finger_right"]
                .map(|f| [f.into(), "rod".into()])
                .into(),
        };
        let downstream = DownstreamProtocol {
            metric: "tilt_deg".into(),
            unit: "deg".into(),
            rule: "tilt below 5° and still on the ledge".into(),
            threshold: Some(metric::MAX_TILT),
            frames: placing::frames(),
            frame_period: placing::FRAME_PERIOD,
            action: vec![Coordinate::new("pick", "m", [-0.1, 0.1])],
            start: placing::start(),
            channels: vec!["rod_pos".into(), "rod_quat".into()],
            phases: placing::phases(),
        };
        Ok(Self {
            scene,
            home,
            exploration,
            downstream,
        })
    }
}

impl Task for RodBalancing {
    fn name(&self) -> &str {
        "rod-balancing"
    }

    fn about(&self) -> &str {
        "find a rod's centre of mass by pushing it, then balance it on a ledge"
    }

    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn requires(&self) -> Capabilities {
        Capabilities::ARTICULATION | Capabilities::CONTACT | Capabilities::ACTUATORS
    }

    fn parameters(&self) -> Vec<Parameter> {
        vec![Parameter {
            name: "mass_offset".into(),
            targets: crate::targets(["geom/rod_mass/pos/1"]),
            range: [-0.1, 0.1],
            scale: Scale::Linear,
            unit: "m".into(),
        }]
    }

    fn optional_parameters(&self) -> Vec<Parameter> {
        // The table's own coefficient is the smallest of the range, so that the rod's wins everywhere in it.
        vec![Parameter {
            name: "friction".into(),
            targets: crate::targets(["geom/rod_1/friction/0", "geom/rod_5/friction/0"]),
            range: [0.2, 0.5],
            scale: Scale::Linear,
            unit: String::new(),
        }]
    }

    fn conditions(&self) -> Vec<Condition> {
        [("left", -0.08), ("middle", 0.0), ("right", 0.08)]
            .map(|(name, offset)| Condition::fixed(name, &[("mass_offset", offset)]))
            .into()
    }

    /// Another rod: shorter, a quarter heavier, rougher below, and with its mass less at one place.
    fn stand_in(&self) -> Result<Option<Scene>> {
        stand_in::scene(&self.scene).map(Some)
    }

    fn exploration(&self) -> &ExplorationProtocol {
        &self.exploration
    }

    fn downstream(&self) -> &DownstreamProtocol {
        &self.downstream
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        let at = layout.joint("rod_free")?.qpos;
        let half = start[2] / 2.0;
        let pose = [
            start[0],
            start[1],
            ROD_REST_HEIGHT,
            half.cos(),
            0.0,
            0.0,
            half.sin(),
        ];
        qpos[at..at + 7].copy_from_slice(&pose);
        Ok(())
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        vec![signals[0], signals[1], yaw(&signals[3..7])]
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        STEERING.commander(&self.scene, &self.home)
    }

    fn attempt(&self, start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        placing::commands(&self.scene, &self.home, start, action[0])
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        readings.chunks_exact(7).map(metric::tilt_deg).collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        metric::outcome(readings)
    }

    fn top_view(&self) -> TopView {
        let [x, y, _] = ROD_HALF;
        TopView {
            object: Outline {
                label: "rod".into(),
                corners: vec![[-x, -y], [x, -y], [x, y], [-x, y]],
            },
            fixtures: vec![Outline {
                label: "ledge".into(),
                corners: crate::rectangle([LEDGE[0], LEDGE[1]], LEDGE_HALF),
            }],
            bounds: [[0.1, -0.6], [0.8, 0.5]],
        }
    }

    fn side_view(&self, readings: &[f64]) -> Vec<Outline> {
        metric::side_view(readings)
    }
}
