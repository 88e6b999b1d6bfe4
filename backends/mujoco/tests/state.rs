//! States: exact snapshots, copies, resets, and readings without delay.

#![allow(clippy::unwrap_used)]

mod common;

use asid_core::{Control, Rollout};
use common::*;

#[test]
fn a_snapshot_goes_on_to_the_bit() {
    let model = load(ARM);
    let record = recording(&model, &CHANNELS);
    let mut simulator = batch(&model, 3, 1, &[]);
    roll(&mut simulator, 20, 5, &waves(20), &record);
    let snapshot = simulator.save(&[0, 1, 2]).unwrap();
    let first = roll(&mut simulator, 60, 5, &waves(60), &record);
    simulator.load(&snapshot, &[2, 1, 0], &[0, 1, 2]).unwrap();
    let again = roll(&mut simulator, 60, 5, &waves(60), &record);
    assert_eq!(bits(&first), bits(&again));

    // The same row in another batch of the same scene.
    let mut other = batch(&model, 1, 1, &[]);
    other.load(&snapshot, &[1], &[0]).unwrap();
    let alone = roll(&mut other, 60, 5, &waves(60), &record);
    assert_eq!(bits(&first[..alone.len()]), bits(&alone));
}

#[test]
fn reading_along_the_way_does_not_change_the_motion() {
    // A reading takes the first half of the next step early. The motion must equal that of an
    // unobserved run, to the bit, and one call must equal many.
    for xml in [
        ARM.to_owned(),
        delayed(),
        ARM.replace("impratio", "integrator=\"RK4\" impratio"),
    ] {
        reading_is_passive(&xml);
    }
}

/// [`ARM`] with delayed drives and sensors, whose buffers are part of the state.
fn delayed() -> String {
    ARM.replace(
        "<motor name=\"elbow\"",
        "<motor name=\"elbow\" delay=\"0.013\" nsample=\"10\"",
    )
    .replace(
        "<jointpos name=\"angle\"",
        "<jointpos name=\"angle\" delay=\"0.011\" nsample=\"10\"",
    )
    .replace(
        "<framelinacc name",
        "<framelinacc delay=\"0.004\" nsample=\"4\" name",
    )
}

fn reading_is_passive(xml: &str) {
    let model = load(xml);
    let state = recording(&model, &["qpos.shoulder", "qpos.elbow", "qpos.ball"]);
    let mut plain = batch(&model, 1, 1, &[]);
    roll(&mut plain, 50, 4, &waves(50), &state);
    for channels in [&CHANNELS[..1], &CHANNELS[2..4], &CHANNELS[..]] {
        let record = recording(&model, channels);
        let mut watched = batch(&model, 1, 1, &[]);
        let whole = roll(&mut watched, 50, 4, &waves(50), &record);
        let mut out = [vec![0.0; state.width()], vec![0.0; state.width()]];
        watched.read(&[0], &state, &mut out[0]).unwrap();
        plain.read(&[0], &state, &mut out[1]).unwrap();
        assert_eq!(bits(&out[0]), bits(&out[1]), "{channels:?}");

        let mut pieces = Vec::new();
        watched.reset(&[0]).unwrap();
        for command in waves(50).chunks(2) {
            pieces.extend(roll(&mut watched, 1, 4, command, &record));
        }
        assert_eq!(bits(&whole), bits(&pieces), "{channels:?}");
    }
}

#[test]
fn a_delayed_drive_acts_late() {
    // With a delay of 13 ms the elbow stays on its free path for 6 steps of 2 ms.
    let record = recording(&load(ARM), &["qvel.elbow"]);
    let run = |xml: &str, torque: f64| {
        let mut simulator = batch(&load(xml), 1, 1, &[]);
        let command = [0.1, 0.0].repeat(10);
        roll(&mut simulator, 10, 1, &command, &record);
        roll(&mut simulator, 10, 1, &[0.1, torque].repeat(10), &record)
    };
    let (free, driven) = (run(&delayed(), 0.0), run(&delayed(), 0.4));
    let first = free.iter().zip(&driven).position(|(a, b)| a != b);
    assert_eq!(first, Some(7), "{free:?} {driven:?}");
    let prompt = (run(ARM, 0.0), run(ARM, 0.4));
    assert!(prompt.0[0] != prompt.1[0]);
}

