//! The rod task's physics on every built-in engine: what identification and the task rely on,
//! without any learning.

#![allow(clippy::unwrap_used, clippy::print_stdout)] // what each engine gives is printed

#[allow(dead_code)] // not every test needs all of it
mod task_support;

use asid::algorithms::fisher::FisherSettings;
use asid::algorithms::identify::Likelihood;
use asid::algorithms::identify::expected::{ExpectedSettings, expected_deviation};
use asid::core::identify::Assumptions;
use asid::core::registry::{BackendEntry, ExplorerEntry, IdentifierEntry, all, find};
use asid::core::{Control, Policy, Problem, RealWorld, Rollout};
use asid::pipeline::episode_information;
use asid::worlds::SimulatedWorld;

/// Calls `check` with a problem for each engine.
fn on_every_engine(seed: u64, check: impl Fn(&str, &Problem<'_>)) {
    task_support::on_every_engine("rod-balancing", seed, check);
}

/// Outcomes of attempts at these offsets and pick points, from the middle of the start range.
fn attempts(problem: &Problem<'_>, cases: &[(f64, f64)]) -> Vec<asid::core::task::Outcome> {
    let protocol = problem.task.downstream();
    let layout = problem.model.layout();
    let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
    let sims: Vec<usize> = (0..cases.len()).collect();
    let mut batch = problem.batch(cases.len()).unwrap();
    let offsets: Vec<f64> = cases.iter().map(|c| c.0).collect();
    batch.set_parameters(&sims, &offsets).unwrap();
    batch
        .place(problem.task, &sims, &start.repeat(cases.len()))
        .unwrap();
    let control: Vec<f64> = cases
        .iter()
        .flat_map(|c| problem.task.attempt(&start, &[c.1]).unwrap())
        .collect();
    let recording = layout.recording(&protocol.channels).unwrap();
    let mut out = vec![0.0; cases.len() * protocol.frames * recording.width()];
    let substeps = problem.substeps(protocol.frame_period).unwrap();
    let rollout = Rollout::new(
        &sims,
        protocol.frames,
        substeps,
        Control::PerSimulation(&control),
        &recording,
    );
    batch.simulator.rollout(&rollout, &mut out).unwrap();
    out.chunks_exact(protocol.frames * recording.width())
        .map(|r| problem.task.outcome(r))
        .collect()
}

#[test]
fn a_rod_laid_down_at_its_center_of_mass_stays_and_35_mm_off_it_falls() {
    on_every_engine(0, |engine, problem| {
        // The ledge is 40 mm wide and the grip slips by at most 3 mm: 10 mm is well inside, 35 mm
        // well outside.
        for offset in [-0.08, 0.0, 0.08] {
            let center = 0.75 * offset;
            let cases = [-0.035, -0.01, 0.0, 0.01, 0.035].map(|e| (offset, center + e));
            let outcomes = attempts(problem, &cases);
            for (i, outcome) in outcomes.iter().enumerate() {
                let near = (1..=3).contains(&i);
                assert_eq!(
                    outcome.success, near,
                    "{engine}, offset {offset}, case {i}: {outcome:?}"
                );
                if near {
                    assert!(
                        outcome.value < 1.0,
                        "{engine}, offset {offset}: {outcome:?}"
                    );
                } else {
                    assert!(
                        outcome.value > 20.0,
                        "{engine}, offset {offset}: {outcome:?}"
                    );
                }
            }
        }
    });
}

#[test]
fn a_narrow_ledge_lets_fall_what_a_wide_one_holds() {
    let task = task_support::task("rod-balancing");
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        for (width, holds) in [(0.06, true), (0.04, true), (0.01, false)] {
            let set = [("ledge_width".to_owned(), width)].into();
            let task = task.adjusted(&set).unwrap().unwrap();
            task_support::on_engine(&*backend, &*task, &task.parameters(), 0, |problem, _| {
                // Laid down 12 mm off its centre of mass; the grip slips by at most 3 mm.
                let outcome = &attempts(problem, &[(0.04, 0.03 + 0.012)])[0];
                assert_eq!(
                    outcome.success, holds,
                    "{}, {width}: {outcome:?}",
                    entry.name
                );
            });
        }
    }
}

