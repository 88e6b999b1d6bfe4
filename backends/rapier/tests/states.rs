//! States: exact snapshots, teleports without memory, threads, and failures
//! that stay with one simulation.

#![allow(clippy::unwrap_used)]

mod support;

use std::panic::{AssertUnwindSafe, catch_unwind};

use asid_core::simulator::{ExternalForce, StepHook, StepView};
use asid_core::{Control, Rollout, Status};
use support::{Bench, scene};

/// A jointed finger that pushes a box with rolling resistance into another one, under a weld. It
/// contains all kinds of state.
const BUSY: &str = r#"<option timestep="0.002"/>
  <worldbody>
    <geom type="plane" size="5 5 .1" condim="6" friction="0.4 0.01 0.002"/>
    <body name="base" pos="-0.3 0 0.1"><joint name="yaw" axis="0 0 1" damping="0.1"/>
      <geom type="capsule" fromto="0 0 0 0.15 0 0" size="0.02" mass="0.5"/>
      <body name="finger" pos="0.17 0 0"><joint name="reach" type="slide" axis="1 0 0" range="-0.1 0.2" frictionloss="0.1"/>
        <geom type="box" size="0.02 0.04 0.06" mass="0.2"/></body></body>
    <body name="crate" pos="0 0 0.05"><freejoint name="crate"/><geom name="crate" type="box" size=".05 .05 .05" mass=".4"/></body>
    <body name="ball" pos="0.12 0.01 0.04"><freejoint name="ball"/><geom name="ball" type="sphere" size=".04" mass=".3"/></body>
    <body name="twin" pos="0.3 0 0.05"><freejoint name="twin"/><geom type="box" size=".05 .05 .05" mass=".2"/></body>
    <body name="rider" pos="0.3 0 0.15"><freejoint name="rider"/><geom type="box" size=".05 .05 .05" mass=".2"/></body>
  </worldbody>
  <equality><weld body1="twin" body2="rider"/></equality>
  <actuator><position joint="reach" kp="400" kv="40" forcerange="-20 20"/><position joint="yaw" kp="100" kv="10"/></actuator>"#;

const CHANNELS: [&str; 8] = [
    "qpos.yaw",
    "qpos.reach",
    "qpos.crate",
    "qvel.crate",
    "qpos.ball",
    "qvel.ball",
    "qpos.rider",
    "contact.finger/crate",
];

const PUSH: [f64; 2] = [0.2, 0.1];

fn busy(size: usize, threads: usize, targets: &[&str]) -> Bench {
    Bench::with(&scene(BUSY), &CHANNELS, size, threads, targets)
}

fn bits(rows: &[Vec<f64>]) -> Vec<u64> {
    rows.iter().flatten().map(|x| x.to_bits()).collect()
}

#[test]
fn the_scene_is_busy() {
    let rows = busy(1, 1, &[]).run(400, &PUSH);
    assert!(
        rows.iter().any(|r| *r.last().unwrap() > 0.5),
        "the finger touches nothing"
    );
    assert!(rows[399][2] > 0.02, "the crate stays");
    assert!(rows[399][15] > 0.14, "the ball stays");
}

#[test]
fn a_loaded_state_goes_on_to_the_bit() {
    let mut bench = busy(3, 1, &[]);
    bench.run(150, &PUSH);
    let saved = bench.simulator.save(&[0]).unwrap();
    let before = bench.read();
    let on = bench.run(200, &PUSH);
    assert_eq!(bits(&on[..200]), bits(&on[200..400]));
    // Into a simulation with another history, and back into the same one.
    bench.simulator.reset(&[1]).unwrap();
    bench
        .simulator
        .load(&saved, &[0, 0, 0], &[0, 1, 2])
        .unwrap();
    assert_eq!(bench.read(), before);
    let again = bench.run(200, &PUSH);
    for sim in 0..3 {
        assert_eq!(
            bits(&on[..200]),
            bits(&again[sim * 200..][..200]),
            "simulation {sim}"
        );
    }
}

#[test]
fn a_copied_state_goes_on_to_the_bit() {
    let mut bench = busy(2, 1, &[]);
    bench.run(100, &PUSH);
    bench
        .simulator
        .set_state(&[1], &[0.1; 30], &[0.0; 26])
        .unwrap();
    bench.run(5, &PUSH);
    bench.simulator.copy_state(&[0], &[1]).unwrap();
    let rows = bench.run(200, &PUSH);
    assert_eq!(bits(&rows[..200]), bits(&rows[200..]));
}

