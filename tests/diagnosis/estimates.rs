//! Estimates of the motion of a slide: their initial states in a model that reads otherwise, and
//! points between two of them.

use asid::core::parameter::Scale;
use asid::core::{Parameter, Scene};
use asid::diagnosis::data::Logs;
use asid::diagnosis::latent_force::context::{Taken, begin};
use asid::diagnosis::latent_force::initial::from_readings;
use asid::diagnosis::latent_force::step_map::Derivatives;
use asid::diagnosis::latent_force::walk::Walk;
use asid::diagnosis::machine::Machine;
use asid::effects::EffectSpec;

use super::row_slopes::largest_difference;
use super::scatter::log_of;
use crate::diagnosis_support::engine;

/// Rows of a log, time between them and time step, s, and standard deviation of a reading, m.
const ROWS: usize = 20;
const ROW: f64 = 0.02;
const STEP: f64 = 0.002;
const NOISE: f64 = 1e-3;
/// Place where a log begins, m.
const PLACE: f64 = 0.5;

/// A slide on a spring.
fn slide() -> Machine {
    let xml = format!(
        r#"<mujoco><option timestep="{STEP}" gravity="0 0 0"/><worldbody><body>
        <joint name="slide" type="slide" axis="1 0 0" stiffness="8"/>
        <geom size="0.1" mass="2" contype="0" conaffinity="0"/></body></worldbody>
        <sensor><jointpos name="x" joint="slide"/></sensor></mujoco>"#
    );
    let scene = Scene::from_xml("slide", &xml, &[]).unwrap();
    Machine::new(engine(), &scene, &[], &[], 1).unwrap()
}

/// A log in which it moves otherwise than on this spring.
fn logs(machine: &Machine) -> Logs {
    let time = (0..ROWS).map(|k| ROW * k as f64).collect();
    log_of(machine, time, |t| PLACE + 0.1 * (5.0 * t).sin(), NOISE)
}

/// The log as a segment, or row by row.
fn taken(machine: &Machine, logs: &Logs, segment: Option<usize>) -> Taken {
    let walks = vec![Walk {
        segment,
        ..Walk::new(logs, 0, STEP)
    }];
    Taken {
        touching: Vec::new(),
        given: vec![None],
        open: Vec::new(),
        states: from_readings(&machine.plant, logs, &walks, &[vec![0.0; 2 * ROWS]]),
        walks,
        scale: vec![0.1, 0.5],
    }
}

/// Symptom: a sensor of a wrong scale lost evidence in every segment, because the prior of the
/// initial state contradicted it. Cause: the position that reads as logged was sought by one step
/// to first order, `(2 - s) x` in place of `x / s`.
#[test]
fn a_segment_begins_where_a_scaled_sensor_reads_as_logged() {
    let machine = slide();
    let logs = logs(&machine);
    let (context, estimate) =
        begin(&machine, &logs, taken(&machine, &logs, Some(0)), (&[], &[])).unwrap();
    let spec: EffectSpec = "sensor-scale@x:scale=1".parse().unwrap();
    let parameter = Parameter {
        name: "scale".into(),
        targets: vec!["effect/sensor-scale@x/scale".parse().unwrap()],
        range: [0.3, 3.0],
        scale: Scale::Linear,
        unit: "1".into(),
    };
    let mut map = context.map(&[spec], &[parameter], 2).unwrap();
    for scale in [0.5, 1.0, 1.3, 2.5] {
        let mut estimate = estimate.clone();
        estimate.read_as(&context, &mut map, &[scale]).unwrap();
        let found = estimate.read[0][0];
        assert!((found - PLACE / scale).abs() < 1e-9, "{scale}: {found}");
        let reads = map.readings_at(&[scale], &estimate.read).unwrap();
        assert!(largest_difference(&reads[0], &context.as_read[0]) < 1e-9);
    }
}

/// Symptom: a shorter step of a fit whose sensors have memory was judged far from where its values
/// were, and the fit ended early. Cause: such a step smooths several times, and only the last time
/// was undone.
#[test]
fn a_part_of_several_smoothings_is_part_of_the_whole_way() {
    let machine = slide();
    let logs = logs(&machine);
    let (context, from) = begin(&machine, &logs, taken(&machine, &logs, None), (&[], &[])).unwrap();
    let mut map = context.map(&[], &[], 3).unwrap();
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let mut to = from.clone();
    for _ in 0..2 {
        let linear = map.linearise(&[], &to.trajectory, want, &[], &[]).unwrap();
        to.improve(&context, &linear, 1);
    }
    let [begins, ends] = [&from, &to].map(|e| &e.trajectory[0]);
    assert!(largest_difference(begins, ends) > 1e-4);
    for part in [0.0, 0.3, 1.0] {
        let found = from.towards(&context, &to, part);
        let want = begins.iter().zip(ends).map(|(a, b)| a + part * (b - a));
        let want: Vec<f64> = want.collect();
        assert!(largest_difference(&found.trajectory[0], &want) < 1e-12);
    }
}