/// A push along the table is informative about the friction that slows the rod, if that is an
/// unknown.
#[test]
fn a_push_tells_the_friction_too() {
    let task = task_support::task("rod-balancing");
    let parameters = [task.parameters(), task.optional_parameters()].concat();
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        task_support::on_engine(&*backend, &*task, &parameters, 3, |problem, _| {
            let mut world = world(problem, &[0.05, 0.3], vec![0.55, 0.0, 0.2]);
            let real = world.explore(&mut Push).unwrap();
            let told = episode_information(
                problem,
                &FisherSettings::default(),
                &[0.05, 0.3],
                &[0.55, 0.0, 0.2],
                &real.actions,
            )
            .unwrap();
            let (prior, after) = (&told.expected_std[0], told.expected_std.last().unwrap());
            println!(
                "{}: expected deviations {prior:.4?} to {after:.4?}",
                entry.name
            );
            // The hand stops. How far the rod slides on, and how it rotates, depends on the
            // friction.
            assert!(
                after[1] < 0.7 * prior[1],
                "{}: {prior:?} to {after:?}",
                entry.name
            );
        });
    }
}

/// What `told` says of a push of the rod at [`PUSHED`], under other settings of the tracker.
fn of_a_push(set: &[(&str, f64)], told: impl Fn(&Problem<'_>, &[f64]) -> f64) -> f64 {
    let set = set.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
    let task = task_support::task("rod-balancing");
    let task = task.adjusted(&set).unwrap().unwrap();
    let backend = (all::<BackendEntry>()[0].make)().unwrap();
    let actions = [vec![[0.02, 0.03]; 5], vec![[0.025, 0.0]; 15]]
        .concat()
        .concat();
    let mut out = f64::NAN;
    task_support::on_engine(&*backend, &*task, &task.parameters(), 3, |problem, _| {
        out = told(problem, &actions);
    });
    out
}

/// Offset of the mass in [`of_a_push`], m.
const OFFSET: [f64; 1] = [0.05];
/// Initial pose of the rod there.
const PUSHED: [f64; 3] = [0.55, 0.0, 0.2];

/// Symptom: the deviation that a run expects of an episode is that of a tracker which reads every
/// frame, however slow the tracker is.
#[test]
fn what_a_run_expects_of_a_slow_tracker_is_less() {
    let std = |rate: f64| {
        of_a_push(&[("tracker_rate", rate)], |problem, actions| {
            // Noise alone: systematic errors and roughness do not average out.
            let settings = ExpectedSettings {
                assumes: Assumptions {
                    correlated: true,
                    ..Assumptions::default()
                },
                ..ExpectedSettings::default()
            };
            let told = expected_deviation(problem, &settings, &OFFSET, &PUSHED, actions);
            told.unwrap().unwrap().last().unwrap()[0]
        })
    };
    let ratio = std(10.0) / std(50.0);
    assert!((1.4..2.7).contains(&ratio), "{ratio}");
}

/// Fewer or noisier readings are less informative, in proportion to their number and noise.
#[test]
fn a_slower_and_noisier_tracker_tells_less() {
    let std = |set: &[(&str, f64)]| {
        of_a_push(set, |problem, actions| {
            let settings = FisherSettings {
                roughness: false,
                nuisance: false,
                ..FisherSettings::default()
            };
            let told = episode_information(problem, &settings, &OFFSET, &PUSHED, actions);
            told.unwrap().expected_std.last().unwrap()[0]
        })
    };
    let every = std(&[("tracker_rate", 50.0)]);
    let fifth = std(&[("tracker_rate", 10.0)]);
    // A reading every fifth frame has a fifth of the information, if the information is spread
    // evenly.
    let ratio = fifth / every;
    assert!((1.8..2.7).contains(&ratio), "{ratio}");
    // Five times the noise leaves a twenty-fifth of the information.
    let noisy = std(&[("tracker_noise", 0.01), ("tracker_angle_noise", 0.05)]);
    assert!((noisy / every - 5.0).abs() < 0.1, "{}", noisy / every);
}

/// Guards against tracking the inertial frame of the rod (MuJoCo's `objtype="body"`). Every reading
/// would then contain the centre of mass, even before the rod is touched.
#[test]
fn readings_before_contact_do_not_tell_the_mass_offset() {
    on_every_engine(0, |engine, problem| {
        let protocol = problem.task.exploration();
        let start: Vec<f64> = protocol.start.iter().map(|c| c.center()).collect();
        // Ten control steps at rest.
        let actions = vec![0.0; 10 * protocol.action.len()];
        let settings = FisherSettings::default();
        let told = episode_information(problem, &settings, &[0.0], &start, &actions).unwrap();
        let (before, after) = (told.expected_std[0][0], told.expected_std[10][0]);
        // The soft table lets the rod lean by 1 mrad at most, a tenth of the noise of one reading.
        // The prior's standard deviation shrinks by less than a tenth.
        assert!(after > 0.9 * before, "{engine}: {before} to {after}");
    });
}

/// The real world of a problem with this truth and initial pose.
fn world<'a>(problem: &Problem<'a>, truth: &[f64], start: Vec<f64>) -> SimulatedWorld<'a> {
    let Problem {
        task,
        model,
        parameters,
        signals,
        streams,
        ..
    } = *problem;
    SimulatedWorld::new(task, model, parameters, truth, signals, streams)
        .unwrap()
        .with_exploration_start(start)
}

