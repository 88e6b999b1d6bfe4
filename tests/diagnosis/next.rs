//! The next experiment for a cart on a rail with dry friction.
//!
//! Its commands, played by hand on the true machine, stay within the range of the model's joint.

use std::fmt::Write as _;
use std::sync::Arc;

use asid::core::progress::Silent;
use asid::core::registry::{BackendEntry, find};
use asid::core::{Backend, Episode};
use asid::diagnosis::diagnose::{Settings, diagnose};
use asid::diagnosis::machine::Machine;
use asid::diagnosis::study::Study;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::diagnosis_support::engine;
use super::world::write_files;

/// Dry friction, N, of a cart of 1 kg.
const FRICTION: f64 = 0.3;
const NOISE: f64 = 2e-3;
const ROW: f64 = 0.01;
const SECONDS: f64 = 4.0;
/// Range of the joint, relative to the travel in the logs.
const ROOM: f64 = 1.6;

fn model(range: &str) -> String {
    format!(
        r#"<mujoco model="cart"><option timestep="0.002" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" {range}/>
    <geom name="cart" type="sphere" size="0.01" mass="1" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><motor name="push" joint="rail" ctrlrange="-6 6"/></actuator>
  <sensor><jointpos name="x" joint="rail"/></sensor></mujoco>
"#
    )
}

/// Positions of the true cart under commands that are held from row to row: symplectic Euler with a
/// step of 0.1 ms.
fn positions(time: &[f64], command: impl Fn(usize) -> f64) -> Vec<f64> {
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let h = 1e-4;
    let mut all = vec![0.0];
    for k in 1..time.len() {
        let steps = ((time[k] - time[k - 1]) / h).round() as usize;
        for _ in 0..steps {
            let pushed = v + h * command(k - 1);
            // Dry friction stops the cart but does not reverse it.
            let lost = (h * FRICTION).min(pushed.abs());
            v = pushed - lost.copysign(pushed);
            x += h * v;
        }
        all.push(x);
    }
    all
}

fn log(episode: usize) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(7 + episode as u64);
    let mut noise = || NOISE * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
    let time: Vec<f64> = (0..(SECONDS / ROW) as usize)
        .map(|k| ROW * k as f64)
        .collect();
    let phase = 0.3 * episode as f64;
    // Cosines make the cart swing about one position without drift.
    let command = |k: usize| 3.0 * (5.0 * time[k]).cos() + (8.0 * time[k] + phase).cos();
    let x = positions(&time, command);
    let mut text = "time,ctrl.push,x,qpos.rail,qvel.rail".to_owned();
    for (k, x) in x.iter().enumerate() {
        let start = if k == 0 { "0,0" } else { "," };
        let _ = write!(text, "\n{},{},{},{start}", time[k], command(k), x + noise());
    }
    text + "\n"
}

/// Returns how the next experiment is made and its commands, from a diagnosis of these logs.
fn proposed(range: &str, engine: Arc<dyn Backend>) -> (String, Episode) {
    let folder = tempfile::tempdir().unwrap();
    let mass = "name = \"mass\"\ntarget = \"geom/cart/mass\"\nrange = [0.8, 1.2]";
    write_files(folder.path(), &model(range), mass, log);
    let study = Study::read(folder.path()).unwrap();
    let machine = Machine::new(engine, &study.scene, &study.fixed, &study.effects, 0).unwrap();
    // Small motions tell sensor faults from friction, and would stay in place.
    let settings = Settings {
        without: ["sensor-scale", "sensor-drift"].map(String::from).into(),
        ..Settings::default()
    };
    let (diagnosis, _) = diagnose(&study, machine, settings, &Silent).unwrap();
    let result = diagnosis.result;
    let next = result.next_experiment;
    assert_eq!(next.file, "next.csv", "{}", result.sentence);
    (next.how, diagnosis.next_commands.expect("commands"))
}

/// Largest distance of the true cart from its initial position under some commands, m.
fn furthest(commands: &Episode) -> f64 {
    let x = positions(&commands.time, |k| commands.ctrl[k]);
    x.iter().fold(0.0, |far: f64, x| far.max(x.abs()))
}

/// Largest distance of the cart in the logs, m.
fn logged() -> f64 {
    let time: Vec<f64> = (0..400).map(|k| ROW * f64::from(k)).collect();
    let x = positions(&time, |k| {
        3.0 * (5.0 * time[k]).cos() + (8.0 * time[k]).cos()
    });
    x.iter().fold(0.0, |far: f64, x| far.max(x.abs()))
}

/// Commands for a cart whose joint has slightly more range than the logs use.
fn in_a_narrow_range(engine: Arc<dyn Backend>) -> Episode {
    let end = ROOM * logged();
    let range = format!("range=\"{} {end}\" limited=\"true\"", -end);
    let (how, narrow) = proposed(&range, engine);
    assert!(furthest(&narrow) < end, "{how}: {}", furthest(&narrow));
    narrow
}

#[test]
fn the_next_experiment_keeps_the_range_of_the_joint() {
    let (how, free) = proposed("", engine());
    let (far, logged) = (furthest(&free), logged());
    assert!(far > ROOM * logged, "{how}: {far} {logged}");
    let narrow = in_a_narrow_range(engine());
    assert_eq!(narrow.actuators, ["push"]);
    assert!(narrow.channels.is_empty() && narrow.ctrl.len() == narrow.time.len());
}

/// Symptom: on rapier the next experiment leaves the range. Cause: the range is read from the
/// engine, which has no such target there.
#[test]
fn the_next_experiment_keeps_a_range_that_the_engine_cannot_change() {
    let entry = find::<BackendEntry>("rapier").unwrap();
    in_a_narrow_range((entry.make)().unwrap().into());
}
