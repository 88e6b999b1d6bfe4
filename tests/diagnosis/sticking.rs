//! A block that slides on a ramp where its model sticks. With the model's friction nothing moves,
//! so no derivative shows how far off the friction is.

use std::fmt::Write as _;

use asid::diagnosis::result::{DiagnosisResult, Kind};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::rows::{write_episode, write_model_with};
use super::{assert_names, has_contacts, run_on};

/// Gravity, m/s², and inclination of the ramp, rad.
const GRAVITY: f64 = 9.81;
const SLOPE: f64 = 0.3;
/// Friction coefficient of the real block; the model has 1.
const FRICTION: f64 = 0.15;
/// Height of the block's centre, m.
const HEIGHT: f64 = 0.02;
/// Rows of a log, and time between them, s.
const ROWS: usize = 60;
const ROW: f64 = 0.01;
/// Standard deviation of a reading, m.
const NOISE: f64 = 1e-3;

/// The block on its ramp. The ramp lies in the plane of the frame, and gravity is tilted instead.
fn model() -> String {
    let (sin, cos) = SLOPE.sin_cos();
    let (along, down) = (GRAVITY * sin, GRAVITY * cos);
    format!(
        r#"<mujoco model="block"><option timestep="0.002" gravity="{along} 0 -{down}" cone="elliptic" impratio="10"/>
        <worldbody><geom name="ramp" type="plane" size="20 20 0.1"/>
        <body name="block" pos="0 0 {HEIGHT}"><freejoint name="block_free"/>
        <geom name="block" type="box" size="0.1 0.1 {HEIGHT}" mass="0.5"/></body>
        </worldbody><sensor><framepos name="place" objtype="xbody" objname="block"/></sensor></mujoco>"#
    )
}

/// Position of a block that begins at 0 with a speed down the ramp, m/s, negative uphill.
///
/// Friction acts against the motion, and is too small to hold the block.
fn place(speed: f64, time: f64) -> f64 {
    let (sin, cos) = SLOPE.sin_cos();
    let uphill = GRAVITY * (sin + FRICTION * cos);
    let downhill = GRAVITY * (sin - FRICTION * cos);
    let turns = (-speed / uphill).max(0.0);
    if time < turns {
        return speed * time + 0.5 * uphill * time * time;
    }
    let top = 0.5 * speed * turns;
    top + speed.max(0.0) * time + 0.5 * downhill * (time - turns).powi(2)
}

fn log(episode: u32) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(u64::from(episode));
    let mut noise = || NOISE * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
    let speed = 0.3 * f64::from(episode) - 0.6;
    let mut text = "time,place.0,place.1,place.2".to_owned();
    (0..7).for_each(|i| write!(text, ",qpos.block_free.{i}").unwrap());
    (0..6).for_each(|i| write!(text, ",qvel.block_free.{i}").unwrap());
    for row in 0..ROWS {
        let time = ROW * row as f64;
        let start = match row {
            0 => format!("0,0,{HEIGHT},1,0,0,0,{speed},0,0,0,0,0"),
            _ => ",".repeat(12),
        };
        let [x, y, z] = [place(speed, time), 0.0, HEIGHT].map(|x| x + noise());
        write!(text, "\n{time:.2},{x},{y},{z},{start}").unwrap();
    }
    text + "\n"
}

/// Diagnoses the logs with a model, and with the study's text about parameters.
fn diagnosed(model: &str, parameters: &str) -> DiagnosisResult {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for episode in 0..6 {
        write_episode(folder, (episode as usize, 4), &log(episode));
    }
    write_model_with(folder, model, parameters);
    run_on(folder, &[]).0.result
}

#[test]
fn the_friction_of_a_block_that_slides_is_found_from_a_model_in_which_it_sticks() {
    if !has_contacts() {
        return;
    }
    let r = diagnosed(&model(), "");
    assert_names(&r, &["sliding-friction@ramp"]);
    let factor = r.effects[0].parameters["factor"];
    assert!((factor - FRICTION).abs() < 0.02, "{factor}");
    assert!(r.gap.closed.unwrap() > 0.95, "{:?}", r.gap);
}

#[test]
fn a_parameter_at_whose_given_value_the_block_sticks_is_fitted_and_no_effect_is_named() {
    if !has_contacts() {
        return;
    }
    // The larger friction of two bodies applies.
    let slick = model().replace("type=\"box\"", "type=\"box\" friction=\"0.02\"");
    let r = diagnosed(
        &slick,
        "[[parameter]]\nname = \"friction\"\ntarget = \"geom/ramp/friction/0\"\nrange = [0.05, 1.2]\n",
    );
    assert_eq!(r.verdict.kind, Kind::None, "{}", r.sentence);
    let found = r.parameters[0].estimate;
    assert!((found - FRICTION).abs() < 0.01, "{found}");
    assert!(r.gap.refined < 1.2, "{:?}", r.gap);
}
