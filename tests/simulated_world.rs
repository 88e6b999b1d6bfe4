//! The simulated real world: contacts shorter than a frame, trackers with systematic errors, and
//! random numbers that are the same for every method.

#![allow(clippy::unwrap_used)]

use asid::core::registry::{BackendEntry, TaskEntry, all};
use asid::core::rng::Streams;
use asid::core::signal::Signal;
use asid::core::task::{
    Commander, Coordinate, DownstreamProtocol, ExplorationProtocol, Outcome, Task, TaskSpec,
};
use asid::core::{
    Capabilities, Layout, Model, Parameter, Policy, RealWorld as _, Result, Scene, TaskPolicy,
};
use asid::worlds::{SimulatedWorld, TrackerErrors};
use std::sync::Arc;

/// A striker moves at 2 m/s towards a ball; they touch for some milliseconds.
const SCENE: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/><worldbody>
  <body name="striker" pos="0 0 1"><joint name="striker" type="slide" axis="1 0 0"/>
    <geom name="striker" type="sphere" size="0.02" mass="0.1" solref="0.004 1"/></body>
  <body name="ball" pos="0.1 0 1"><joint name="ball" type="slide" axis="1 0 0"/>
    <geom name="ball" type="sphere" size="0.02" mass="0.1" solref="0.004 1"/></body>
  </worldbody>
  <actuator><motor name="push" joint="striker"/></actuator>
  <sensor><framepos name="ball_pos" objtype="xbody" objname="ball"/>
    <framepos name="striker_pos" objtype="xbody" objname="striker"/>
    <framequat name="striker_quat" objtype="xbody" objname="striker"/></sensor>
  <keyframe><key name="home" qpos="0 0" qvel="2 0"/></keyframe></mujoco>"#;

struct Tap {
    spec: TaskSpec,
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
    fn spec(&self) -> &TaskSpec {
        &self.spec
    }

    fn place(&self, layout: &Layout, start: &[f64], qpos: &mut [f64]) -> Result<()> {
        qpos[layout.joint("striker")?.qpos] = start[0];
        Ok(())
    }

    fn locate(&self, signals: &[f64]) -> Vec<f64> {
        vec![signals[0]]
    }

    fn commander(&self) -> Result<Box<dyn Commander>> {
        Ok(Box::new(Still))
    }

