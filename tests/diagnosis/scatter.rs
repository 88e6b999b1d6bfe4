//! The scatter of replays of a segment.

use asid::core::episode::ChannelColumns;
use asid::core::progress::Silent;
use asid::core::{Episode, Progress, Scene};
use asid::diagnosis::data::Logs;
use asid::diagnosis::latent_force::context::{Taken, begin};
use asid::diagnosis::latent_force::fit::{Hypothesis, Slopes, fit, settle_noise};
use asid::diagnosis::latent_force::initial::from_readings;
use asid::diagnosis::latent_force::scatter::Scatter;
use asid::diagnosis::latent_force::step_map::StepMap;
use asid::diagnosis::latent_force::walk::Walk;
use asid::diagnosis::machine::Machine;

use crate::diagnosis_support::engine;

/// Rows of a log, physics steps per row, and duration of a step, s.
const ROWS: usize = 20;
const STEPS: usize = 10;
const DT: f64 = 0.002;
/// Standard deviation of a reading, m.
const NOISE: f64 = 1e-3;
/// Initial position, m, initial speed, m/s, and acceleration, m/s², of the slide.
const START: [f64; 3] = [0.01, 0.3, 0.5];

/// A slide under constant acceleration, free but for the attributes `joint`.
fn slide(joint: &str) -> Machine {
    let acceleration = START[2];
    let xml = format!(
        r#"<mujoco><option timestep="{DT}" gravity="{acceleration} 0 0"/><worldbody><body>
        <joint name="slide" type="slide" axis="1 0 0" {joint}/>
        <geom size="0.1" mass="1" contype="0" conaffinity="0"/></body></worldbody>
        <sensor><jointpos name="x" joint="slide"/></sensor></mujoco>"#
    );
    let scene = Scene::from_xml("slide", &xml, &[]).unwrap();
    Machine::new(engine(), &scene, &[], &[], 1).unwrap()
}

/// The log of a slide that is `at` some place, m, at each time, s, read with a noise, m.
pub(super) fn log_of(
    machine: &Machine,
    time: Vec<f64>,
    at: impl Fn(f64) -> f64,
    noise: f64,
) -> Logs {
    let episode = Episode {
        readings: time.iter().map(|t| at(*t)).collect(),
        channels: vec![ChannelColumns {
            name: "x".into(),
            len: 1,
        }],
        time,
        ..Episode::default()
    };
    let named = vec![("log".into(), episode)];
    let mut logs = Logs::new(&machine.plant, &["x".into()], named).unwrap();
    logs.set_noise(&[noise]);
    logs
}

/// Its log without a stop and without noise.
fn logs(machine: &Machine) -> Logs {
    let [place, speed, acceleration] = START;
    let time = (0..ROWS).map(|k| (k * STEPS) as f64 * DT).collect();
    let at = |t: f64| place + speed * t + 0.5 * acceleration * t * t;
    log_of(machine, time, at, NOISE)
}

/// The log as one segment.
fn segment(logs: &Logs) -> Vec<Walk> {
    vec![Walk {
        segment: Some(0),
        ..Walk::new(logs, 0, DT)
    }]
}

/// What a diagnosis begins with: the log as one segment.
fn taken(machine: &Machine, logs: &Logs) -> Taken {
    let walks = segment(logs);
    Taken {
        touching: Vec::new(),
        states: from_readings(&machine.plant, logs, &walks, &[vec![0.0; 2 * ROWS]]),
        walks,
        given: vec![None],
        open: Vec::new(),
        scale: vec![0.2, 0.5],
    }
}

/// Scatter of a slide with the attributes `joint`, as one segment.
///
/// Returns the power of each row in units of the noise, from draws and from half the time step, and
/// the share of rows that is lost.
fn scatter(joint: &str) -> (Vec<[f64; 2]>, f64) {
    let machine = slide(joint);
    let logs = logs(&machine);
    let taken = taken(&machine, &logs);
    let (context, estimate) = begin(&machine, &logs, taken, (&[], &[])).unwrap();
    let finer = machine.halved().unwrap();
    let model = (&Hypothesis::default(), &[][..]);
    let found = Scatter::of(
        &context,
        model,
        (&estimate, &Slopes::default()),
        Some(&finer),
    )
    .unwrap();
    let directions = found.directions[0].len() / ROWS;
    let rows = found.directions[0].chunks(directions).map(|row| {
        let power = |d: &[f64]| d.iter().map(|x| (x / NOISE).powi(2)).sum::<f64>();
        [power(&row[..directions - 1]), power(&row[directions - 1..])]
    });
    (rows.collect(), found.lost)
}

#[test]
fn a_motion_that_is_linear_in_its_start_scatters_by_the_integrator_alone() {
    let (rows, lost) = scatter("");
    let [_, _, acceleration] = START;
    for (k, [draws, integrator]) in rows.into_iter().enumerate() {
        assert!(draws < 1e-10, "{k}: {draws}");
        // Semi-implicit Euler is ahead by a t dt / 2, and half of that vanishes at half the step. A
        // segment on its own gets 0.3 times that change.
        let time = (k * STEPS) as f64 * DT;
        let own = 0.3 * 0.25 * acceleration * time * DT / NOISE;
        assert!((integrator - own * own).abs() < 1e-6, "{k}: {integrator}");
    }
    assert_eq!(lost, 0.0);
}

