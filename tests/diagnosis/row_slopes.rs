//! Derivatives of a row with respect to state and values, from all its physics steps and from one
//! of them.

use asid::core::episode::ChannelColumns;
use asid::core::parameter::Scale;
use asid::core::{Episode, Parameter, Scene};
use asid::diagnosis::data::Logs;
use asid::diagnosis::latent_force::context::{Taken, begin};
use asid::diagnosis::latent_force::initial::from_readings;
use asid::diagnosis::latent_force::one_step::one_step_tells;
use asid::diagnosis::latent_force::step_map::{
    Anew, Derivatives, LinearEpisode, StepMap, Variation,
};
use asid::diagnosis::latent_force::walk::Walk;
use asid::diagnosis::machine::Machine;
use asid::effects::EffectSpec;

use crate::diagnosis_support::engine;

/// Rows of a log, physics steps per row, and their duration, s.
const ROWS: usize = 20;
const STEPS: usize = 10;
const DT: f64 = 0.002;
/// Mass, kg, stiffness, N/m, and damping, N s/m, of a slide.
const SLIDE: [f64; 3] = [2.0, 8.0, 1.0];

/// A slide on a spring, with a servo of stiffness `kp` (N/m) and a limit of `force` (N).
fn scene(kp: f64, force: f64) -> Scene {
    let [mass, stiffness, damping] = SLIDE;
    let xml = format!(
        r#"<mujoco><option timestep="{DT}" gravity="0 0 0"/><worldbody><body>
        <joint name="slide" type="slide" axis="1 0 0" stiffness="{stiffness}" damping="{damping}"/>
        <geom size="0.1" mass="{mass}" contype="0" conaffinity="0"/></body></worldbody>
        <actuator><position name="pull" joint="slide" kp="{kp}" kv="{}" forcerange="-{force} {force}"/></actuator>
        <sensor><jointpos name="x" joint="slide"/></sensor></mujoco>"#,
        0.05 * kp
    );
    Scene::from_xml("slide", &xml, &[]).unwrap()
}

/// A log in which the slide oscillates under a constant command to one side.
fn logs(machine: &Machine) -> Logs {
    let time = (0..ROWS).map(|k| (k * STEPS) as f64 * DT).collect();
    logs_at(machine, time, vec![0.12; ROWS])
}

/// A log of the slide at some times (s) under some commands, one per row.
pub(crate) fn logs_at(machine: &Machine, time: Vec<f64>, ctrl: Vec<f64>) -> Logs {
    let episode = Episode {
        readings: time.iter().map(|t| 0.1 * (5.0 * t).sin()).collect(),
        actuators: vec!["pull".into()],
        ctrl,
        channels: vec![ChannelColumns {
            name: "x".into(),
            len: 1,
        }],
        time,
        ..Episode::default()
    };
    Logs::new(&machine.plant, &["x".into()], vec![("log".into(), episode)]).unwrap()
}

fn machine(scene: &Scene) -> Machine {
    Machine::new(engine(), scene, &[], &[], 1).unwrap()
}

/// The log of a machine with some effects, linearised from one step of each row or from all.
fn linearised(machine: &Machine, specs: &[EffectSpec], one_step: bool) -> LinearEpisode {
    let logs = logs(machine);
    let walks = [Walk::new(&logs, 0, DT)];
    let mut map = StepMap::new(machine, specs, &[], (&logs, &walks), 3).unwrap();
    map.by_one_step(one_step);
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let mut found = map.linearise(&[], &[states()], want, &[], &[]).unwrap();
    found.remove(0)
}

/// States along the log.
fn states() -> Vec<f64> {
    let state = |k: usize| [0.1 * (k as f64).sin(), 0.3 * (k as f64).cos()];
    (0..ROWS).flat_map(state).collect()
}

/// Largest absolute difference of two lists of the same length.
pub(crate) fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let each = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    each.fold(0.0, f64::max)
}

#[test]
fn slopes_of_an_oscillator_are_those_of_its_solution_either_way() {
    let machine = machine(&scene(0.0, 1.0));
    let [mass, stiffness, damping] = SLIDE;
    // Natural frequency and decay rate of the damped oscillator.
    let (square, decay) = (stiffness / mass, 0.5 * damping / mass);
    let rate = (square - decay * decay).sqrt();
    let time = STEPS as f64 * DT;
    let (sin, cos) = (rate * time).sin_cos();
    let row = [
        cos + decay / rate * sin,
        sin / rate,
        -square / rate * sin,
        cos - decay / rate * sin,
    ];
    let want = row.map(|x| (-decay * time).exp() * x).repeat(ROWS - 1);
    let [whole, one] = [false, true].map(|one| linearised(&machine, &[], one));
    // The integrator is of first order: its error is half a step of the acceleration's derivative.
    assert!(largest_difference(&whole.a, &want) < 0.5 * DT * stiffness / mass);
    assert!(largest_difference(&whole.a, &one.a) < 1e-6);
    assert_eq!(whole.defect, one.defect);
    assert_eq!(whole.residual, one.residual);
}