#[test]
fn a_loaded_state_takes_its_own_parameters() {
    let targets = [
        "geom/crate/mass",
        "geom/ball/friction/0",
        "joint/reach/damping",
    ];
    let mut bench = busy(2, 1, &targets);
    let own = [0.4, 1.0, 0.0, 0.8, 0.1, 5.0];
    bench.simulator.set_parameters(&[0, 1], &own).unwrap();
    bench.run(100, &PUSH);
    let saved = bench.simulator.save(&[0]).unwrap();
    bench.simulator.load(&saved, &[0, 0], &[0, 1]).unwrap();
    let apart = bench.run(200, &PUSH);
    assert_ne!(bits(&apart[..200]), bits(&apart[200..]));
    // The result equals that of setting parameters after loading.
    bench
        .simulator
        .set_parameters(&[0, 1], &[0.4, 1.0, 0.0, 0.4, 1.0, 0.0])
        .unwrap();
    bench.simulator.load(&saved, &[0, 0], &[0, 1]).unwrap();
    bench.simulator.set_parameters(&[0, 1], &own).unwrap();
    assert_eq!(bits(&bench.run(200, &PUSH)), bits(&apart));
}

#[test]
fn a_set_state_has_no_memory() {
    let mut bench = busy(2, 1, &[]);
    let layout = bench.simulator.layout().clone();
    let start = busy(1, 1, &[]).simulator.layout().clone();
    assert_eq!(layout, start);
    let joints: Vec<String> = layout
        .joints
        .iter()
        .map(|j| format!("qpos.{}", j.name))
        .collect();
    let record = layout.recording(&joints).unwrap();
    let mut qpos = vec![0.0; record.width()];
    bench.simulator.read(&[0], &record, &mut qpos).unwrap();
    let qvel: Vec<f64> = (0..layout.nv).map(|i| 0.02 * i as f64).collect();
    // Two histories, one state, one future.
    bench.run(130, &PUSH);
    bench.simulator.reset(&[1]).unwrap();
    let both = [qpos.clone(), qpos].concat();
    bench
        .simulator
        .set_state(&[0, 1], &both, &[qvel.clone(), qvel].concat())
        .unwrap();
    let rows = bench.run(200, &PUSH);
    assert_eq!(bits(&rows[..200]), bits(&rows[200..]));
}

#[test]
fn results_do_not_depend_on_threads_or_on_neighbours() {
    let run = |size, threads| {
        let mut bench = busy(size, threads, &["geom/crate/friction/0"]);
        let values: Vec<f64> = (0..size).map(|i| 0.4 + 0.1 * i as f64).collect();
        let all = bench.all();
        bench.simulator.set_parameters(&all, &values).unwrap();
        bench.run(150, &PUSH)
    };
    let one = bits(&run(8, 1));
    assert_eq!(one, bits(&run(8, 3)));
    assert_eq!(one, bits(&run(8, 0)));
    let fewer = bits(&run(2, 1));
    assert_eq!(one[..fewer.len()], fewer[..]);
}

#[test]
fn coordinates_read_back_as_set() {
    let mut bench = busy(1, 1, &[]);
    let layout = bench.simulator.layout().clone();
    let names: Vec<String> = layout
        .joints
        .iter()
        .map(|j| format!("qpos.{}", j.name))
        .chain(layout.joints.iter().map(|j| format!("qvel.{}", j.name)))
        .collect();
    let record = layout.recording(&names).unwrap();
    let mut qpos: Vec<f64> = (0..layout.nq).map(|i| 0.1 * i as f64).collect();
    for joint in layout.joints.iter().filter(|j| j.kind.qpos_len() == 7) {
        qpos[joint.qpos + 3..joint.qpos + 7].copy_from_slice(&[0.8, 0.0, 0.6, 0.0]);
    }
    let qvel: Vec<f64> = (0..layout.nv).map(|i| 0.3 - 0.05 * i as f64).collect();
    bench.place(&qpos, &qvel);
    let mut out = vec![0.0; record.width()];
    bench.simulator.read(&[0], &record, &mut out).unwrap();
    for (set, read) in qpos.iter().chain(&qvel).zip(&out) {
        assert!((set - read).abs() < 1e-6, "{set} reads {read}");
    }
}

