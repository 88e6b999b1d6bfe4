//! How often the machine touched the object, where a touch is shorter than a frame.

#![allow(clippy::unwrap_used)]

use asid::core::registry::{BackendEntry, all};
use asid::core::rng::Streams;
use asid::core::signal::Signal;
use asid::core::task::{
    Commander, Condition, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Task,
};
use asid::core::{
    Capabilities, Layout, Parameter, Policy, RealWorld as _, Result, Scene, SimulatedWorld,
};

/// A striker flies at 2 m/s against a ball: they touch for some milliseconds.
const SCENE: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/><worldbody>
  <body name="striker" pos="0 0 1"><joint name="striker" type="slide" axis="1 0 0"/>
    <geom name="striker" type="sphere" size="0.02" mass="0.1" solref="0.004 1"/></body>
  <body name="ball" pos="0.1 0 1"><joint name="ball" type="slide" axis="1 0 0"/>
    <geom name="ball" type="sphere" size="0.02" mass="0.1" solref="0.004 1"/></body>
  </worldbody>
  <actuator><motor name="push" joint="striker"/></actuator>
  <sensor><framepos name="ball_pos" objtype="xbody" objname="ball"/></sensor>
  <keyframe><key name="home" qpos="0 0" qvel="2 0"/></keyframe></mujoco>"#;

struct Tap {
    scene: Scene,
    exploration: ExplorationProtocol,
}

struct Still;

impl Commander for Still {
    fn reset(&mut self) {}
    fn commands(&mut self, _: &[f64], ctrl: &mut [f64]) {
        ctrl.fill(0.0);
    }
}

impl Policy for Still {
    fn reset(&mut self) {}
    fn act(&mut self, _: usize, _: &[f64], action: &mut [f64]) -> Result<()> {
        action.fill(0.0);
        Ok(())
    }
    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

impl Task for Tap {
    fn name(&self) -> &str {
        "tap"
    }
    fn about(&self) -> &str {
        ""
    }
    fn scene(&self) -> &Scene {
        &self.scene
    }
    fn requires(&self) -> Capabilities {
        Capabilities::CONTACT
    }
    fn parameters(&self) -> Vec<Parameter> {
        Vec::new()
    }
    fn conditions(&self) -> Vec<Condition> {
        Vec::new()
    }
    fn exploration(&self) -> &ExplorationProtocol {
        &self.exploration
    }
    fn downstream(&self) -> &DownstreamProtocol {
        unreachable!("nothing is attempted")
    }
    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        qpos[layout.joint("striker")?.qpos] = start[0];
        Ok(())
    }
    fn locate(&self, _: &[f64]) -> Vec<f64> {
        vec![0.0]
    }
    fn commander(&self) -> Result<Box<dyn Commander>> {
        Ok(Box::new(Still))
    }
    fn attempt(&self, _: &[f64], _: &[f64]) -> Result<Vec<f64>> {
        Ok(Vec::new())
    }
    fn metric(&self, _: &[f64]) -> Vec<f64> {
        Vec::new()
    }
    fn outcome(&self, _: &[f64]) -> Outcome {
        Outcome {
            value: 0.0,
            success: false,
            cost: 0.0,
        }
    }
}

fn tap() -> Tap {
    Tap {
        scene: Scene::from_xml("tap", SCENE, &[]).unwrap(),
        exploration: ExplorationProtocol {
            horizon: 2,
            frames_per_step: 5,
            frame_period: 0.02,
            action: vec![Coordinate::new("nothing", "", [0.0, 1.0])],
            start: vec![Coordinate::new("x", "m", [0.0, 0.04])],
            signals: vec![Signal {
                sensor: "ball_pos".into(),
                noise: 1e-6,
            }],
            proprioception: Vec::new(),
            contact: vec![["striker".into(), "ball".into()]],
        },
    }
}

/// Wherever between two frames, and between two physics steps, the tap falls: a ball that moved was
/// touched, in one control step of the two.
#[test]
fn a_tap_between_two_frames_is_a_touch() {
    let task = tap();
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        let model = backend.load(&task.scene).unwrap();
        let (mut missed, mut moved) = (0, 0);
        for k in 0..50 {
            let streams = Streams::new(k);
            let signals = &task.exploration.signals;
            let world = SimulatedWorld::new(&task, &*model, &[], &[], signals, streams).unwrap();
            let mut world = world.with_exploration_start(vec![k as f64 * 0.0008]);
            let real = world.explore(&mut Still).unwrap();
            let rows = real.episode.rows();
            let way = real.episode.reading(rows - 1)[0] - real.episode.reading(0)[0];
            assert!(way > 0.05, "{}: the ball went {way} m", entry.name);
            moved += 1;
            missed += usize::from(real.contact_fraction == 0.0);
        }
        assert_eq!(missed, 0, "{}: of {moved} taps", entry.name);
    }
}
