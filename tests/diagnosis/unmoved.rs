//! A block that is pushed over a floor in some logs and lies still in the others. The latter carry
//! no information about the floor.

use super::rows::{write_log, write_model};
use super::{assert_names, has_contacts, run_on};

/// Gravity, m/s².
const GRAVITY: f64 = 9.81;
/// Friction coefficient of the real floor, and of the model's.
const FRICTION: f64 = 0.3;
const MODEL: f64 = 0.25;
/// Half the height of the block, m.
const HEIGHT: f64 = 0.02;
/// Initial speed of the block in each log, m/s; the last log is held out.
const SPEEDS: [f64; 7] = [1.0, 0.0, 0.8, 1.2, 0.0, 0.9, 1.1];
/// Rows of a log, time between them, s, and standard deviation of a reading, m.
const ROWS: usize = 50;
const ROW: f64 = 0.01;
const NOISE: f64 = 1e-3;

fn model() -> String {
    format!(
        r#"<mujoco model="block"><option timestep="0.002" cone="elliptic" impratio="10"/>
        <worldbody><geom name="floor" type="plane" size="20 20 0.1" friction="{MODEL}"/>
        <body name="block" pos="0 0 {HEIGHT}"><freejoint name="block_free"/>
        <geom name="block" type="box" size="0.1 0.1 {HEIGHT}" mass="0.5" friction="0.02"/></body>
        </worldbody><sensor><framepos name="place" objtype="xbody" objname="block"/></sensor></mujoco>"#
    )
}

/// Position of a block that begins with a speed and slides until friction stops it.
fn place(speed: f64, time: f64) -> f64 {
    let slides = time.min(speed / (FRICTION * GRAVITY));
    speed * slides - 0.5 * FRICTION * GRAVITY * slides * slides
}

#[test]
fn friction_is_found_where_the_second_of_each_three_logs_shows_none() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let names = (0..7).map(|i| format!(",qpos.block_free.{i}"));
    let names: String = names
        .chain((0..6).map(|i| format!(",qvel.block_free.{i}")))
        .collect();
    let columns = format!(",place.0,place.1,place.2{names}");
    for (episode, speed) in SPEEDS.into_iter().enumerate() {
        let row = |k: usize| [place(speed, ROW * k as f64), 0.0, HEIGHT];
        let places: Vec<f64> = (0..ROWS).flat_map(row).collect();
        let start = [
            0.0, 0.0, HEIGHT, 1.0, 0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0, 0.0, 0.0,
        ];
        let which = (episode, SPEEDS.len());
        write_log(folder, which, &columns, (&places, 3), &start, (ROW, NOISE));
    }
    write_model(folder, &model());
    let r = run_on(folder, &[]).0.result;
    assert_names(&r, &["sliding-friction@floor"]);
    let factor = r.effects[0].parameters["factor"];
    assert!((factor / (FRICTION / MODEL) - 1.0).abs() < 0.03, "{factor}");
}