/// Change of each row's end per unit of damping (N s/m), `rows x 2`.
///
/// The three results are from all steps of a row, from one step with new state derivatives, and
/// from one step with kept state derivatives.
fn columns_of_damping() -> [Vec<f64>; 3] {
    let machine = machine(&scene(0.0, 1.0));
    let logs = logs(&machine);
    let walks = [Walk::new(&logs, 0, DT)];
    let target = "joint/slide/damping".parse().unwrap();
    let damping = Parameter {
        name: "damping".into(),
        targets: vec![target],
        range: [0.0, 10.0],
        scale: Scale::Linear,
        unit: "N s/m".into(),
    };
    let mut map = StepMap::new(&machine, &[], &[damping], (&logs, &walks), 4).unwrap();
    let step = 1e-3;
    let varied = [Variation {
        theta: vec![SLIDE[2] + step],
        scale: step,
    }];
    let (theta, states) = ([SLIDE[2]], [states()]);
    let fresh = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let whole = map.linearise(&theta, &states, fresh, &[], &varied).unwrap();
    map.by_one_step(true);
    let one = map.linearise(&theta, &states, fresh, &[], &varied).unwrap();
    let carried = [one[0].carried.clone()];
    let anew = Anew {
        state: &[false],
        carried: &carried,
        ..Anew::default()
    };
    let kept = (Derivatives::default(), anew);
    let before = map.steps();
    let again = map
        .linearise_anew(&theta, &states, kept, &[], &varied)
        .unwrap();
    // All steps of the unperturbed model, and one step per row of the other.
    let steps = (ROWS - 1) * (STEPS + 1);
    assert_eq!(map.steps() - before, steps as u64);
    [whole, one, again].map(|mut found| found.remove(0).state_columns)
}

#[test]
fn what_a_value_changes_in_one_step_is_carried_over_the_row() {
    let [whole, one, again] = columns_of_damping();
    // Damping decelerates by v / m, and the motion turns by 2 rad/s. Over a row of 0.02 s this
    // holds to second order in 0.04.
    let largest = whole.iter().copied().map(f64::abs).fold(0.0, f64::max);
    assert!((largest / (0.3 / SLIDE[0] * STEPS as f64 * DT) - 1.0).abs() < 0.1);
    assert!(largest_difference(&whole, &one) < 0.002 * largest);
    assert_eq!(one, again);
}

#[test]
fn what_acts_on_readings_alone_is_read_and_not_stepped() {
    let machine = machine(&scene(0.0, 1.0));
    let logs = logs(&machine);
    let bias: EffectSpec = "sensor-bias@x:bias=0".parse().unwrap();
    let parameter = Parameter {
        name: "bias".into(),
        targets: vec!["effect/sensor-bias@x/bias".parse().unwrap()],
        range: [-1.0, 1.0],
        scale: Scale::Linear,
        unit: "m".into(),
    };
    // Along the rows, and as a segment that is replayed.
    for segment in [None, Some(0)] {
        let walks = [Walk {
            segment,
            ..Walk::new(&logs, 0, DT)
        }];
        let (specs, parameters) = ([bias.clone()], [parameter.clone()]);
        let mut map = StepMap::new(&machine, &specs, &parameters, (&logs, &walks), 4).unwrap();
        let varied = [Variation {
            theta: vec![0.01],
            scale: 0.01,
        }];
        let want = Derivatives::default();
        let found = map
            .linearise(&[0.0], &[states()], want, &[], &varied)
            .unwrap();
        // A segment is replayed once more for its residuals.
        let replays = if segment.is_some() { 2 } else { 1 };
        assert_eq!(map.steps(), (replays * (ROWS - 1) * STEPS) as u64);
        assert!(largest_difference(&found[0].reading_columns, &[1.0; ROWS]) < 1e-12);
        assert!(found[0].state_columns.iter().all(|x| *x == 0.0));
    }
}