#[test]
fn a_simulation_that_diverges_stops_alone() {
    let mut bench = busy(3, 2, &[]);
    let layout = bench.simulator.layout().clone();
    let record = layout.recording(&CHANNELS).unwrap();
    let wrench: Vec<f64> = (0..3 * 50)
        .flat_map(|i| {
            if i / 50 == 1 {
                [1e30, 0., 0., 0., 1e30, 0.]
            } else {
                [0.0; 6]
            }
        })
        .collect();
    let forces = [ExternalForce {
        body: layout.body("crate").unwrap(),
        wrench: &wrench,
    }];
    let ctrl: Vec<f64> = PUSH.iter().copied().cycle().take(100).collect();
    let mut out = vec![0.0; 3 * 50 * record.width()];
    let mut rollout = Rollout::new(&[0, 1, 2], 50, 1, Control::Shared(&ctrl), &record);
    rollout.forces = &forces;
    bench.simulator.rollout(&rollout, &mut out).unwrap();
    let status = bench.simulator.status();
    assert!(status[0].is_running() && status[2].is_running());
    assert!(
        matches!(status[1], Status::Diverged { .. }),
        "{:?}",
        status[1]
    );
    let rows: Vec<_> = out.chunks(50 * record.width()).collect();
    // Finite, then not a number to the end.
    let first = rows[1].iter().position(|x| x.is_nan()).unwrap();
    assert_eq!(first % record.width(), 0);
    assert!(first < rows[1].len() / 2 && rows[1][first..].iter().all(|x| x.is_nan()));
    assert_eq!(rows[0], rows[2]);
    assert_eq!(rows[0], busy(1, 1, &[]).run(50, &PUSH).concat());
    // A reset restores it.
    bench.simulator.reset(&[1]).unwrap();
    assert!(bench.simulator.status()[1].is_running());
    assert_eq!(bench.run(50, &PUSH)[50..100].concat(), rows[0]);
}

/// Symptom: a simulation that had diverged went on where its state was set, which it does on no
/// other engine. Cause: every state that is set began as a running one.
#[test]
fn a_diverged_simulation_that_is_placed_stands_still() {
    let inside =
        r#"<worldbody><body name="b"><freejoint name="b"/><geom size=".1"/></body></worldbody>"#;
    let mut bench = Bench::new(inside, &["qpos.b"]);
    let place = |z: f64| [0.0, 0.0, z, 1.0, 0.0, 0.0, 0.0];
    // Farther than a simulation may be.
    bench.place(&place(1e5), &[0.0; 6]);
    assert!(bench.run(1, &[])[0][0].is_nan());
    bench.place(&place(1.0), &[0.0; 6]);
    assert!(!bench.simulator.status()[0].is_running());
    assert!(bench.read()[0].is_nan() && bench.run(1, &[])[0][0].is_nan());
    bench.simulator.reset(&[0]).unwrap();
    bench.place(&place(1.0), &[0.0; 6]);
    assert!((bench.run(1, &[])[0][2] - 1.0).abs() < 1e-3);
}

/// A hook that fails in its third step.
struct Fails;

impl StepHook for Fails {
    fn before_step(&self, _row: usize, step: usize, _view: &mut StepView<'_>) {
        assert!(step < 2, "no force");
    }
}

/// Symptom: an effect of a plugin that failed looked like a simulation that diverged. Cause: a panic
/// of the hook was taken for one of the engine.
#[test]
fn a_hook_that_panics_is_no_divergence() {
    let mut bench = busy(1, 1, &[]);
    let record = bench.simulator.layout().recording(&CHANNELS).unwrap();
    let mut out = vec![0.0; 5 * record.width()];
    let ctrl = PUSH.repeat(5);
    let mut rollout = Rollout::new(&[0], 5, 1, Control::Shared(&ctrl), &record);
    rollout.hook = Some(&Fails);
    let rolled = catch_unwind(AssertUnwindSafe(|| {
        bench.simulator.rollout(&rollout, &mut out)
    }));
    let said = rolled.unwrap_err();
    assert_eq!(said.downcast_ref::<&str>(), Some(&"no force"));
    assert!(bench.simulator.status()[0].is_running());
    assert!(bench.run(1, &PUSH)[0].iter().all(|x| x.is_finite()));
}

