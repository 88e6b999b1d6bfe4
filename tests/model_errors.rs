//! Errors of the simulator in identification: the ensemble of models, and what it does to an
//! interval.

#![allow(clippy::unwrap_used)]

mod cart_support;
#[allow(dead_code)] // not every test needs all of it
mod cli_support;
#[allow(dead_code)] // not every test needs all of it
mod task_support;

use std::sync::Arc;

use asid::core::parameter::{Parameter, Scale};
use asid::core::registry::{BackendEntry, IdentifierEntry, find};
use asid::core::simulator::{
    BatchConfig, Control, ExternalForce, ParameterChange, Rollout, Simulator,
};
use asid::core::{Backend, Model, Policy, Problem, RealWorld as _, Result, Streams, Task};
use asid::worlds::{
    Ensemble, ModelErrors, Perturbation, PerturbationRanges, SimulatedWorld, perturb,
};
use cart_support::Cart;
use cli_support::{Workplace, tiny};

fn rapier() -> Box<dyn Backend> {
    (find::<BackendEntry>("rapier").unwrap().make)().unwrap()
}

/// Simulations of a batch.
const SIZE: usize = 7;
/// Frames of a rollout.
const FRAMES: usize = 4;

/// Sets masses and states, then plays commands, a force and a change of mass; returns the readings.
fn played(simulator: &mut dyn Simulator, model: &dyn Model) -> Vec<f64> {
    let all: Vec<usize> = (0..SIZE).collect();
    let ramp = |scale: f64| -> Vec<f64> { (0..SIZE).map(|i| scale * (1.0 + i as f64)).collect() };
    simulator.set_parameters(&all, &ramp(0.2)).unwrap();
    simulator.reset(&all).unwrap();
    simulator.set_state(&all, &ramp(0.01), &ramp(0.1)).unwrap();
    let record = model.layout().recording(&["x".to_owned()]).unwrap();
    let sims = [0, 1, 3, 4, 6];
    let control: Vec<f64> = (0..sims.len() * FRAMES).map(|k| 0.3 * k as f64).collect();
    let wrench: Vec<f64> = (0..sims.len() * FRAMES * 6)
        .map(|k| f64::from(u8::from(k % 6 == 0)) * 0.1 * k as f64)
        .collect();
    let forces = [ExternalForce {
        body: 1,
        wrench: &wrench,
    }];
    let changes = [ParameterChange {
        frame: 2,
        column: 0,
        values: &[2.0, 1.5, 1.0, 0.7, 0.5],
    }];
    let rollout = Rollout {
        forces: &forces,
        changes: &changes,
        ..Rollout::new(&sims, FRAMES, 5, Control::PerSimulation(&control), &record)
    };
    let mut out = vec![0.0; sims.len() * FRAMES];
    simulator.rollout(&rollout, &mut out).unwrap();
    let mut last = vec![0.0; SIZE];
    simulator.read(&all, &record, &mut last).unwrap();
    out.extend(last);
    out
}

#[test]
fn an_ensemble_of_one_model_three_times_is_that_model_to_the_bit() {
    let model: Arc<dyn Model> = rapier().load(Cart::new().scene()).unwrap();
    let three = Ensemble::new(vec![Arc::clone(&model); 3]).unwrap();
    let config = BatchConfig {
        size: SIZE,
        threads: 1,
        targets: vec!["geom/cart/mass".parse().unwrap()],
    };
    let [mut one, mut shared] =
        [&*model, &three as &dyn Model].map(|m| m.simulator(&config).unwrap());
    let readings = played(&mut *one, &*model);
    assert_eq!(readings, played(&mut *shared, &three));
    assert_eq!(one.steps_taken(), shared.steps_taken());
    assert!(shared.status().iter().all(|s| s.is_running()));
    // A state returns to any simulation of its member, and to no other.
    let record = model.layout().recording(&["x".to_owned()]).unwrap();
    let state = shared.save(&[0, 1, 4]).unwrap();
    shared.load(&state, &[2, 0], &[1, 3]).unwrap();
    shared.copy_state(&[2], &[5]).unwrap();
    let mut now = vec![0.0; SIZE];
    let all: Vec<usize> = (0..SIZE).collect();
    shared.read(&all, &record, &mut now).unwrap();
    let last = &readings[readings.len() - SIZE..];
    assert_eq!([now[1], now[3], now[5]], [last[4], last[0], last[2]]);
    assert!(shared.load(&state, &[0], &[1]).is_err());
    assert!(shared.copy_state(&[0], &[1]).is_err());
    assert!(Ensemble::new(Vec::new()).is_err());
}

/// A force that begins after two steps.
struct Push;

