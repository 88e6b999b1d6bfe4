//! A ball that bounces: bodies touch, and short replays decide.

use std::path::Path;

use asid::diagnosis::diagnose::Diagnosis;
use asid::diagnosis::result::{DiagnosisResult, Kind};

use super::played::Player;
use super::rows::{write_log, write_model};
use super::{assert_names, has_contacts, run_on};

/// Rows of a log, and the time between them, s.
const ROWS: usize = 90;
const ROW: f64 = 0.02;
/// Deviation of a reading, m.
const NOISE: f64 = 1e-3;
/// Time steps of the model and of the real ball, s.
const STEPS: [f64; 2] = [0.001, 0.0005];

/// The ball above a floor that gives way, with gravity `down` the floor and along it, and a contact whose damping is so many times the model's.
fn scene(timestep: f64, [along, down]: [f64; 2], damping: f64) -> String {
    let solref = format!("-40000 -{}", 18.0 * damping);
    format!(
        r#"<mujoco model="ball"><option timestep="{timestep}" gravity="{along} 0 -{down}" cone="elliptic"/>
        <worldbody><geom name="floor" type="plane" size="20 20 0.1" friction="0.4 0.005 0.0001" solref="{solref}"/>
        <body name="ball" pos="0 0 1"><freejoint name="ball_free"/>
        <geom name="ball" type="sphere" size="0.05" mass="0.06" friction="0.4 0.005 0.0001" condim="6" solref="{solref}"/></body>
        </worldbody><sensor><framepos name="place" objtype="xbody" objname="ball"/></sensor></mujoco>"#
    )
}

/// The ball on a floor that is tilted by an angle, rad.
fn tilted(tilt: f64) -> String {
    let (sin, cos) = tilt.sin_cos();
    scene(STEPS[1], [9.81 * sin, 9.81 * cos], 1.0)
}

/// Writes logs of a real ball, and the model that does not know of what it has: so many, the last to hold out, of which some are thrown from so
/// `high` that they never touch the floor; with the columns of their starts, or without.
fn write_study(folder: &Path, real: &str, (episodes, high): (u32, &[u32]), starts: bool) {
    let mut player = Player::of(real, &["place"], [ROW, STEPS[1]]);
    for episode in 0..episodes {
        let k = f64::from(episode);
        let up = match starts {
            true if high.contains(&episode) => 20.0,
            true => 0.3 + 0.1 * k,
            // It touches the floor within the first tenth.
            false => 0.06 + 0.01 * k,
        };
        let qpos = [0.0, 0.0, up, 1.0, 0.0, 0.0, 0.0];
        let qvel = [0.4 - 0.2 * k, 0.1 * k, 0.0, 0.0, 0.0, 0.0];
        let places = player.play((&qpos, &qvel), &[], ROWS);
        let start: Vec<f64> = [&qpos[..], &qvel[..]].concat();
        let start = if starts { &start[..] } else { &[] };
        let names = (0..7).map(|i| format!(",qpos.ball_free.{i}"));
        let names = names.chain((0..6).map(|i| format!(",qvel.ball_free.{i}")));
        let names: String = names.take(start.len()).collect();
        let columns = format!(",place.0,place.1,place.2{names}");
        let place = (episode as usize, episodes as usize);
        write_log(folder, place, &columns, (&places, 3), start, (ROW, NOISE));
    }
    write_model(folder, &scene(STEPS[0], [0.0, 9.81], 1.0));
}

/// The diagnosis of such logs; `None` with an engine whose floors do not give way.
fn diagnosed_with(real: &str, logs: (u32, &[u32]), starts: bool) -> Option<Diagnosis> {
    if !has_contacts() {
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), real, logs, starts);
    Some(run_on(folder.path(), &[]).0)
}

fn diagnosed(real: &str, logs: (u32, &[u32])) -> Option<DiagnosisResult> {
    diagnosed_with(real, logs, true).map(|d| d.result)
}

#[test]
fn a_tilt_is_told_from_bounces_and_what_bounces_scatter_by_is_stated() {
    let Some(r) = diagnosed(&tilted(0.05), (5, &[])) else {
        return;
    };
    assert_names(&r, &["gravity-tilt"]);
    // A bounce at twice the ball's time step is a little another one.
    assert!(r.gap.refined < 0.1 * r.gap.identified, "{:?}", r.gap);
    let pitch = r.effects[0].parameters["pitch"];
    assert!((pitch - 0.05).abs() < 0.002, "{pitch}");
    let repeats = r.checks.iter().find(|c| c.check == "repeatability");
    assert!(repeats.is_some_and(|c| c.detail.contains("scatter by more than the noise")));
}

#[test]
fn a_ball_that_lacks_nothing_is_accused_of_nothing() {
    let Some(r) = diagnosed(&tilted(0.0), (5, &[])) else {
        return;
    };
    assert_eq!(r.verdict.kind, Kind::None, "{}", r.sentence);
    assert!(r.gap.identified < 4.0, "{:?}", r.gap);
}

/// All candidates are first tried along each third log, and here nothing touches in these. A force through the ball's centre does to it what a tilt does.
#[test]
fn flights_among_bounces_are_taken_as_bounces_are() {
    let Some(r) = diagnosed(&tilted(0.05), (7, &[1, 4])) else {
        return;
    };
    let named = &r.verdict.effects;
    assert!(
        named == &["gravity-tilt"] || named == &["constant-force@ball"],
        "{}",
        r.sentence
    );
    assert!(r.gap.refined < 0.1 * r.gap.identified, "{:?}", r.gap);
}

/// The slope at the model's own damping tells less than half of what a bounce with three times as much loses.
#[test]
fn a_floor_that_takes_three_times_as_much_is_named() {
    let real = scene(STEPS[1], [0.0, 9.81], 3.0);
    let Some(r) = diagnosed(&real, (5, &[])) else {
        return;
    };
    assert_names(&r, &["contact-restitution@floor"]);
    assert!(r.gap.refined < 0.2 * r.gap.identified, "{:?}", r.gap);
}

/// Its spin about the normal of the floor hardly shows, and a fit of its start stepped by ten thousand rad/s there: the replay had then nothing to do with
/// the log, from which no slope leads back.
#[test]
fn a_ball_whose_start_no_log_gives_is_replayed_from_where_it_began() {
    let Some(d) = diagnosed_with(&tilted(0.0), (5, &[]), false) else {
        return;
    };
    assert_eq!(d.result.verdict.kind, Kind::None, "{}", d.result.sentence);
    let left = d.evidence.none;
    assert!(left.train < 1.2 && left.held_out < 1.2, "{left:?}");
}
