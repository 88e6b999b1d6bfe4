//! The engine's own error over a row.

use std::fmt::Write as _;

use asid::core::episode::ChannelColumns;
use asid::core::{Episode, Scene};
use asid::diagnosis::data::Logs;
use asid::diagnosis::latent_force::context::{Taken, begin};
use asid::diagnosis::latent_force::fit::Hypothesis;
use asid::diagnosis::latent_force::half_step::step_error;
use asid::diagnosis::latent_force::initial::from_readings;
use asid::diagnosis::latent_force::step_error::DEVIATION;
use asid::diagnosis::latent_force::step_map::{Derivatives, StepMap};
use asid::diagnosis::latent_force::walk::Walk;
use asid::diagnosis::machine::Machine;
use asid::diagnosis::result::{DiagnosisResult, Kind};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::run_on;
use crate::diagnosis_support::engine;

/// Mass, kg, stiffness, N/m, and damping, N s/m, of a slide on a spring.
const SLIDE: [f64; 3] = [2.0, 50.0, 1.0];
/// Time step, s, and time between rows, s.
const DT: f64 = 0.004;
const ROW: f64 = 0.02;
/// Standard deviation of a reading, m.
const NOISE: f64 = 2e-5;

fn model() -> String {
    let [mass, stiffness, damping] = SLIDE;
    format!(
        r#"<mujoco><option timestep="{DT}" gravity="0 0 0"/><worldbody><body name="body">
        <joint name="slide" type="slide" axis="1 0 0" stiffness="{stiffness}" damping="{damping}"/>
        <geom size="0.1" mass="{mass}" contype="0" conaffinity="0"/></body></worldbody>
        <actuator><motor name="drive" joint="slide"/></actuator>
        <sensor><jointpos name="x" joint="slide"/></sensor></mujoco>"#
    )
}

/// Returns the exact state of an oscillator a time, s, after the state `[x, v]`.
fn solution([mass, stiffness, damping]: [f64; 3], [x, v]: [f64; 2], time: f64) -> [f64; 2] {
    let (square, decay) = (stiffness / mass, 0.5 * damping / mass);
    let rate = (square - decay * decay).sqrt();
    let (sin, cos) = (rate * time).sin_cos();
    let along = (v + decay * x) / rate;
    let shrinks = (-decay * time).exp();
    let position = x * cos + along * sin;
    let speed = -decay * position + rate * (along * cos - x * sin);
    [shrinks * position, shrinks * speed]
}

#[test]
fn it_is_what_separates_a_row_of_steps_from_the_solution() {
    let scene = Scene::from_xml("slide", &model(), &[]).unwrap();
    let machine = Machine::new(engine(), &scene, &[], &[], 1).unwrap();
    let rows = 20;
    let state = |k: usize| [0.1 * (k as f64).sin(), 0.3 * (k as f64).cos()];
    let states: Vec<f64> = (0..rows).flat_map(state).collect();
    let episode = Episode {
        time: (0..rows).map(|k| ROW * k as f64).collect(),
        readings: (0..rows).map(|k| state(k)[0]).collect(),
        actuators: vec!["drive".into()],
        ctrl: vec![0.0; rows],
        channels: vec![ChannelColumns {
            name: "x".into(),
            len: 1,
        }],
        ..Episode::default()
    };
    let logs = Logs::new(&machine.plant, &["x".into()], vec![("log".into(), episode)]).unwrap();
    let walks = vec![Walk::new(&logs, 0, DT)];
    let mut map = StepMap::new(&machine, &[], &[], (&logs, &walks), 1).unwrap();
    let none = Derivatives::default();
    let trajectory = [states.clone()];
    let mut linear = map.linearise(&[], &trajectory, none, &[], &[]).unwrap();
    let taken = Taken {
        touching: Vec::new(),
        walks: walks.clone(),
        given: vec![None],
        open: vec![0, 1],
        states: from_readings(&machine.plant, &logs, &walks, &[vec![0.0; 2 * rows]]),
        scale: vec![0.1, 0.3],
    };
    let (context, _) = begin(&machine, &logs, taken, (&[], &[])).unwrap();
    let model = Hypothesis::default();
    let finer = machine.halved().unwrap();
    let error = step_error(&context, (&model, &[]), &trajectory, &finer).unwrap();
    assert_eq!((error.columns(), error.center()), (1, &[3.0][..]));
    error.join(&mut linear, 0);
    let (mut left, mut whole) = (0.0, 0.0);
    for k in 0..rows - 1 {
        let [next, ahead] = [solution(SLIDE, state(k), ROW), state(k + 1)];
        for i in 0..2 {
            // The defect is the result of the steps minus the state at the next row.
            let from_solution = next[i] - ahead[i] - linear[0].defect[2 * k + i];
            let told = linear[0].state_columns[2 * k + i] / DEVIATION;
            left += (from_solution - told).powi(2);
            whole += from_solution.powi(2);
        }
    }
    // Second-order terms are smaller by about a step times the rate of the motion.
    assert!(left.sqrt() < 0.05 * whole.sqrt(), "{left} {whole}");
}

