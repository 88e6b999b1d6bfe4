//! A ball that is dropped on a floor, with a tracker that reads too high.
//!
//! Along its readings the ball floats above the floor and never touches it.

use std::path::Path;

use asid::core::registry::all;
use asid::effects::EffectEntry;

use super::played::Player;
use super::rows::{write_log, write_model};
use super::{assert_names, has_contacts, run_on};

/// Rows of a log, time between them and time step, s, and standard deviation of a reading, m.
const ROWS: usize = 60;
const ROW: f64 = 0.02;
const STEP: f64 = 0.001;
const NOISE: f64 = 0.003;
const EPISODES: usize = 6;
/// Height of the tracker's reading above the ball, m.
const OFF: f64 = 0.04;

const SCENE: &str = r#"<mujoco model="ball"><option timestep="0.001" integrator="implicitfast" cone="elliptic"/>
  <worldbody><geom name="floor" type="plane" size="9 9 0.1" friction="0.3 0.005 0.002" condim="6"/>
  <body name="ball" pos="0 0 0.04"><freejoint name="ball"/>
    <geom name="ball" type="sphere" size="0.04" mass="0.08" friction="0.3 0.005 0.002" condim="6"/></body></worldbody>
  <sensor><framepos name="place" objtype="xbody" objname="ball"/></sensor>
</mujoco>
"#;

fn write_study(folder: &Path) {
    let mut player = Player::of(SCENE, &["place"], [ROW, STEP]);
    for episode in 0..EPISODES {
        let k = episode as f64;
        let qpos = [0.01 * k, 0.0, 0.1 + 0.01 * k, 1.0, 0.0, 0.0, 0.0];
        let qvel = [0.5 + 0.1 * k, 0.2 - 0.1 * k, 0.0, 0.0, 0.0, 0.0];
        let mut places = player.play((&qpos, &qvel), &[], ROWS);
        for place in places.chunks_mut(3) {
            place[2] += OFF;
        }
        let columns = ",place.0,place.1,place.2";
        let place = (episode, EPISODES);
        write_log(folder, place, columns, (&places, 3), &[], (ROW, NOISE));
    }
    write_model(folder, SCENE);
}

/// The ball seems to float along the readings, but touches the floor in replays. It is therefore
/// treated in segments.
#[test]
fn a_ball_that_its_tracker_sees_above_the_floor_touches_it() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path());
    let result = run_on(folder.path(), &[]).0.result;
    assert_names(&result, &["sensor-bias@place"]);
    let found = result.effects[0].parameters["z"];
    assert!((found - OFF).abs() < 0.001, "{found}");
}

/// Along segments, columns that change the readings much get smaller steps. Without candidates
/// there is no such step.
#[test]
fn a_search_upon_the_only_effect_that_it_may_name_ends_without_a_candidate() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path());
    let effects = all::<EffectEntry>();
    let others = effects.iter().map(|e| e.name);
    let others: Vec<&str> = others.filter(|name| *name != "sensor-bias").collect();
    let result = run_on(folder.path(), &others).0.result;
    assert_names(&result, &["sensor-bias@place"]);
}
