//! An axis without a spring or a servo. It integrates every force, so that a small unmodelled force
//! makes its whole replay drift.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::run_on;

/// Mass, kg. The model has 80 kg.
const MASS: f64 = 95.0;
/// Viscous friction, N s/m, which the model has, and dry friction, N, which it lacks.
const DAMPING: f64 = 100.0;
const FRICTION: f64 = 15.0;
/// Amplitude, N, and angular frequency, rad/s, of a force that no effect of the catalogue
/// describes.
const HIDDEN: [f64; 2] = [1.5, 0.8];
/// Rows of a log, time between them, s, and integration steps per row.
const ROWS: usize = 300;
const ROW: f64 = 0.02;
const STEPS: usize = 40;
/// Speed within which friction is linear, m/s, and standard deviation of a reading, m.
const CREEP: f64 = 2e-4;
const NOISE: f64 = 1e-4;

const MODEL: &str = r#"<mujoco model="axis"><option timestep="0.002" gravity="0 0 0"/><worldbody>
  <body name="carriage"><joint name="axis" type="slide" axis="1 0 0" damping="100"/>
  <geom name="carriage" size="0.1" mass="80"/></body></worldbody>
  <actuator><motor name="drive" joint="axis"/></actuator>
  <sensor><jointpos name="x" joint="axis"/></sensor></mujoco>"#;
const STUDY: &str = r#"model = "nominal.xml"
train = ["train_*.csv"]
test = ["test_*.csv"]
[[parameter]]
name = "mass"
target = "geom/carriage/mass"
range = [50, 150]
[noise]
x = 1e-4
"#;

fn log(episode: u32) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(u64::from(episode));
    let mut noise = || NOISE * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
    let e = f64::from(episode);
    let drive = |t: f64| {
        60.0 * (TAU * (0.5 + 0.1 * e) * t + e).sin() + 40.0 * (TAU * 1.3 * t + 2.0 * e).sin()
    };
    let hidden = |t: f64| HIDDEN[0] * (HIDDEN[1] * t + 2.1 * e).sin();
    let (mut x, mut v) = (0.0, 0.0);
    let mut text = "time,x,ctrl.drive,qpos.axis,qvel.axis".to_owned();
    for row in 0..ROWS {
        let time = ROW * row as f64;
        let (read, force) = (x + noise(), drive(time));
        let start = if row == 0 { "0,0" } else { "," };
        write!(text, "\n{time:.2},{read},{force},{start}").unwrap();
        let h = ROW / STEPS as f64;
        for step in 0..STEPS {
            let own = hidden(time + h * step as f64) - FRICTION * (v / CREEP).tanh();
            v += h * (force + own - DAMPING * v) / MASS;
            x += h * v;
        }
    }
    text + "\n"
}

fn write(folder: &Path) {
    for episode in 0..6 {
        let name = if episode < 4 { "train" } else { "test" };
        std::fs::write(folder.join(format!("{name}_{episode}.csv")), log(episode)).unwrap();
    }
    std::fs::write(folder.join("nominal.xml"), MODEL).unwrap();
    std::fs::write(folder.join("study.toml"), STUDY).unwrap();
}

/// A fit to whole replays alone gives 86.5 ± 2.5 kg.
#[test]
fn an_axis_that_drifts_keeps_the_mass_that_its_motion_from_row_to_row_tells() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let r = run_on(folder.path(), &[]).0.result;
    let named = &r.verdict.effects;
    assert_eq!(*named, ["coulomb-friction@axis"], "{}", r.sentence);
    let force = r.effects[0].parameters["force"];
    assert!((force - FRICTION).abs() < 1.0, "{force}");
    let mass = &r.parameters[0];
    assert!((mass.estimate - MASS).abs() < 0.03 * MASS, "{mass:?}");
    let [low, high] = mass.interval95;
    assert!(low < MASS && MASS < high, "{mass:?}");
}