struct Push;

impl StepHook for Push {
    fn before_step(&self, _row: usize, _step: usize, view: &mut StepView<'_>) {
        // The crate's joint: force along x, torque about the body's z.
        view.force[2] = 0.8;
        view.force[7] = 0.001;
        view.ctrl[0] = -0.1;
    }
}

#[test]
fn hooks_and_external_forces_push_alike() {
    let inside = r#"<option gravity="0 0 0"/><worldbody>
      <body><joint name="yaw" axis="0 0 1"/><geom type="sphere" size=".1" mass="1"/>
      <body><joint name="reach" type="slide" axis="1 0 0"/><geom type="sphere" size=".1" mass="1"/></body></body>
      <body name="crate" pos="2 0 0"><freejoint name="crate"/><geom type="box" size=".05 .05 .05" mass=".4"/></body></worldbody>
      <actuator><motor joint="reach"/></actuator>"#;
    let mut bench = Bench::new(inside, &["qvel.crate"]);
    let layout = bench.simulator.layout().clone();
    let record = layout.recording(&["qvel.crate", "qvel.reach"]).unwrap();
    let mut out = vec![0.0; 100 * 7];
    let mut rollout = Rollout::new(&[0], 100, 5, Control::Shared(&[0.0; 100]), &record);
    rollout.hook = Some(&Push);
    bench.simulator.rollout(&rollout, &mut out).unwrap();
    let inertia = 0.4 * 0.02 / 12.0;
    // One second of constant force and torque; the changed command acts as well.
    assert!((out[693] - 2.0).abs() < 1e-3, "{}", out[693]);
    assert!(
        (out[698] / (0.001 / inertia) - 1.0).abs() < 1e-3,
        "{}",
        out[698]
    );
    assert!((out[699] + 0.1).abs() < 1e-3, "{}", out[699]);

    bench.simulator.reset(&[0]).unwrap();
    let wrench: Vec<f64> = [0.8, 0., 0., 0., 0., 0.001]
        .iter()
        .copied()
        .cycle()
        .take(600)
        .collect();
    let forces = [ExternalForce {
        body: layout.body("crate").unwrap(),
        wrench: &wrench,
    }];
    let mut pushed = vec![0.0; 100 * 7];
    let mut rollout = Rollout::new(&[0], 100, 5, Control::Shared(&[0.0; 100]), &record);
    rollout.forces = &forces;
    bench.simulator.rollout(&rollout, &mut pushed).unwrap();
    for (i, (a, b)) in out
        .iter()
        .zip(&pushed)
        .enumerate()
        .filter(|(i, _)| i % 7 != 6)
    {
        assert!((a - b).abs() < 1e-4, "entry {i}: {a} against {b}");
    }
    assert_eq!(bench.simulator.steps_taken(), 1000);
}

/// Symptom: a state that was set had contact forces of zero, wherever its bodies lay. Cause: rapier
/// finds contacts in a step, and none had been taken.
#[test]
fn a_state_that_was_set_has_its_contact_forces() {
    let inside = r#"<worldbody><geom type="plane" size="1 1 .1"/>
      <body name="b" pos="0 0 .05"><freejoint name="b"/>
        <geom type="box" size=".05 .05 .05" mass="2"/></body></worldbody>"#;
    let mut bench = Bench::new(inside, &["contact.world/b", "qpos.b", "qvel.b"]);
    let rested = bench.run(500, &[]).pop().unwrap();
    bench.place(&rested[1..8], &[0.0; 6]);
    let first = bench.read();
    let weight = 2.0 * 9.81;
    assert!((first[0] / weight - 1.0).abs() < 0.5, "{}", first[0]);
    // Reading takes no step.
    assert_eq!(bench.read(), first);
    assert_eq!(bench.simulator.steps_taken(), 500);
    let saved = bench.simulator.save(&[0]).unwrap();
    let lifted = [0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0];
    bench.place(&lifted, &[0.0; 6]);
    assert_eq!(bench.read()[0], 0.0);
    bench.simulator.load(&saved, &[0], &[0]).unwrap();
    assert_eq!(bench.read(), first);
}
