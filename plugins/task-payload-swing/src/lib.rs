//! Payload swing: an arm with an unknown payload must swing up to a set angle in one motion.
//!
//! The unknowns are the payload's mass and the damping of the bearing. Exploration moves the arm
//! for two seconds by weak torques. Only torques at the arm's own period move it enough to identify
//! the mass. The task is one motor pulse of half a second, after which the arm swings freely; the
//! torque must fit the payload.

use std::collections::BTreeMap;

use asid_core::parameter::{Parameter, Scale};
use asid_core::registry::Settings;
use asid_core::signal::Signal;
use asid_core::task::{
    Commander, Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Task,
    TaskSpec,
};
use asid_core::{Capabilities, Difficulty, Layout, Levels, Result, Scene};

/// Name on the command line.
const NAME: &str = "payload-swing";
/// One line for `asid list`.
const ABOUT: &str = "weigh a payload by swinging it, then swing it to a set angle";

/// Largest distance between the swing's peak and the goal in a success, rad.
const THRESHOLD: f64 = 0.05;
/// Length of a frame, s.
const FRAME_PERIOD: f64 = 0.02;
/// Frames of the pulse and of the whole attempt.
const FRAMES: [usize; 2] = [25, 75];

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(PayloadSwing::new()?)),
});

asid_plugin::export_plugin!();

/// The task.
pub struct PayloadSwing {
    spec: TaskSpec,
    /// Angle that the swing must reach, rad.
    goal: f64,
}

/// Settings of the difficulty.
fn difficulties() -> Vec<Difficulty> {
    let about = "angle that the swing is to reach";
    vec![Difficulty::new("goal", "rad", 0.6, [0.3, 0.9], about)]
}

impl PayloadSwing {
    /// The task with its ranges.
    ///
    /// # Errors
    /// If the built-in scene cannot be read.
    pub fn new() -> Result<Self> {
        Self::at(&Levels::new(difficulties()))
    }

    /// The task at given levels of difficulty.
    fn at(levels: &Levels) -> Result<Self> {
        let goal = levels.get("goal")?;
        let angle = Signal {
            sensor: "angle".into(),
            noise: 0.01,
        };
        let exploration = ExplorationProtocol {
            horizon: 20,
            frames_per_step: 5,
            frame_period: FRAME_PERIOD,
            action: vec![Coordinate::new("torque", "N m", [-0.5, 0.5])],
            start: vec![Coordinate::new("angle", "rad", [-0.1, 0.1])],
            signals: vec![angle],
            proprioception: vec!["speed".into()],
            contact: Vec::new(),
        };
        let downstream = DownstreamProtocol {
            metric: "peak_error_rad".into(),
            unit: "rad".into(),
            rule: format!("the swing's peak within {THRESHOLD} rad of {goal} rad"),
            threshold: Some(THRESHOLD),
            frames: FRAMES[1],
            frame_period: FRAME_PERIOD,
            action: vec![Coordinate::new("torque", "N m", [0.0, 3.0])],
            start: vec![Coordinate::new("angle", "rad", [-0.02, 0.02])],
            channels: vec!["angle".into()],
            phases: vec![("pulse".into(), 0.0, FRAMES[0] as f64 * FRAME_PERIOD)],
        };
        let scene = Scene::from_xml(NAME, include_str!("scene.xml"), &[])?;
        let spec = TaskSpec {
            requires: Capabilities::ARTICULATION
                | Capabilities::ACTUATORS
                | Capabilities::JOINT_IMPEDANCE
                | Capabilities::MASS_PARAMETERS,
            parameters: unknowns(),
            difficulty: difficulties(),
            conditions: [("light", 0.3, 0.02), ("heavy", 0.9, 0.05)]
                .map(|(name, mass, damping)| {
                    Condition::fixed(name, &[("mass", mass), ("damping", damping)])
                })
                .into(),
            ..TaskSpec::new([NAME, ABOUT], scene, exploration, downstream)
        };
        Ok(Self { spec, goal })
    }
}

/// Mass of the payload and damping of the bearing.
fn unknowns() -> Vec<Parameter> {
    let unknown = |name: &str, target: &str, range, scale, unit: &str| Parameter {
        name: name.into(),
        targets: target.parse().into_iter().collect(),
        range,
        scale,
        unit: unit.into(),
    };
    vec![
        unknown("mass", "geom/payload/mass", [0.2, 1.0], Scale::Linear, "kg"),
        unknown(
            "damping",
            "joint/shoulder/damping",
            [0.01, 0.1],
            Scale::Log,
            "N m s/rad",
        ),
    ]
}

impl Task for PayloadSwing {
    fn spec(&self) -> &TaskSpec {
        &self.spec
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        qpos[layout.joint("shoulder")?.qpos] = start[0];
        Ok(())
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        vec![signals[0]]
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        Ok(Box::new(Torque))
    }

    fn attempt(&self, _start: &[f64], action: &[f64]) -> Result<Vec<f64>> {
        let pulse = |frame| if frame < FRAMES[0] { action[0] } else { 0.0 };
        Ok((0..FRAMES[1]).map(pulse).collect())
    }

    fn metric(&self, readings: &[f64]) -> Vec<f64> {
        let mut peak = f64::NEG_INFINITY;
        readings
            .iter()
            .map(|angle| {
                peak = angle.max(peak);
                (peak - self.goal).abs()
            })
            .collect()
    }

    fn outcome(&self, readings: &[f64]) -> Outcome {
        // `max` would ignore the NaN of a diverged simulation.
        let highest = |a: f64, &b: &f64| if a > b { a } else { b };
        let error = (readings.iter().fold(f64::NEG_INFINITY, highest) - self.goal).abs();
        Outcome {
            value: error,
            success: error <= THRESHOLD,
            cost: error,
        }
    }

    fn adjusted(&self, values: &BTreeMap<String, f64>) -> Result<Option<Box<dyn Task>>> {
        let levels = Levels::new(difficulties()).with(values)?;
        Ok(Some(Box::new(Self::at(&levels)?)))
    }

    fn settings(&self, section: &str, algorithm: &str) -> Settings {
        // The search has one dimension, so fewer candidates suffice.
        match (section, algorithm) {
            ("solver", "cem") => Settings::from_iter([("population".to_owned(), 16.into())]),
            _ => Settings::new(),
        }
    }
}

/// The action is the torque, held over the control step.
struct Torque;

impl Commander for Torque {
    fn reset(&mut self) {}

    fn commands(&mut self, action: &[f64], ctrl: &mut [f64]) {
        ctrl.fill(action[0]);
    }
}
