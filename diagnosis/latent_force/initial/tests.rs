//! First trajectories of motions that are known.

use asid_core::episode::ChannelColumns;
use asid_core::{Episode, Scene};
use nalgebra::UnitQuaternion;

use super::*;

/// A slide whose position is read, one whose speed is read too, one that no sensor reads, and a
/// free body.
const SCENE: &str = r#"<mujoco><option timestep="0.01"/><worldbody>
    <body><joint name="a" type="slide"/><geom size="0.1" mass="1"/></body>
    <body><joint name="b" type="slide"/><geom size="0.1" mass="1"/></body>
    <body><joint name="c" type="slide"/><geom size="0.1" mass="1"/></body>
    <body name="free"><freejoint name="free"/><geom size="0.1" mass="1"/></body></worldbody>
    <sensor><framequat name="turn" objtype="body" objname="free"/>
    <jointpos name="a" joint="a"/><jointpos name="b" joint="b"/><jointvel name="vb" joint="b"/>
    <framepos name="at" objtype="body" objname="free"/></sensor></mujoco>"#;

/// Width of a state, and index of its first speed.
const WIDTH: usize = 19;
const SPEEDS: usize = 10;
/// Rows of a log, and time between them, s.
const ROWS: usize = 9;
const DT: f64 = 0.02;

/// A pendulum on a ball joint, and a free body whose speeds are read before its orientation.
const TURNING: &str = r#"<mujoco><option timestep="0.01"/><worldbody>
    <body><joint name="pivot" type="ball"/><geom size="0.1" pos="0 0 -0.3" mass="1"/></body>
    <body name="free"><freejoint name="free"/><geom size="0.1" mass="1"/></body></worldbody>
    <sensor><ballquat name="pivot" joint="pivot"/><ballangvel name="rate" joint="pivot"/>
    <frameangvel name="spin" objtype="xbody" objname="free"/>
    <framelinvel name="speed" objtype="xbody" objname="free"/>
    <framequat name="turn" objtype="xbody" objname="free"/>
    <framepos name="at" objtype="xbody" objname="free"/></sensor></mujoco>"#;

fn plant_of(scene: &str) -> Plant {
    Plant::of(&Scene::from_xml("scene", scene, &[]).unwrap()).unwrap()
}

fn plant() -> Plant {
    plant_of(SCENE)
}

/// Returns a log of some sensors, from a function of sensor and row.
fn logs(plant: &Plant, sensors: &[&str], reading: impl Fn(&str, usize) -> Vec<f64>) -> Logs {
    let names: Vec<String> = sensors.iter().map(|s| (*s).to_owned()).collect();
    let channels = names.iter().map(|name| ChannelColumns {
        name: name.clone(),
        len: reading(name, 0).len(),
    });
    let rows = (0..ROWS).flat_map(|k| sensors.iter().map(move |s| (s, k)));
    let episode = Episode {
        time: (0..ROWS).map(|k| DT * k as f64).collect(),
        channels: channels.collect(),
        readings: rows.flat_map(|(s, k)| reading(s, k)).collect(),
        ..Episode::default()
    };
    Logs::new(plant, &names, vec![("log".into(), episode)]).unwrap()
}

/// Returns the first states of such a log; coordinates that no sensor reads are 7.
fn states_of(plant: &Plant, logs: &Logs) -> Vec<Vec<f64>> {
    let width = plant.layout.nq + plant.layout.nv;
    let walk = Walk::new(logs, 0, plant.layout.timestep);
    let otherwise = vec![vec![7.0; ROWS * width]];
    let found = from_readings(plant, logs, &[walk], &otherwise);
    found[0].chunks_exact(width).map(<[f64]>::to_vec).collect()
}

/// The same for the first scene.
fn states(sensors: &[&str], reading: impl Fn(&str, usize) -> Vec<f64>) -> Vec<Vec<f64>> {
    let plant = plant();
    states_of(&plant, &logs(&plant, sensors, reading))
}

/// Orientation of a body that begins on its side and turns at a steady speed about its own axes.
fn turning(spin: Vector3<f64>, k: usize) -> UnitQuaternion<f64> {
    let side = UnitQuaternion::from_euler_angles(1.2, 0.3, -0.4);
    side * UnitQuaternion::from_scaled_axis(spin * (DT * k as f64))
}

fn wxyz(q: UnitQuaternion<f64>, sign: f64) -> Vec<f64> {
    vec![sign * q.w, sign * q.i, sign * q.j, sign * q.k]
}

fn assert_near(got: &[f64], want: &[f64], tolerance: f64) {
    assert_eq!(got.len(), want.len());
    let same = got.iter().zip(want).all(|(a, b)| (a - b).abs() < tolerance);
    assert!(same, "{got:?} instead of {want:?}");
}

