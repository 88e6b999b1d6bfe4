//! A bouncing ball: bodies touch, and replays of short segments decide.

use std::path::Path;

use asid::diagnosis::diagnose::Diagnosis;
use asid::diagnosis::result::{DiagnosisResult, Kind};

use super::played::Player;
use super::rows::{write_log, write_model};
use super::{assert_names, has_contacts, run_on};

/// Rows of a log, and the time between them, s.
const ROWS: usize = 90;
const ROW: f64 = 0.02;
/// Standard deviation of a reading, m.
const NOISE: f64 = 1e-3;
/// Time steps of the model and of the real ball, s.
const STEPS: [f64; 2] = [0.001, 0.0005];

/// A ball above a compliant floor.
///
/// Gravity has the components `along` the floor and `down` onto it. The contact has `damping` times
/// the model's damping.
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

/// The ball on a floor that is tilted by `tilt`, rad.
fn tilted(tilt: f64) -> String {
    let (sin, cos) = tilt.sin_cos();
    scene(STEPS[1], [9.81 * sin, 9.81 * cos], 1.0)
}

/// Writes logs of a real ball, and a model that lacks the real ball's effect.
///
/// The last of the `episodes` logs is held out. The ball of the logs in `high` is thrown from so
/// high that it never touches the floor. `starts` says whether the logs have the columns of the
/// initial state.
fn write_study(folder: &Path, real: &str, (episodes, high): (u32, &[u32]), starts: bool) {
    let mut player = Player::of(real, &["place"], [ROW, STEPS[1]]);
    for episode in 0..episodes {
        let k = f64::from(episode);
        let up = match starts {
            true if high.contains(&episode) => 20.0,
            true => 0.3 + 0.1 * k,
            // The ball touches the floor within the first tenth of the log.
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

/// The diagnosis of such logs; `None` with an engine that has no compliant contacts.
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

/// Of a single ball a tilt and a constant force are the same physics. The force has one more
/// component, and where bounces scatter that one decides between the two names.
#[test]
fn a_tilt_is_told_from_bounces_and_what_bounces_scatter_by_is_stated() {
    let Some(r) = diagnosed(&tilted(0.05), (5, &[])) else {
        return;
    };
    // At twice the ball's time step a bounce differs slightly.
    assert!(r.gap.refined < 0.1 * r.gap.identified, "{:?}", r.gap);
    assert_eq!(r.verdict.effects.len(), 1, "{}", r.sentence);
    let named = &r.effects[0];
    // Acceleration along the floor, relative to gravity; the ball has 0.06 kg.
    let along = match &*named.effect {
        "gravity-tilt" => named.parameters["pitch"].sin(),
        "constant-force" => named.parameters["x"] / (0.06 * 9.81),
        _ => panic!("{}", r.sentence),
    };
    assert!((along - 0.05_f64.sin()).abs() < 0.002, "{along}");
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

/// The screening uses every third log, and here these have no contact. A force at the ball's centre
/// has the same effect as a tilt.
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

/// At the model's own damping the derivative predicts less than half of the energy that a bounce
/// with three times that damping loses.
#[test]
fn a_floor_that_takes_three_times_as_much_is_named() {
    let real = scene(STEPS[1], [0.0, 9.81], 3.0);
    let Some(r) = diagnosed(&real, (5, &[])) else {
        return;
    };
    assert_names(&r, &["contact-restitution@floor"]);
    assert!(r.gap.refined < 0.2 * r.gap.identified, "{:?}", r.gap);
}

/// The spin about the normal of the floor has hardly any effect on the readings.
///
/// Guards against fits of the initial state that step this spin by ten thousand rad/s. Such a
/// replay no longer resembles the log, and no derivative leads back.
#[test]
fn a_ball_whose_start_no_log_gives_is_replayed_from_where_it_began() {
    let Some(d) = diagnosed_with(&tilted(0.0), (5, &[]), false) else {
        return;
    };
    assert_eq!(d.result.verdict.kind, Kind::None, "{}", d.result.sentence);
    let left = d.evidence.none;
    assert!(left.train < 1.2 && left.held_out < 1.2, "{left:?}");
}