    fn attempt(&self, _: &[f64], _: &[f64]) -> Result<Vec<f64>> {
        Ok(vec![0.0; self.spec.downstream.frames])
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

const DOWNSTREAM: fn() -> DownstreamProtocol = || DownstreamProtocol {
    metric: "nothing".into(),
    unit: String::new(),
    rule: String::new(),
    threshold: None,
    frames: 10,
    frame_period: 0.02,
    action: Vec::new(),
    start: vec![Coordinate::new("x", "m", [0.0, 0.04])],
    channels: vec!["striker_pos".into()],
    phases: Vec::new(),
};

fn tap() -> Tap {
    let scene = Scene::from_xml("tap", SCENE, &[]).unwrap();
    let exploration = ExplorationProtocol {
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
    };
    Tap {
        spec: TaskSpec {
            requires: Capabilities::CONTACT,
            ..TaskSpec::new(["tap", ""], scene, exploration, DOWNSTREAM())
        },
    }
}

/// The tap may be at any time between two frames and two physics steps. A ball that moved was
/// touched, in one of the two control steps.
#[test]
fn a_tap_between_two_frames_is_a_touch() {
    let task = tap();
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        let model = backend.load(&task.spec.scene).unwrap();
        let (mut missed, mut moved) = (0, 0);
        for k in 0..50 {
            let streams = Streams::new(k);
            let signals = &task.spec.exploration.signals;
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

/// A policy that leaves the action as it is.
struct Nothing;

impl TaskPolicy for Nothing {
    fn act(&mut self, _: &[f64], _: &mut [f64]) -> Result<()> {
        Ok(())
    }
}

/// The scene without contact, with a tracker of the striker, which moves at 2 m/s.
fn flight() -> (Tap, Arc<dyn Model>) {
    let mut task = tap();
    task.spec.exploration.signals = ["striker_pos", "striker_quat"]
        .map(|sensor| Signal {
            sensor: sensor.into(),
            noise: 1e-9,
        })
        .into();
    task.spec.exploration.contact.clear();
    task.spec.scene = task
        .spec
        .scene
        .with_attribute("body", "ball", "pos", "9 0 1")
        .unwrap();
    let engine = all::<BackendEntry>()[0];
    let model = (engine.make)().unwrap().load(&task.spec.scene).unwrap();
    (task, model)
}

fn world<'a>(
    task: &'a Tap,
    model: &dyn Model,
    seed: u64,
    tracker: TrackerErrors,
) -> SimulatedWorld<'a> {
    let signals = &task.spec.exploration.signals;
    let world = SimulatedWorld::new(task, model, &[], &[], signals, Streams::new(seed)).unwrap();
    let start = vec![0.01];
    world
        .with_exploration_start(start)
        .with_tracker(tracker)
        .unwrap()
}

/// At 2 m/s an object is read behind its position by 2 m/s times the latency, and shifted by the
/// offset. The tracker's rotation rotates the readings.
#[test]
fn a_late_tracker_shows_where_the_object_was() {
    let (task, model) = flight();
    let tracker = TrackerErrors {
        latency: 0.006,
        offset: vec![0.0, 0.003, 0.0, 0.0, 0.0, 0.02],
        ..TrackerErrors::default()
    };
    let mut late = world(&task, &*model, 0, tracker);
    let episode = late.explore(&mut Still).unwrap().episode;
    for k in 0..episode.rows() {
        let row = episode.reading(k);
        let seen_at = (k as f64 * 0.02 - 0.006).max(0.0);
        assert!(
            (row[0] - (0.01 + 2.0 * seen_at)).abs() < 1e-5,
            "row {k}: {row:?}"
        );
        assert!((row[1] - 0.003).abs() < 1e-6, "row {k}: {row:?}");
        assert!(
            (asid::core::signal::yaw(&row[3..7]) - 0.02).abs() < 1e-6,
            "row {k}: {row:?}"
        );
    }
    // The same tracker reads the initial pose of the attempt; the measured outcome is the true one.
    let attempt = late.attempt(&mut Nothing).unwrap();
    assert!((0.0..0.04).contains(&attempt.believed_start[0]));
    let believed = attempt.believed_start[0];
    let log = attempt.episode;
    assert!((log.reading(0)[1] - 0.003).abs() < 1e-6);
    for k in 1..log.rows() {
        let behind = believed + 2.0 * (k as f64 * 0.02 - 0.006);
        assert!((log.reading(k)[0] - behind).abs() < 1e-5);
        let truth = believed + 2.0 * k as f64 * 0.02;
        assert!((attempt.readings[3 * (k - 1)] - truth).abs() < 1e-5);
        assert!(attempt.readings[3 * (k - 1) + 1].abs() < 1e-6);
    }
}

/// Records the readings that it gets.
struct Witness(Vec<Vec<f64>>);

impl Policy for Witness {
    fn reset(&mut self) {}
    fn act(&mut self, _: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        self.0.push(reading.to_vec());
        action.fill(0.0);
        Ok(())
    }
    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

#[test]
fn readings_are_missing_at_the_trackers_rate_and_the_policy_has_the_last_one() {
    let (task, model) = flight();
    let tracker = TrackerErrors {
        every: 2,
        ..TrackerErrors::default()
    };
    let mut witness = Witness(Vec::new());
    let mut slow = world(&task, &*model, 0, tracker);
    let episode = slow.explore(&mut witness).unwrap().episode;
    for k in 0..episode.rows() {
        let there = episode.reading(k)[..7].iter().all(|x| x.is_finite());
        assert_eq!(there, k % 2 == 0, "row {k}");
    }
    // Frame 5 is missing, so the second action is based on frame 4.
    assert_eq!(witness.0[1], episode.reading(4));
    let lost = TrackerErrors {
        dropout: 0.3,
        ..TrackerErrors::default()
    };
    let missing: usize = (0..40)
        .map(|seed| {
            let mut world = world(&task, &*model, seed, lost.clone());
            let episode = world.explore(&mut Still).unwrap().episode;
            assert!(
                episode.reading(0)[0].is_finite(),
                "the first reading is lost"
            );
            (1..episode.rows())
                .filter(|&k| episode.reading(k)[0].is_nan())
                .count()
        })
        .sum();
    // 400 readings: 120 are lost on average, with a standard deviation of 9.
    assert!((93..147).contains(&missing), "{missing}");
    for wrong in [
        TrackerErrors {
            latency: -1.0,
            ..TrackerErrors::default()
        },
        TrackerErrors {
            offset: vec![0.0],
            ..TrackerErrors::default()
        },
        TrackerErrors {
            every: 0,
            ..TrackerErrors::default()
        },
    ] {
        let signals = &task.spec.exploration.signals;
        let world =
            SimulatedWorld::new(&task, &*model, &[], &[], signals, Streams::new(0)).unwrap();
        assert!(world.with_tracker(wrong).is_err());
    }
}

/// Common random numbers: the attempt is the same for methods with and without exploration, and for
/// trackers with and without dropouts.
#[test]
fn every_method_meets_the_same_chance() {
    let (mut task, model) = flight();
    task.spec
        .exploration
        .signals
        .iter_mut()
        .for_each(|s| s.noise = 1e-3);
    let plain = TrackerErrors::default();
    let mut alone = world(&task, &*model, 5, plain.clone());
    let first = alone.attempt(&mut Nothing).unwrap();
    let mut after = world(&task, &*model, 5, plain.clone());
    let episode = after.explore(&mut Still).unwrap().episode;
    let second = after.attempt(&mut Nothing).unwrap();
    assert_eq!(first.believed_start, second.believed_start);
    assert_eq!(first.episode.readings, second.episode.readings);
    let other = world(&task, &*model, 6, plain.clone())
        .attempt(&mut Nothing)
        .unwrap();
    assert_ne!(first.believed_start, other.believed_start);
    let lost = TrackerErrors {
        dropout: 0.5,
        ..plain
    };
    let holes = world(&task, &*model, 5, lost)
        .explore(&mut Still)
        .unwrap()
        .episode;
    for (a, b) in episode.readings.iter().zip(&holes.readings) {
        assert!(b.is_nan() || a == b);
    }
}

/// Moves towards the object.
struct Chase {
    /// Index of the hand's position in a reading.
    hand: usize,
}

impl Policy for Chase {
    fn reset(&mut self) {}
    fn act(&mut self, _: usize, reading: &[f64], action: &mut [f64]) -> Result<()> {
        for (i, a) in action.iter_mut().enumerate() {
            *a = reading[i] - reading[self.hand + i];
        }
        Ok(())
    }
    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

/// In every task with an arm, an object that was at rest and ends elsewhere was touched.
#[test]
fn what_moved_was_touched() {
    for entry in all::<TaskEntry>() {
        let task = (entry.make)().unwrap();
        let protocol = task.exploration();
        if protocol
            .proprioception
            .first()
            .is_none_or(|s| s != "ee_pos")
        {
            continue;
        }
        for engine in all::<BackendEntry>() {
            let backend = (engine.make)().unwrap();
            let model = backend.load(task.scene()).unwrap();
            let parameters = task.parameters();
            let truth: Vec<f64> = parameters.iter().map(Parameter::center).collect();
            let mut moved = 0;
            for seed in 0..4 {
                let streams = Streams::new(seed);
                let signals = &protocol.signals;
                let mut world =
                    SimulatedWorld::new(&*task, &*model, &parameters, &truth, signals, streams)
                        .unwrap();
                let layout = model.layout();
                let lengths = signals
                    .iter()
                    .map(|s| layout.sensor(&s.sensor).unwrap().len);
                let mut policy = Chase {
                    hand: lengths.sum(),
                };
                let real = world.explore(&mut policy).unwrap();
                let [first, last] =
                    [0, real.episode.rows() - 1].map(|k| real.episode.reading(k)[..2].to_vec());
                let way = (last[0] - first[0]).hypot(last[1] - first[1]);
                // Five standard deviations of the noise, and nothing moves by itself.
                if way > 0.02 {
                    moved += 1;
                    assert!(
                        real.contact_fraction > 0.0,
                        "{} on {}, seed {seed}: moved {way} m untouched",
                        entry.name,
                        engine.name
                    );
                }
            }
            println!("{:20} {:8} {moved} of 4 moved", entry.name, engine.name);
        }
    }
}
