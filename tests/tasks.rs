//! The same checks of every registered task on every registered engine.
//!
//! `cargo test --features mujoco --test tasks -- --nocapture` prints the table.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[allow(dead_code)] // not every test needs all of it
mod task_support;

use std::sync::atomic::AtomicU64;
use std::time::Instant;

use asid::algorithms::fisher::inert::check_parameters;
use asid::core::progress::Silent;
use asid::core::real_world::RealEpisode;
use asid::core::registry::{
    BackendEntry, ExplorerEntry, IdentifierEntry, Settings, SolverEntry, TaskEntry, all, find,
};
use asid::core::rng::Rng;
use asid::core::task::Outcome;
use asid::core::tracker::ReadingFrames;
use asid::core::{
    Capabilities, Control, Episode, Levels, Parameter, Policy, Problem, RealWorld, Recording,
    Rollout, Streams, Task,
};
use asid::mjcf::Plant;
use asid::worlds::SimulatedWorld;
use rand::Rng as _;
use task_support::visits;

/// Number of actions at which the metric is evaluated.
const TRIES: usize = 12;

/// A check of a problem; returns its cell of the table.
type Check = fn(&Problem<'_>) -> String;

const CHECKS: [(&str, Check); 5] = [
    ("seeded episodes", seeded_episodes_are_identical),
    ("observations", observations_are_within_bounds),
    ("parameters", every_parameter_acts),
    ("snapshots", snapshots_continue_to_the_bit),
    ("metric", the_metric_tells_good_from_bad),
];

#[test]
fn every_task_on_every_engine() {
    for entry in all::<TaskEntry>() {
        let task = (entry.make)().unwrap();
        // Includes the optional unknowns.
        let mut parameters = task.parameters();
        parameters.extend(task.optional_parameters());
        for parameter in &parameters {
            parameter.check().unwrap();
        }
        for engine in all::<BackendEntry>() {
            on(&*task, &parameters, engine);
        }
    }
}

/// A difficulty changes its own setting in an otherwise equal task.
#[test]
fn every_difficulty_can_be_set_over_its_range() {
    for entry in all::<TaskEntry>() {
        let task = (entry.make)().unwrap();
        let set = |name: &str, value: f64| task.adjusted(&[(name.to_owned(), value)].into());
        for d in task.difficulty() {
            for value in d.range.into_iter().chain([d.default]).chain(d.published) {
                d.check(value).unwrap();
                let other = set(&d.name, value).unwrap().unwrap();
                assert_eq!(other.name(), task.name());
                assert_eq!(other.difficulty(), task.difficulty());
                Plant::of(other.scene()).unwrap();
                for condition in other.conditions() {
                    // A condition's task is as hard as its base task.
                    let under = other.under(&condition.name).unwrap();
                    if let Some(under) = under {
                        let noise = |t: &dyn Task| t.exploration().signals[0].noise;
                        assert_eq!(noise(&*under), noise(&*other));
                        assert_eq!(under.downstream().threshold, other.downstream().threshold);
                    }
                }
            }
            let beyond = set(&d.name, 2.0 * d.range[1]).err().unwrap().to_string();
            assert!(beyond.contains(&d.name), "{beyond}");
        }
        let defaults = Levels::new(task.difficulty());
        let same = task.adjusted(&defaults.values()).unwrap();
        if let Some(same) = same {
            assert_eq!(same.scene(), task.scene());
            assert_eq!(same.exploration(), task.exploration());
            assert_eq!(same.downstream(), task.downstream());
        }
        assert!(
            task.adjusted(&[("no such".into(), 1.0)].into()).is_err() || defaults.all().is_empty()
        );
    }
}

/// Objects and regions that figures need exist, and are within the picture.
#[test]
fn objects_are_tracked_and_regions_lie_apart() {
    for entry in all::<TaskEntry>() {
        let task = (entry.make)().unwrap();
        let plant = Plant::of(task.scene()).unwrap();
        let protocol = task.exploration();
        let objects = task.objects();
        assert!(!objects.is_empty(), "{}", task.name());
        for object in &objects {
            let tracked = |name: &String| protocol.signals.iter().any(|s| s.sensor == *name);
            assert!(tracked(&object.position), "{}", object.position);
            assert!(object.orientation.as_ref().is_none_or(tracked));
            for body in object.contact.iter().flatten() {
                plant.layout.body(body).unwrap();
            }
        }
        let regions = &task.spec().regions;
        for (i, region) in regions.iter().enumerate() {
            let n = region.corners.len() as f64;
            let middle = [0, 1].map(|k| region.corners.iter().map(|c| c[k]).sum::<f64>() / n);
            let within: Vec<f64> = visits::shares(&[middle], regions);
            assert_eq!(within.iter().sum::<f64>(), 1.0, "{}", region.label);
            assert_eq!(within[i], 1.0, "{}", region.label);
        }
    }
}

/// Readings at a tenth of the frames equal those of every frame, and the others are missing.
#[test]
fn a_slow_tracker_reads_at_each_control_step_and_not_between() {
    let task = (find::<TaskEntry>("rod-balancing").unwrap().make)().unwrap();
    let slow = task.adjusted(&[("tracker_rate".to_owned(), 10.0)].into());
    let slow = slow.unwrap().unwrap();
    let backend = (all::<BackendEntry>()[0].make)().unwrap();
    let play = |task: &dyn Task| {
        let parameters = task.parameters();
        let mut episode = Episode::default();
        task_support::on_engine(&*backend, task, &parameters, 0, |problem, _| {
            episode = wild_episode(problem, 3).episode;
        });
        episode
    };
    let (every, some) = (play(&*task), play(&*slow));
    let frames = ReadingFrames::of(&*slow, 0.02);
    // The rod's position and orientation come first.
    let tracked = 7;
    for k in 0..every.rows() {
        let (a, b) = (every.reading(k), some.reading(k));
        assert_eq!(
            a[tracked..],
            b[tracked..],
            "own sensors read at every frame"
        );
        assert_eq!(frames.has(k), k % 5 == 0);
        if frames.has(k) {
            assert_eq!(a, b, "row {k}");
        } else {
            assert!(b[..tracked].iter().all(|x| x.is_nan()), "row {k}");
        }
    }
}

fn on(task: &dyn Task, parameters: &[Parameter], engine: &BackendEntry) {
    let backend = (engine.make)().unwrap();
    let row = format!("{:22} {:8}", task.name(), engine.name);
    let lacking = task.spec().requires - backend.capabilities();
    if !lacking.is_empty() {
        let names: Vec<&str> = lacking.iter_names().map(|(n, _)| n).collect();
        println!("{row} left out: the engine lacks {}", names.join(", "));
        return;
    }
    let clock = Instant::now();
    let model = backend.load(task.scene()).unwrap();
    let signals = task.exploration().signals.clone();
    let (physics, env) = (AtomicU64::new(0), AtomicU64::new(0));
    // Unknowns that this engine cannot set are left out, but it must be able to set the task's own.
    let settable: Vec<Parameter> = parameters
        .iter()
        .filter(|p| {
            let refused = p.targets.iter().find_map(|t| model.nominal(t).err());
            if let Some(why) = &refused {
                let own = task.parameters().iter().any(|o| o.name == p.name);
                assert!(!own, "{row} {}: {why}", p.name);
                println!("{row} {} left out: {why}", p.name);
            }
            refused.is_none()
        })
        .cloned()
        .collect();
    let problem = Problem {
        task,
        model: &*model,
        capabilities: backend.capabilities(),
        parameters: &settable,
        signals: &signals,
        threads: 0,
        streams: Streams::new(11),
        progress: &Silent,
        physics_counter: &physics,
        env_counter: &env,
    };
    settings_are_taken(task);
    for (name, check) in CHECKS {
        println!("{row} {name:16} {}", check(&problem));
    }
    println!("{row} {:.1} s", clock.elapsed().as_secs_f64());
}

/// Asserts that each setting of a task is a setting of its algorithm.
fn settings_are_taken(task: &dyn Task) {
    let merged = |section: &str, name: &str, mut settings: Settings| {
        for (key, value) in task.settings(section, name) {
            let before = settings.insert(key.clone(), value);
            assert!(before.is_some(), "{section} {name} has no setting {key}");
        }
        settings
    };
    for e in all::<ExplorerEntry>() {
        (e.make)(&merged("explorer", e.name, (e.defaults)())).unwrap();
    }
    for e in all::<IdentifierEntry>() {
        (e.make)(&merged("identifier", e.name, (e.defaults)())).unwrap();
    }
    for e in all::<SolverEntry>() {
        (e.make)(&merged("solver", e.name, (e.defaults)())).unwrap();
    }
}

fn centers(problem: &Problem<'_>) -> Vec<f64> {
    problem.parameters.iter().map(Parameter::center).collect()
}

/// Random actions over the whole range.
struct Wild(Rng);

impl Policy for Wild {
    fn reset(&mut self) {}

    fn act(
        &mut self,
        _step: usize,
        _reading: &[f64],
        action: &mut [f64],
    ) -> asid::core::Result<()> {
        // The world clamps to the range; these are mostly its ends.
        action.fill_with(|| self.0.random_range(-1.0..1.0));
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

fn wild_episode(problem: &Problem<'_>, seed: u64) -> RealEpisode {
    let streams = Streams::new(seed);
    let mut world = SimulatedWorld::new(
        problem.task,
        problem.model,
        problem.parameters,
        &centers(problem),
        problem.signals,
        streams,
    )
    .unwrap();
    world.explore(&mut Wild(streams.stream("wild"))).unwrap()
}

fn seeded_episodes_are_identical(problem: &Problem<'_>) -> String {
    let [a, b, c] = [3, 3, 4].map(|seed| wild_episode(problem, seed));
    let bits = |e: &RealEpisode| -> Vec<u64> {
        let starts = e.true_start.iter().flatten();
        let numbers = starts.chain(&e.episode.ctrl).chain(&e.episode.readings);
        numbers.map(|x| x.to_bits()).collect()
    };
    assert_eq!(bits(&a), bits(&b));
    assert_ne!(a.true_start, c.true_start, "the seed draws no start");
    // The first reading shows the initial pose, up to the noise.
    let start = a.true_start.unwrap();
    let tracked: usize = problem
        .signals
        .iter()
        .map(|s| problem.model.layout().sensor(&s.sensor).unwrap().len)
        .sum();
    let seen = problem.task.locate(&a.episode.reading(0)[..tracked]);
    assert_eq!(seen.len(), start.len());
    let largest = problem.signals.iter().map(|s| s.noise).fold(0.0, f64::max);
    for ((x, y), c) in seen
        .iter()
        .zip(&start)
        .zip(&problem.task.exploration().start)
    {
        assert!((x - y).abs() < 6.0 * largest, "{}: {x} for {y}", c.name);
    }
    "identical to the bit".into()
}

fn observations_are_within_bounds(problem: &Problem<'_>) -> String {
    let [low, high] = problem.task.spec().bounds;
    let layout = problem.model.layout();
    let mut worst: f64 = 0.0;
    for seed in 0..3 {
        let episode = wild_episode(problem, seed).episode;
        for channel in &episode.channels {
            let kind = &layout.sensor(&channel.name).unwrap().kind;
            let noise = problem.signals.iter().find(|s| s.sensor == channel.name);
            let slack = noise.map_or(0.0, |s| 6.0 * s.noise);
            for k in 0..episode.rows() {
                let x = &episode.reading(k)[episode.channel(&channel.name).unwrap()];
                let where_ = || format!("{} in row {k}: {x:?}", channel.name);
                assert!(x.iter().all(|x| x.is_finite()), "{}", where_());
                match kind.as_str() {
                    "framepos" => {
                        for i in 0..3 {
                            let out = (low[i] - x[i]).max(x[i] - high[i]);
                            assert!(out < slack, "{}", where_());
                            let half = 0.5 * (high[i] - low[i]);
                            worst = worst.max(1.0 + out / half);
                        }
                    }
                    "framequat" => {
                        let norm = x.iter().map(|q| q * q).sum::<f64>().sqrt();
                        assert!((norm - 1.0).abs() < 1e-5, "{}", where_());
                    }
                    // No joint of a machine here exceeds this.
                    "jointpos" => {
                        assert!(x[0].abs() < std::f64::consts::TAU + slack, "{}", where_())
                    }
                    _ => {}
                }
            }
        }
    }
    format!("at most {:.0} % of the way to the bounds", 100.0 * worst)
}

fn every_parameter_acts(problem: &Problem<'_>) -> String {
    check_parameters(problem).unwrap();
    let names: Vec<&str> = problem.parameters.iter().map(|p| &*p.name).collect();
    names.join(", ")
}

/// Random exploration commands over `steps` control steps.
fn commands(problem: &Problem<'_>, steps: usize) -> Vec<f64> {
    let protocol = problem.task.exploration();
    let mut rng = Streams::new(5).stream("commands");
    let mut commander = problem.task.commander().unwrap();
    commander.reset();
    let row = protocol.frames_per_step * problem.model.layout().nu();
    let mut all = vec![0.0; steps * row];
    for part in all.chunks_exact_mut(row) {
        let action: Vec<f64> = protocol.action.iter().map(|c| c.at(rng.random())).collect();
        commander.commands(&action, part);
    }
    all
}

fn snapshots_continue_to_the_bit(problem: &Problem<'_>) -> String {
    if !problem.capabilities.contains(Capabilities::EXACT_SNAPSHOT) {
        return "left out: the engine lacks EXACT_SNAPSHOT".into();
    }
    let protocol = problem.task.exploration();
    let layout = problem.model.layout();
    let recording = layout.recording(&protocol.channels()).unwrap();
    let steps = protocol.horizon.min(10);
    let ctrl = commands(problem, 2 * steps);
    let (first, second) = ctrl.split_at(ctrl.len() / 2);
    let mut batch = problem.batch(2).unwrap();
    let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
    batch
        .set_parameters(&[0, 1], &centers(problem).repeat(2))
        .unwrap();
    batch
        .place(problem.task, &[0, 1], &start.repeat(2))
        .unwrap();
    let frames = steps * protocol.frames_per_step;
    let substeps = problem.substeps(protocol.frame_period).unwrap();
    let play = |sim: usize, ctrl: &[f64], simulator: &mut dyn asid::core::Simulator| {
        let mut out = vec![0.0; frames * recording.width()];
        let sims = [sim];
        let rollout = Rollout::new(&sims, frames, substeps, Control::Shared(ctrl), &recording);
        simulator.rollout(&rollout, &mut out).unwrap();
        out.into_iter().map(f64::to_bits).collect::<Vec<_>>()
    };
    let simulator = &mut *batch.simulator;
    play(0, first, simulator);
    let snapshot = simulator.save(&[0]).unwrap();
    let once = play(0, second, simulator);
    // Into the same simulation, and into one in another state.
    simulator.load(&snapshot, &[0], &[0]).unwrap();
    assert_eq!(once, play(0, second, simulator));
    simulator.load(&snapshot, &[0], &[1]).unwrap();
    assert_eq!(once, play(1, second, simulator));
    "identical to the bit".into()
}

fn the_metric_tells_good_from_bad(problem: &Problem<'_>) -> String {
    let protocol = problem.task.downstream();
    let layout = problem.model.layout();
    let recording: Recording = layout.recording(&protocol.channels).unwrap();
    let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
    let sims: Vec<usize> = (0..TRIES).collect();
    let mut batch = problem.batch(TRIES).unwrap();
    batch
        .set_parameters(&sims, &centers(problem).repeat(TRIES))
        .unwrap();
    batch
        .place(problem.task, &sims, &start.repeat(TRIES))
        .unwrap();
    // Spread evenly over the range of each entry.
    const PACE: [f64; 4] = [0.618_034, 0.754_878, 0.819_173, 0.856_675];
    let control: Vec<f64> = sims
        .iter()
        .flat_map(|i| {
            let entries = protocol.action.iter().zip(PACE.iter().cycle());
            let action: Vec<f64> = entries
                .map(|(c, pace)| c.at((0.5 + *i as f64 * pace) % 1.0))
                .collect();
            problem.task.attempt(&start, &action).unwrap()
        })
        .collect();
    assert_eq!(control.len(), TRIES * protocol.frames * layout.nu());
    let row = protocol.frames * recording.width();
    let mut out = vec![0.0; TRIES * row];
    let substeps = problem.substeps(protocol.frame_period).unwrap();
    let rollout = Rollout::new(
        &sims,
        protocol.frames,
        substeps,
        Control::PerSimulation(&control),
        &recording,
    );
    batch.simulator.rollout(&rollout, &mut out).unwrap();
    let outcomes: Vec<Outcome> = out
        .chunks_exact(row)
        .map(|readings| {
            let trace = problem.task.metric(readings);
            assert_eq!(trace.len(), protocol.frames);
            assert!(trace.iter().all(|x| x.is_finite()));
            let outcome = problem.task.outcome(readings);
            assert!(outcome.value.is_finite() && outcome.cost.is_finite());
            outcome
        })
        .collect();
    let order = |a: &&Outcome, b: &&Outcome| a.cost.total_cmp(&b.cost);
    let best = outcomes.iter().min_by(order).unwrap();
    let worst = outcomes.iter().max_by(order).unwrap();
    // A bad action fails and costs clearly more. If any action succeeds, so does the cheapest.
    assert!(
        !worst.success && worst.cost > 1.5 * best.cost,
        "{outcomes:?}"
    );
    let successes = outcomes.iter().filter(|o| o.success).count();
    assert!(best.success || successes == 0, "{outcomes:?}");
    if let Some(limit) = protocol.threshold {
        let beyond = outcomes.iter().any(|o| o.success && o.value > limit);
        assert!(!beyond, "{outcomes:?}");
    }
    // A missing reading is no success.
    let lost = problem.task.outcome(&vec![f64::NAN; row]);
    assert!(!lost.success && lost.cost.is_finite() && lost.value.is_finite());
    assert!(lost.cost >= best.cost);
    format!(
        "{} from {:.3} to {:.3}, {successes} of {TRIES} succeed",
        protocol.metric, best.value, worst.value
    )
}