/// Whether one physics step gives the derivatives of a row, for a machine with some effects.
fn tells(machine: &Machine, specs: &[EffectSpec]) -> bool {
    let logs = logs(machine);
    let walks = vec![Walk::new(&logs, 0, DT)];
    let taken = Taken {
        touching: Vec::new(),
        states: from_readings(&machine.plant, &logs, &walks, &[vec![0.0; 2 * ROWS]]),
        walks,
        given: vec![None],
        open: Vec::new(),
        scale: vec![0.1, 0.5],
    };
    let (context, _) = begin(machine, &logs, taken, (&[], &[])).unwrap();
    one_step_tells(&context, (specs, &[]), (&[], &[states()])).unwrap()
}

#[test]
fn friction_is_told_by_one_step_while_it_slides_and_not_where_it_stops_within_a_row() {
    let machine = machine(&scene(0.0, 1.0));
    let tells = |force: f64| {
        let friction = format!("coulomb-friction@slide:force={force}");
        tells(&machine, &[friction.parse().unwrap()])
    };
    // 20 N stop a slide of 2 kg with 0.3 m/s within 0.03 s, and rows are 0.02 s long.
    assert!(tells(0.02));
    assert!(!tells(20.0));
}

#[test]
fn a_reading_that_drifts_has_the_slopes_of_one_that_does_not() {
    let machine = machine(&scene(0.0, 1.0));
    let drift: EffectSpec = "sensor-drift@x:rate=0.5".parse().unwrap();
    let plain = linearised(&machine, &[], true);
    for one in [false, true] {
        let drifting = linearised(&machine, std::slice::from_ref(&drift), one);
        assert!(largest_difference(&drifting.h, &plain.h) < 1e-6);
        // The drift of 0.5 times the time of each row is subtracted from the residual.
        let time = |k: usize| (k * STEPS) as f64 * DT;
        let pairs = plain.residual.iter().zip(&drifting.residual).enumerate();
        for (k, (plain, drifting)) in pairs {
            assert!((plain - drifting - 0.5 * time(k)).abs() < 1e-12, "{k}");
        }
    }
}

#[test]
fn what_a_sensor_remembers_is_of_the_time_that_passes_and_takes_no_steps() {
    let machine = machine(&scene(0.0, 1.0));
    let late: EffectSpec = "sensor-delay@x:delay=0.005".parse().unwrap();
    let found = linearised(&machine, &[late], false);
    let nx = 2;
    for row in found.h.chunks_exact(nx).skip(2) {
        // A delay of 5 ms, less than half a row: the delayed position is the present one minus 5 ms
        // of the speed.
        assert!((row[0] - 1.0).abs() < 1e-6, "{row:?}");
        assert!((row[1] + 0.005).abs() < 1e-6, "{row:?}");
    }
}

#[test]
fn a_soft_machine_is_told_by_one_step_and_one_that_settles_within_a_row_is_not() {
    let tells = |kp: f64, force: f64| tells(&machine(&scene(kp, force)), &[]);
    assert!(tells(50.0, 100.0));
    // The servo has 300 rad/s, and is far from its target at full force.
    assert!(!tells(2e5, 100.0));
}

/// Linearises two segments; returns the result and its physics steps.
///
/// The first segment is `blind` to some coordinates of its initial state.
fn segments(blind: &[Vec<bool>]) -> (Vec<LinearEpisode>, u64) {
    let machine = machine(&scene(0.0, 1.0));
    let logs = logs(&machine);
    let segment = Walk {
        segment: Some(2),
        ..Walk::new(&logs, 0, DT)
    };
    let walks = [segment.clone(), segment];
    let mut map = StepMap::new(&machine, &[], &[], (&logs, &walks), 3).unwrap();
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let anew = Anew {
        blind,
        ..Anew::default()
    };
    let states = [states(), states()];
    let found = map
        .linearise_anew(&[], &states, (want, anew), &[1e-4; 2], &[])
        .unwrap();
    (found, map.steps())
}

#[test]
fn a_coordinate_that_a_segment_is_blind_to_takes_no_simulation_and_others_stay() {
    let (whole, steps) = segments(&[]);
    let (some, fewer) = segments(&[vec![false, true], Vec::new()]);
    assert_eq!(whole[1].h, some[1].h);
    assert_eq!(whole[0].defect, some[0].defect);
    for (whole, some) in whole[0].h.chunks(2).zip(some[0].h.chunks(2)) {
        assert_eq!([whole[0], 0.0], some[..]);
    }
    // The position depends on its initial value by cos(w t), so the readings show it.
    assert!(whole[0].h[2 * 2] > 0.9);
    assert_eq!(steps - fewer, ((ROWS - 1) * STEPS) as u64);
}