#[test]
fn gaps_are_filled_linearly_in_time_and_ends_are_held() {
    let time = [0.0, 1.0, 2.0, 4.0, 5.0, 6.0];
    let mut values = [f64::NAN, 1.0, f64::NAN, f64::NAN, 5.0, f64::NAN];
    assert!(fill(&time, &mut values));
    assert_near(&values, &[1.0, 1.0, 2.0, 4.0, 5.0, 5.0], 1e-12);
    assert!(!fill(&time, &mut [f64::NAN; 6]));
}

#[test]
fn speeds_are_differences_of_places_where_no_sensor_reads_them() {
    let acceleration = 3.0;
    let found = states(&["a", "b", "vb", "at"], |sensor, k| {
        let t = DT * k as f64;
        match sensor {
            "a" => vec![0.5 * acceleration * t * t],
            "b" => vec![t],
            "vb" => vec![-4.0],
            _ => vec![t, 2.0 * t, 0.5 * acceleration * t * t],
        }
    });
    for (k, state) in found.iter().enumerate() {
        let t = DT * k as f64;
        let fall = 0.5 * acceleration * t * t;
        // No sensor reads the third slide, nor the orientation.
        assert_near(&state[..7], &[fall, t, 7.0, t, 2.0 * t, fall, 7.0], 1e-12);
        assert_near(&state[SPEEDS + 1..SPEEDS + 5], &[-4.0, 7.0, 1.0, 2.0], 1e-9);
        assert_near(&state[SPEEDS + 6..], &[7.0; 3], 1e-12);
        // The speed in the middle of the rows over which it is taken.
        let (from, to) = (
            k.saturating_sub(HALF_WINDOW),
            (k + HALF_WINDOW).min(ROWS - 1),
        );
        let middle = 0.5 * DT * (from + to) as f64;
        assert_near(
            &[state[SPEEDS], state[SPEEDS + 5]],
            &[acceleration * middle; 2],
            1e-9,
        );
    }
}

#[test]
fn a_sensor_without_a_reading_is_as_good_as_none() {
    let found = states(&["a", "b"], |sensor, k| {
        vec![if sensor == "a" { f64::NAN } else { k as f64 }]
    });
    for (k, state) in found.iter().enumerate() {
        assert_near(&[state[0], state[SPEEDS]], &[7.0; 2], 1e-12);
        assert_near(&[state[1], state[SPEEDS + 1]], &[k as f64, 1.0 / DT], 1e-9);
    }
}

#[test]
fn the_spin_of_a_body_is_about_its_own_axes_whatever_the_signs_of_its_quaternions() {
    let spin = Vector3::new(2.0, -5.0, 9.0);
    let found = states(&["turn"], |_, k| {
        wxyz(turning(spin, k), if k % 3 == 0 { -1.0 } else { 1.0 })
    });
    for (k, state) in found.iter().enumerate() {
        let turn = unit_quaternion(&state[6..10]).angle_to(&turning(spin, k));
        assert!(turn < 1e-7, "row {k}: {turn}");
        assert_near(&state[SPEEDS + 6..], spin.as_slice(), 1e-9);
    }
}

/// Symptom: a pendulum on a ball joint, whose encoder reads 60 degrees, was smoothed from where the
/// document places it.
///
/// Cause: its sensor counted as reading no joint. So it seemed never to move, and its initial state
/// could not either.
#[test]
fn a_ball_joint_is_where_its_sensors_read_it() {
    let plant = plant_of(TURNING);
    let own = Vector3::new(0.3, -0.8, 2.0);
    let reading = |sensor: &str, k: usize| match sensor {
        "pivot" => wxyz(
            turning(own, k),
            if k.is_multiple_of(2) { -1.0 } else { 1.0 },
        ),
        _ => vec![1.0, 2.0, 3.0],
    };
    // Speeds begin behind the quaternion of the pendulum and the position of the free body.
    let of_pivot = 11..14;
    let all = logs(&plant, &["pivot"], reading);
    for (k, state) in states_of(&plant, &all).iter().enumerate() {
        let turn = unit_quaternion(&state[..4]).angle_to(&turning(own, k));
        assert!(turn < 1e-7, "row {k}: {turn}");
        assert_near(&state[of_pivot.clone()], own.as_slice(), 1e-9);
    }
    // A measured speed is better than a difference.
    let measured = logs(&plant, &["pivot", "rate"], reading);
    for state in states_of(&plant, &measured) {
        assert_near(&state[of_pivot.clone()], &[1.0, 2.0, 3.0], 1e-12);
    }
    let noise = position_noise(&plant, &all);
    assert!(noise[..3].iter().all(|n| *n > 0.0));
    assert!(noise[3..].iter().all(|n| *n == 0.0));
    let entries = position_entries(&plant, &all);
    assert_eq!(entries[..4], [Some(0), Some(1), Some(2), None]);
}