/// Diagnoses a model by logs of the exact solution of an oscillator, which begins elsewhere in each.
fn diagnosed(model: &str, oscillator: [f64; 3]) -> DiagnosisResult {
    let folder = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut noise = || NOISE * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
    for episode in 0..6 {
        let start = [0.05 + 0.01 * f64::from(episode), 0.1];
        let mut text = "time,x,ctrl.drive,qpos.slide,qvel.slide".to_owned();
        for row in 0..150 {
            let time = ROW * f64::from(row);
            let given = if row == 0 {
                format!("{},{}", start[0], start[1])
            } else {
                ",".to_owned()
            };
            let x = solution(oscillator, start, time)[0] + noise();
            write!(text, "\n{time:.2},{x},0,{given}").unwrap();
        }
        let name = if episode < 4 { "train" } else { "test" };
        let file = format!("{name}_{episode}.csv");
        std::fs::write(folder.path().join(file), text + "\n").unwrap();
    }
    std::fs::write(folder.path().join("nominal.xml"), model).unwrap();
    let study = format!(
        "model = \"nominal.xml\"\ntrain = [\"train_*.csv\"]\ntest = [\"test_*.csv\"]\n[noise]\nx = {NOISE}\n"
    );
    std::fs::write(folder.path().join("study.toml"), study).unwrap();
    run_on(folder.path(), &[]).0.result
}

/// The oscillator lacks nothing but the error of the steps, which its readings show. Without the
/// column of that error, friction or another spring would make up for it.
#[test]
fn nothing_earns_evidence_by_it() {
    let result = diagnosed(&model(), SLIDE);
    assert!(result.gap.identified > 3.0, "{}", result.gap.identified);
    assert!(result.verdict.kind == Kind::None, "{}", result.sentence);
    let step = result.checks.iter().find(|c| c.check == "time-step");
    assert!(step.is_some_and(|c| !c.ok), "{step:?}");
    for set in &result.ranking {
        let evidence = set.fitted.or(set.screened).unwrap_or(0.0);
        assert!(evidence < 4.0, "{evidence} for {:?}", set.effects);
    }
}

/// Symptom: the friction of a light joint was named drag of its body with 92 %, and not ambiguous.
/// Cause: the engine steps friction implicitly and drag explicitly, and the error of a step was that
/// of the model without either.
#[test]
fn one_law_that_an_engine_steps_in_two_ways_is_not_told_apart() {
    let [mass, stiffness, damping] = [0.2, 50.0, 0.2];
    let model = format!(
        r#"<mujoco><option timestep="{DT}" gravity="0 0 0" integrator="implicitfast"/><worldbody>
        <body name="body"><joint name="slide" type="slide" axis="1 0 0" damping="{damping}"/>
        <geom size="0.1" mass="{mass}" contype="0" conaffinity="0"/></body></worldbody>
        <actuator><position name="drive" joint="slide" kp="{stiffness}"/></actuator>
        <sensor><jointpos name="x" joint="slide"/></sensor></mujoco>"#
    );
    let result = diagnosed(&model, [mass, stiffness, damping + 1.0]);
    let verdict = &result.verdict;
    let sets = verdict.ambiguous_with.iter().chain([&verdict.effects]);
    let sets: Vec<&[String]> = sets.map(Vec::as_slice).collect();
    for law in ["viscous-friction@slide", "linear-drag@body"] {
        let named = sets.iter().any(|set| *set == [law]);
        assert!(named, "{law} is not among {sets:?}: {}", result.sentence);
    }
}