#[test]
fn results_do_not_depend_on_threads_or_company() {
    let model = load(ARM);
    let record = recording(&model, &CHANNELS);
    let target = ["geom/bob/mass", "geom/floor/friction/0"];
    let values: Vec<f64> = (0..7)
        .flat_map(|i| [0.2 + 0.05 * f64::from(i), 0.3 + 0.1 * f64::from(i)])
        .collect();
    let run = |threads| {
        let mut simulator = batch(&model, 7, threads, &target);
        simulator
            .set_parameters(&[0, 1, 2, 3, 4, 5, 6], &values)
            .unwrap();
        roll(&mut simulator, 80, 3, &waves(80), &record)
    };
    let one = run(1);
    assert_eq!(bits(&one), bits(&run(2)));
    assert_eq!(bits(&one), bits(&run(5)));
    let row = one.len() / 7;
    for sim in [0, 4] {
        let mut alone = batch(&model, 1, 1, &target);
        alone
            .set_parameters(&[0], &values[2 * sim..2 * sim + 2])
            .unwrap();
        let got = roll(&mut alone, 80, 3, &waves(80), &record);
        assert_eq!(bits(&got), bits(&one[sim * row..(sim + 1) * row]));
    }
}

#[test]
fn a_copied_state_keeps_the_parameters_of_its_place() {
    let model = load(ARM);
    let record = recording(&model, &["qpos.elbow"]);
    let mut simulator = batch(&model, 2, 1, &["geom/bob/mass"]);
    simulator.set_parameters(&[0, 1], &[0.3, 0.9]).unwrap();
    simulator.copy_state(&[0], &[1]).unwrap();
    let out = roll(&mut simulator, 30, 5, &waves(30), &record);
    // Same start, another payload: the elbows separate.
    assert!((out[29] - out[59]).abs() > 0.01, "{} {}", out[29], out[59]);

    // With the same payload they stay together.
    simulator.set_parameters(&[1], &[0.3]).unwrap();
    simulator.reset(&[0, 1]).unwrap();
    roll(&mut simulator, 5, 5, &waves(5), &record);
    simulator.copy_state(&[0], &[1]).unwrap();
    let out = roll(&mut simulator, 30, 5, &waves(30), &record);
    assert_eq!(out[29].to_bits(), out[59].to_bits());
}

#[test]
fn a_reading_is_of_the_end_of_its_frame() {
    // Semi-implicit Euler: after n steps of h, v = -g n h and z = z0 - g h^2 n (n + 1) / 2 exactly.
    // A late reading is off by |v| h.
    let model = load(FALLING);
    let record = recording(&model, &["place", "speed", "qpos.ball"]);
    let mut simulator = batch(&model, 1, 1, &[]);
    let out = roll(&mut simulator, 10, 4, &[], &record);
    let (g, h) = (9.81, 0.01);
    for (frame, row) in out.chunks_exact(13).enumerate() {
        let n = 4.0 * (frame as f64 + 1.0);
        let z = 2.0 - g * h * h * n * (n + 1.0) / 2.0;
        assert!((row[2] - z).abs() < 1e-12, "z {} of {z}", row[2]);
        assert!((row[5] + g * n * h).abs() < 1e-12, "vz {}", row[5]);
        assert_eq!(row[2].to_bits(), row[8].to_bits());
    }
    assert_eq!(simulator.steps_taken(), 40);
}

#[test]
fn reset_is_the_first_keyframe() {
    let model = load(ARM);
    let record = recording(
        &model,
        &["qpos.shoulder", "qpos.elbow", "qpos.ball", "qvel.ball"],
    );
    let key = &model.layout().keyframes[0];
    let mut simulator = batch(&model, 2, 1, &[]);
    roll(&mut simulator, 5, 5, &waves(5), &record);
    simulator.reset(&[1]).unwrap();
    let mut row = vec![0.0; record.width()];
    simulator.read(&[1], &record, &mut row).unwrap();
    assert_eq!(row[..9], key.qpos[..]);
    assert_eq!(row[9..], key.qvel[2..]);
    simulator.read(&[0], &record, &mut row).unwrap();
    assert_ne!(row[..9], key.qpos[..]);
}

#[test]
fn a_set_state_has_unit_quaternions_and_no_memory() {
    let model = load(ARM);
    let record = recording(&model, &CHANNELS);
    let mut simulator = batch(&model, 2, 1, &[]);
    // One of them has a history.
    let mut out = vec![0.0; 25 * record.width()];
    let control = waves(25);
    let rollout = Rollout::new(&[1], 25, 5, Control::Shared(&control), &record);
    simulator.rollout(&rollout, &mut out).unwrap();
    let qpos = [0.1, 0.2, 1.0, 0.0, 0.09, 2.0, 0.0, 0.0, 2.0];
    let qvel = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    simulator
        .set_state(&[0, 1], &qpos.repeat(2), &qvel.repeat(2))
        .unwrap();
    let quaternion = recording(&model, &["qpos.ball"]);
    let mut row = [0.0; 7];
    simulator.read(&[0], &quaternion, &mut row).unwrap();
    assert!((row[3] - 0.5f64.sqrt()).abs() < 1e-15 && (row[6] - 0.5f64.sqrt()).abs() < 1e-15);
    let out = roll(&mut simulator, 10, 5, &waves(10), &record);
    let (a, b) = out.split_at(out.len() / 2);
    assert_eq!(bits(a), bits(b));
}
