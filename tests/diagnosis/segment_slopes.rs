//! Derivatives along segments: replays by many rows at once against replays row by row.

use asid::core::{BatchConfig, Control, Model as _, Rollout, Scene, Simulator as _};
use asid::diagnosis::data::Logs;
use asid::diagnosis::latent_force::step_map::{Anew, Derivatives, StepMap};
use asid::diagnosis::latent_force::walk::Walk;
use asid::diagnosis::machine::Machine;
use asid::effects::EffectSpec;

use super::row_slopes::{largest_difference, logs_at};
use crate::diagnosis_support::engine;

/// Time step, s.
const DT: f64 = 0.002;
/// Rows of the log: more than one rollout takes.
const ROWS: usize = 150;
/// Initial position, m, and speed, m/s.
const START: [f64; 2] = [0.05, 0.3];
/// Step of the differences, m and m/s.
const PUSH: f64 = 1e-4;

/// A slide on a spring with a servo.
fn machine() -> Machine {
    let xml = format!(
        r#"<mujoco><option timestep="{DT}" gravity="0 0 0"/><worldbody><body>
        <joint name="slide" type="slide" axis="1 0 0" stiffness="8" damping="1"/>
        <geom size="0.1" mass="2" contype="0" conaffinity="0"/></body></worldbody>
        <actuator><position name="pull" joint="slide" kp="20" kv="1"/></actuator>
        <sensor><jointpos name="x" joint="slide"/></sensor></mujoco>"#
    );
    let scene = Scene::from_xml("slide", &xml, &[]).unwrap();
    Machine::new(engine(), &scene, &[], &[], 1).unwrap()
}

/// A log whose rows are 10 physics steps apart, and in the last third of uneven lengths.
fn logs(machine: &Machine) -> Logs {
    let mut time = vec![0.0];
    for k in 0..ROWS - 1 {
        let steps = if k < 100 { 10 } else { [8, 12, 9][k % 3] };
        time.push(time[k] + f64::from(steps) * DT);
    }
    let command = |k: usize| 0.12 * (0.7 * k as f64).sin();
    logs_at(machine, time, (0..ROWS).map(command).collect())
}

/// Effects that remember commands and readings, and one on forces.
fn effects() -> [EffectSpec; 3] {
    [
        "coulomb-friction@slide:force=0.2",
        "actuator-delay@pull:delay=0.013",
        "sensor-filter@x:time_constant=0.03",
    ]
    .map(|s| s.parse().unwrap())
}

/// States and readings along a walk, each row by a rollout and a read of its own.
fn row_by_row(machine: &Machine, walk: &Walk, start: [f64; 2]) -> [Vec<f64>; 2] {
    let model = machine.refined(&effects()).unwrap();
    let record = |names: &[&str]| model.layout().recording(names).unwrap();
    let (state, all) = (
        record(&["qpos.slide", "qvel.slide"]),
        record(&["qpos.slide", "qvel.slide", "x"]),
    );
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: Vec::new(),
    };
    let mut batch = model.batch(&config).unwrap();
    batch.set_state(&[0], &start[..1], &start[1..]).unwrap();
    let (mut states, mut readings) = (Vec::new(), Vec::new());
    for k in 0..walk.len() {
        let mut row = [0.0; 3];
        batch.read(&[0], &all, &mut row).unwrap();
        states.extend_from_slice(&row[..2]);
        readings.push(row[2]);
        if let Some(&substeps) = walk.substeps.get(k) {
            let control = Control::PerSimulation(&walk.ctrl[k..=k]);
            let rollout = Rollout::new(&[0], 1, substeps, control, &state);
            batch.rollout(&rollout, &mut [0.0; 2]).unwrap();
        }
    }
    [states, readings]
}

#[test]
fn a_replay_by_many_rows_is_the_one_row_by_row() {
    let machine = machine();
    let logs = logs(&machine);
    let whole = Walk::new(&logs, 0, DT);
    let segment = |rows: usize| Walk {
        segment: Some(rows / 40),
        ..whole.part(0..rows)
    };
    let walks = [150, 90, 1].map(segment);
    let [states, read] = row_by_row(&machine, &whole, START);
    let pushed = [[PUSH, 0.0], [0.0, PUSH]]
        .map(|[x, v]| row_by_row(&machine, &whole, [START[0] + x, START[1] + v]));
    let each: Vec<Vec<f64>> = walks
        .iter()
        .map(|w| states[..2 * w.len()].to_vec())
        .collect();
    let mut map = StepMap::new(&machine, &effects(), &[], (&logs, &walks), 3).unwrap();
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let found = map.linearise(&[], &each, want, &[PUSH; 2], &[]).unwrap();
    let mut rolled: Vec<Vec<f64>> = each.iter().map(|s| vec![0.0; s.len()]).collect();
    for states in &mut rolled {
        states[..2].copy_from_slice(&START);
    }
    let all = [Some(f64::INFINITY); 3];
    let left = map.roll(&[], (&mut rolled, &all), &[1.0]).unwrap();
    for (w, walk) in walks.iter().enumerate() {
        assert!(found[w].defect.iter().all(|d| d.abs() < 1e-12));
        assert!(largest_difference(&rolled[w], &each[w]) < 1e-12);
        let mut sum = 0.0;
        for k in 0..walk.len() {
            for (i, [_, pushed]) in pushed.iter().enumerate() {
                let slope = (pushed[k] - read[k]) / PUSH;
                assert!((found[w].h[2 * k + i] - slope).abs() < 1e-8, "{w} {k} {i}");
            }
            let residual = found[w].residual[k];
            if k < walk.segment.unwrap() {
                assert!(residual.is_nan());
                continue;
            }
            let logged = logs.episodes[0].readings[k];
            assert!((residual - (logged - read[k])).abs() < 1e-12);
            sum += residual * residual;
        }
        assert!((left[w] - sum).abs() < 1e-12 * (1.0 + sum));
    }
    let half: Vec<Option<f64>> = left.iter().map(|l| Some(0.5 * l)).collect();
    let left = map.roll(&[], (&mut rolled, &half), &[1.0]).unwrap();
    assert!(left.iter().all(|l| l.is_infinite()));
}

/// Symptom: a derivative that depends on the number of cores. Cause: beside a walk that is no
/// segment, a segment took the simulations for a sensor that remembers.
#[test]
fn a_blind_coordinate_has_no_derivative_beside_a_walk_with_a_late_sensor() {
    let machine = machine();
    let logs = logs(&machine);
    let whole = Walk::new(&logs, 0, DT);
    let segment = Walk {
        segment: Some(0),
        ..whole.clone()
    };
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let [states, _] = row_by_row(&machine, &whole, START);
    let blind = [vec![false, true], Vec::new()];
    let of = |walks: &[Walk]| {
        let mut map = StepMap::new(&machine, &effects(), &[], (&logs, walks), 3).unwrap();
        let anew = Anew {
            blind: &blind[..walks.len()],
            ..Anew::default()
        };
        let states = vec![states.clone(); walks.len()];
        let found = map.linearise_anew(&[], &states, (want, anew), &[PUSH; 2], &[]);
        found.unwrap().remove(0).h
    };
    let alone = of(std::slice::from_ref(&segment));
    assert!(alone.chunks(2).all(|h| h[1] == 0.0));
    assert_eq!(of(&[segment, whole]), alone);
}