/// A plan that pushes one end of a rod that lies across.
struct Push;

impl Policy for Push {
    fn reset(&mut self) {}

    fn act(&mut self, step: usize, _reading: &[f64], action: &mut [f64]) -> asid::core::Result<()> {
        let plan = match step {
            0..=4 => [0.02, 0.03],
            _ => [0.025, 0.0],
        };
        action.copy_from_slice(&plan);
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

#[test]
fn one_push_identifies_the_offset_and_the_interval_holds_it() {
    on_every_engine(3, |engine, problem| {
        let truth = [0.05];
        let mut world = world(problem, &truth, vec![0.55, 0.0, 0.2]);
        let real = world.explore(&mut Push).unwrap();
        let entry = find::<IdentifierEntry>("reps").unwrap();
        let identifier = (entry.make)(&(entry.defaults)()).unwrap();
        let found = identifier
            .identify(problem, std::slice::from_ref(&real.episode))
            .unwrap();
        let marginal = &found.posterior.marginals[0];
        assert!(
            (found.residual - 1.0).abs() < 0.25,
            "{engine}: residual {}",
            found.residual
        );
        assert!(
            (marginal.estimate - truth[0]).abs() < 4.0 * marginal.std.max(1e-3),
            "{engine}: {marginal:?}"
        );
        assert!(
            (marginal.estimate - truth[0]).abs() < 0.02,
            "{engine}: {marginal:?}"
        );
        assert!(marginal.std < 0.02, "{engine}: {marginal:?}");
        // The initial pose is found more precisely than the first reading shows it (2 mm).
        let error = (found.starts[0][0] - 0.55).hypot(found.starts[0][1]);
        assert!(error < 0.004, "{engine}: {error}");
    });
}

#[test]
fn the_likelihood_of_the_truth_is_what_the_noise_makes_it() {
    on_every_engine(5, |engine, problem| {
        let truth = [-0.03];
        let mut world = world(problem, &truth, vec![0.55, 0.0, 0.2]);
        let real = world.explore(&mut Push).unwrap();
        let mut likelihood =
            Likelihood::new(problem, std::slice::from_ref(&real.episode), 1).unwrap();
        // The point of the truth, with the initial pose as an offset from the one that the first
        // reading shows.
        let n = likelihood.dimension();
        let zero = vec![0.0; n];
        let located = likelihood.start(&zero, 0);
        let mut point = vec![problem.parameters[0].to_scaled(truth[0]); 1];
        for i in 0..located.len() {
            let mut unit = zero.clone();
            unit[1 + i] = 1.0;
            let step = likelihood.start(&unit, 0)[i] - located[i];
            point.push(([0.55, 0.0, 0.2][i] - located[i]) / step);
        }
        let residual = likelihood.residuals(&[point]).unwrap().remove(0).unwrap();
        let mean = residual.iter().map(|x| x * x).sum::<f64>() / likelihood.present() as f64;
        // 606 readings: the mean square is 1 within 4 standard deviations of sqrt(2 / 606) = 0.057.
        // The initial pose goes through a division and back, which moves contacts by rounding.
        assert!((mean - 1.0).abs() < 0.3, "{engine}: {mean}");
    });
}

#[test]
fn the_planner_touches_the_rod_wherever_it_lies() {
    on_every_engine(0, |engine, problem| {
        let entry = find::<ExplorerEntry>("fisher-cem").unwrap();
        let mut settings = (entry.defaults)();
        settings.insert("iterations".into(), 3.into());
        settings.insert("population".into(), 12.into());
        let explorer = (entry.make)(&settings).unwrap();
        let start = [0.58, -0.15, 1.3];
        let mut explored = explorer.explore(problem, Some(&start)).unwrap();
        let truth = [0.02];
        let mut world = world(problem, &truth, start.to_vec());
        let real = world.explore(&mut *explored.policy).unwrap();
        let told = episode_information(
            problem,
            &FisherSettings::default(),
            &truth,
            &start,
            &real.actions,
        )
        .unwrap();
        // Without contact the prior's standard deviation of 58 mm remains.
        let std = told.expected_std.last().unwrap()[0];
        assert!(std < 0.03, "{engine}: {std}");
    });
}