/// Symptom: the spin of a free body that a sensor reads was certain to be zero. Cause: speeds were
/// read of joints alone.
#[test]
fn a_free_body_has_the_speeds_that_its_sensors_read() {
    let plant = plant_of(TURNING);
    let side = turning(Vector3::zeros(), 0);
    let spin = Vector3::new(2.0, -5.0, 9.0);
    let reading = |sensor: &str, k: usize| match sensor {
        // About the axes of the world.
        "spin" => (side * spin).as_slice().to_vec(),
        "speed" => vec![-1.0, 0.5, 4.0],
        "turn" => wxyz(side, 1.0),
        _ => vec![DT * k as f64; 3],
    };
    let all = logs(&plant, &["spin", "speed", "turn", "at"], reading);
    for state in states_of(&plant, &all) {
        assert_near(&state[14..17], &[-1.0, 0.5, 4.0], 1e-12);
        assert_near(&state[17..20], spin.as_slice(), 1e-9);
    }
    // Without an orientation the body stands as the other states say: q = (7, 7, 7, 7) turns the
    // axes x, y, z into y, z, x.
    let alone = logs(&plant, &["spin"], |_, _| vec![1.0, 2.0, 3.0]);
    for state in states_of(&plant, &alone) {
        assert_near(&state[17..20], &[2.0, 3.0, 1.0], 1e-12);
    }
    let scale = scales(&plant, &[states_of(&plant, &all).concat()]);
    assert_near(&scale[15..18], &[2.0, 5.0, 9.0], 1e-9);
}

#[test]
fn an_orientation_is_filled_across_a_change_of_sign() {
    // The midpoint of q and -q, which are the same orientation, is not an orientation.
    let spin = Vector3::new(0.0, 0.0, 0.5);
    let found = states(&["turn"], |_, k| match k {
        0..4 => wxyz(turning(spin, k), 1.0),
        4 => vec![f64::NAN; 4],
        _ => wxyz(turning(spin, k), -1.0),
    });
    for (k, state) in found.iter().enumerate() {
        // The middle of the chord is that of the arc.
        let turn = unit_quaternion(&state[6..10]).angle_to(&turning(spin, k));
        assert!(turn < 1e-7, "row {k}: {turn}");
        assert_near(&state[SPEEDS + 6..], spin.as_slice(), 1e-9);
    }
}

#[test]
fn scales_are_the_largest_moves_from_the_first_row_and_the_largest_speeds() {
    let plant = plant();
    let mut rows = vec![vec![0.0; WIDTH]; 3];
    for (k, row) in rows.iter_mut().enumerate() {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.1 * k as f64, 0.0));
        row[6..10].copy_from_slice(&wxyz(turn, 1.0));
    }
    (rows[0][0], rows[1][0], rows[2][0]) = (10.0, 12.0, 9.0);
    (rows[0][SPEEDS], rows[1][SPEEDS], rows[2][SPEEDS]) = (0.5, -3.0, 1.0);
    let scale = scales(&plant, &[rows.concat()]);
    assert_near(&[scale[0], scale[7], scale[9]], &[2.0, 0.2, 3.0], 1e-12);
    // A coordinate that does not move still has a scale.
    assert!(scale.iter().all(|s| *s > 0.0));
}

#[test]
fn a_start_that_the_log_gives_beats_its_readings() {
    let plant = plant();
    let mut first = vec![0.0; WIDTH];
    first[6] = 1.0;
    first[0] = 0.3;
    let mut state = State {
        qpos: first[..SPEEDS].to_vec(),
        qvel: first[SPEEDS..].to_vec(),
    };
    (state.qpos[0], state.qpos[1], state.qvel[0]) = (0.1, 5.0, 4.0);
    let scale: Vec<f64> = (1..=18).map(f64::from).collect();
    let mut noise = vec![0.0; 9];
    noise[2] = 1.0;
    // The second slide's position is left open.
    let given = start(&plant, Some((&state, &[1])), &first, (&scale, &noise));
    assert_near(&given.mean[..2], &[-0.2, 0.0], 1e-12);
    assert_near(&given.mean[9..10], &[4.0], 1e-12);
    let deviation = |s: &Start, i: usize| s.variance[i].sqrt();
    for i in (0..18).filter(|i| *i != 1) {
        assert!((deviation(&given, i) - GIVEN * scale[i]).abs() < 1e-12);
    }
    assert!((deviation(&given, 1) - OPEN * scale[1]).abs() < 1e-12);
    // It says nothing of the state where a filter restarts.
    let open = start(&plant, None, &first, (&scale, &noise));
    assert_eq!(given.unknown, open.variance);
    // Without a given initial state all coordinates are open, a position by at least ten standard
    // deviations of its readings.
    let open = start(&plant, None, &first, (&scale, &noise));
    assert_near(&open.mean, &[0.0; 18], 1e-12);
    for i in (0..18).filter(|i| *i != 2) {
        assert!((deviation(&open, i) - OPEN * scale[i]).abs() < 1e-12);
    }
    assert!((deviation(&open, 2) - 10.0).abs() < 1e-12);
}