impl Policy for Push {
    fn reset(&mut self) {}
    fn act(&mut self, step: usize, _reading: &[f64], action: &mut [f64]) -> Result<()> {
        action[0] = if step < 2 { 0.0 } else { 4.0 };
        Ok(())
    }
    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

/// Errors of the estimated mass in its standard deviations, by a model without a lag and by an
/// ensemble with lags of 0 to 30 ms, and the latter's standard deviation, kg.
fn errors(lag: f64, mass: f64) -> [f64; 3] {
    let (task, backend) = (Cart::new(), rapier());
    let parameters: [Parameter; 1] = [Cart::mass(Scale::Linear)];
    let lagging = PerturbationRanges {
        servo_lag: [lag; 2],
        ..PerturbationRanges::off()
    };
    let plant = asid::mjcf::Plant::of(task.scene()).unwrap();
    let streams = Streams::new(5);
    let drawn = Perturbation::draw(&lagging, &plant, &plant.layout, &[], streams).unwrap();
    let scene = task.scene();
    let world = perturb(&*backend, scene, (&[], &[]), &parameters, &[], &drawn).unwrap();
    let known = ModelErrors {
        members: 16,
        contact_time: [1.0; 2],
        contact_damping: [1.0; 2],
        servo_lag: [0.0, 0.03],
        mass: [1.0; 2],
    };
    let ensemble = known.ensemble(&*backend, scene, (&[], &[]), &parameters, streams);
    let (ensemble, left_out) = ensemble.unwrap().unwrap();
    assert!(left_out.is_empty(), "{left_out:?}");
    let entry = find::<IdentifierEntry>("reps").unwrap();
    let mut settings = (entry.defaults)();
    // Otherwise the tracker's latency is taken for the lag.
    let none = toml::Table::from_iter([("latency".to_owned(), 0.0.into())]);
    settings.insert("tracker".into(), toml::Value::Table(none));
    let identifier = (entry.make)(&settings).unwrap();
    let mut out = [0.0; 3];
    task_support::on_engine(&*backend, &task, &parameters, 2, |problem, _| {
        let signals = problem.signals;
        let mut real =
            SimulatedWorld::new(&task, &*world.model, &parameters, &[mass], signals, streams)
                .unwrap();
        let real = real.explore(&mut Push).unwrap();
        let found = [problem.model, &ensemble].map(|model| {
            let problem = Problem {
                model,
                ..problem.clone()
            };
            let found = identifier.identify(&problem, std::slice::from_ref(&real.episode));
            let m = &found.unwrap().posterior.marginals[0];
            ((m.estimate - mass).abs() / m.std, m.std)
        });
        out = [found[0].0, found[1].0, found[1].1];
    });
    out
}

/// A cart whose drive lags by 20 ms is pushed for 0.16 s, and seems heavier by a fifth.
#[test]
fn a_lag_that_a_model_lacks_does_not_make_the_mass_certain_and_wrong() {
    let [exact, ensemble, std] = errors(0.02, 1.1);
    assert!(exact > 5.0, "{exact}");
    assert!(ensemble < 3.0 && std < 0.3, "{ensemble} {std}");
}

#[test]
fn a_run_takes_errors_of_its_model_into_account_and_says_so() {
    let place = Workplace::new();
    let run = |members: &str, out: &str| {
        let members = format!("model_errors.members={members}");
        let arguments = [
            "run",
            "rod-balancing",
            "--backend",
            "rapier",
            "--set",
            &members,
        ];
        place.run(&tiny(&[&arguments[..], &["--out", out]].concat()))
    };
    let made = run("4", "four");
    assert!(made.status.success(), "{made:?}");
    let said = String::from_utf8_lossy(&made.stderr).into_owned();
    assert!(
        said.contains("model_errors leaves out contact softness"),
        "{said}"
    );
    let config = place.read("four/config.toml");
    assert!(config.contains("[model_errors]\nmembers = 4"), "{config}");
    // What a model gets wrong moves many readings together.
    assert!(config.contains("correlated = true"), "{config}");
    let again = [
        "run",
        "rod-balancing",
        "--config",
        "four/config.toml",
        "--out",
        "again",
    ];
    assert!(place.run(&again).status.success());
    let estimate = |folder: &str| {
        let result: serde_json::Value =
            serde_json::from_str(&place.read(&format!("{folder}/result.json"))).unwrap();
        result["parameters"][0]["estimate"].clone()
    };
    assert_eq!(estimate("four"), estimate("again"));
    // One model would be taken as certain.
    for members in ["1", "100"] {
        let refused = run(members, "refused");
        assert_eq!(refused.status.code(), Some(2));
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(said.contains("model_errors.members"), "{said}");
    }
}