#[test]
fn behind_a_stop_replays_scatter_and_before_it_they_do_not() {
    // The stop at 0.06 m is reached after 0.15 s.
    let (rows, lost) = scatter(r#"range="-1 0.06" limited="true""#);
    for (k, [draws, _]) in rows.iter().enumerate().take(6) {
        assert!(*draws < 0.01, "{k}: {draws}");
    }
    assert!(rows[8..].iter().any(|[draws, _]| *draws > 0.01));
    assert!(lost < 0.7, "{lost}");
}

#[test]
fn a_replay_ends_where_it_leaves_more_than_is_asked_of_it() {
    let machine = slide("");
    let logs = logs(&machine);
    let walks = segment(&logs);
    let mut map = StepMap::new(&machine, &[], &[], (&logs, &walks), 1).unwrap();
    // An initial position off by three standard deviations stays that far off in every row. The
    // integrator's error is 0.1 standard deviations at the end.
    let [place, speed, _] = START;
    let first = [place + 3.0 * NOISE, speed];
    let begun = [&first[..], &[f64::NAN; 2 * (ROWS - 1)]].concat();
    let mut roll = |most: Option<f64>| {
        let mut states = vec![begun.clone()];
        let left = map.roll(&[], (&mut states, &[most]), &[NOISE * NOISE]);
        let rows = states[0].iter().step_by(2).filter(|x| x.is_finite());
        (left.unwrap()[0], rows.count())
    };
    let (whole, rows) = roll(Some(f64::INFINITY));
    assert!((whole / (9.0 * ROWS as f64) - 1.0).abs() < 0.1, "{whole}");
    assert_eq!(rows, ROWS);
    assert_eq!(roll(Some(1.001 * whole)), (whole, ROWS));
    // A third of the rows accumulates a third of the total.
    let (left, rows) = roll(Some(whole / 3.0));
    assert_eq!(left, f64::INFINITY);
    assert!(rows.abs_diff(ROWS / 3) <= 2, "{rows}");
    assert_eq!(roll(None), (0.0, 1));
}

/// Symptom: a diagnosis of a machine with contact took twice the replays of its initial states.
/// Cause: a fit computed the derivatives again about which the scatter had just been measured.
#[test]
fn a_fit_from_the_derivatives_of_the_scatter_is_the_fit_that_computes_them_again() {
    let machine = slide(r#"range="-1 0.06" limited="true""#);
    let logs = logs(&machine);
    let taken = taken(&machine, &logs);
    let (context, mut estimate) = begin(&machine, &logs, taken, (&[], &[])).unwrap();
    let progress: &dyn Progress = &Silent;
    let model = Hypothesis::default();
    let slopes = settle_noise(&context, &model, &[], &mut estimate, (2, 2), progress).unwrap();
    let scatter = Scatter::of(&context, (&model, &[]), (&estimate, &slopes), None).unwrap();
    let fit_from = |slopes: &Slopes| {
        let extent = (4_usize, progress);
        let found = fit(&context, &model, &[], (&estimate, slopes), extent).unwrap();
        (found.evidence, found.estimate.trajectory)
    };
    let known = slopes.taken(&context, (&[], &estimate.trajectory), &scatter.linear);
    let fitted = fit_from(&known);
    assert!(fitted.0.is_finite());
    assert_eq!(fitted, fit_from(&slopes.renewed()));
    // The fit does begin with them: others lead elsewhere.
    let mut halved = scatter.linear;
    halved[0].h.iter_mut().for_each(|h| *h *= 0.5);
    let known = slopes.taken(&context, (&[], &estimate.trajectory), &halved);
    assert_ne!(fitted, fit_from(&known));
}

/// Along a segment no force is missing, so its size is never asked for.
#[test]
fn along_segments_nothing_depends_on_the_size_of_a_missing_force() {
    let machine = slide("");
    let logs = logs(&machine);
    let taken = taken(&machine, &logs);
    let (context, estimate) = begin(&machine, &logs, taken, (&[], &[])).unwrap();
    assert!(estimate.b.iter().all(Vec::is_empty));
    let settled = |size: f64| {
        let mut estimate = estimate.clone();
        let noise = &mut estimate.noise;
        let variances = noise.q.iter_mut().chain(&mut noise.white);
        variances.for_each(|variance| *variance *= size);
        let model = Hypothesis::default();
        settle_noise(&context, &model, &[], &mut estimate, (2, 4), &Silent).unwrap();
        let missing = estimate.missing(&context);
        assert_eq!((missing.force, missing.share), (0.0, 1.0));
        (estimate.log_likelihood, estimate.trajectory)
    };
    let found = settled(1.0);
    assert!(found.0.is_finite());
    assert_eq!(found, settled(1e12));
}
