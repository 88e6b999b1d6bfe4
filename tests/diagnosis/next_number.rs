//! A drive that weakens from log to log: the next experiment, and replays for the view.

use asid::core::progress::Silent;
use asid::core::registry::find;
use asid::diagnosis::bench::{Bench, Trial};
use asid::diagnosis::candidate::Candidate;
use asid::diagnosis::experiment::next;
use asid::diagnosis::fit::{Begin, Effort};
use asid::diagnosis::machine::Machine;
use asid::diagnosis::predict::Point;
use asid::diagnosis::prepare::{dataset, set_reading_noise};
use asid::diagnosis::study::Study;
use asid::diagnosis::trajectory::positions;
use asid::effects::{EffectEntry, EffectSpec};

use super::diagnosis_support::engine;
use super::one_joint::{joint_log, normal};
use super::world::write_files;

/// Change of the drive's gain from one log to the next.
const RATE: f64 = -0.1;
/// Viscous friction, N s/m, of a cart of 1 kg.
const DAMPING: f64 = 2.0;
/// Standard deviation of a reading, m.
const NOISE: f64 = 5e-4;

const MODEL: &str = r#"<mujoco model="cart"><option timestep="0.002" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody><body name="cart"><joint name="rail" type="slide" axis="1 0 0" damping="2"/>
    <geom name="cart" type="box" size="0.05 0.05 0.05" mass="1"/></body></worldbody>
  <actuator><motor name="push" joint="rail" ctrlrange="-20 20"/></actuator>
  <sensor><jointpos name="x" joint="rail"/></sensor></mujoco>
"#;

/// A log of the cart, whose drive has lost a tenth of its gain with each log before.
fn log(episode: usize) -> String {
    let gain = 1.0 + RATE * episode as f64;
    let phase = 0.7 * episode as f64;
    let command = |t: f64| 4.0 * (3.0 * t + phase).sin() + 2.0 * (7.0 * t).cos();
    let step = |[x, v]: [f64; 2], u: f64, h: f64| {
        let v = v + h * (gain * u - DAMPING * v);
        [x + h * v, v]
    };
    let header = "time,ctrl.push,x,qpos.rail,qvel.rail";
    let mut normal = normal(31 + episode as u64);
    joint_log(header, [2.0, 0.01], 100, (command, step), || {
        NOISE * normal()
    })
}

/// The change of the drive's gain from log to log.
fn spec() -> EffectSpec {
    EffectSpec {
        name: "supply-trend".to_owned(),
        site: "push".to_owned(),
        values: Vec::new(),
    }
}

fn trend() -> Candidate {
    let spec = spec();
    let effect = (find::<EffectEntry>(&spec.name).unwrap().make)();
    Candidate {
        starts: Vec::new(),
        large: Vec::new(),
        ranges: effect.parameters().iter().map(|p| p.range).collect(),
        effect: effect.into(),
        spec,
        episodes: 4,
        is_tolerance: false,
    }
}

/// The logs and their model, with the values of its parameters.
fn bench() -> (Bench, Vec<f64>) {
    let folder = tempfile::tempdir().unwrap();
    let mass = "name = \"mass\"\ntarget = \"geom/cart/mass\"\nrange = [0.5, 2.0]";
    write_files(folder.path(), MODEL, mass, log);
    let study = Study::read(folder.path()).unwrap();
    let machine = Machine::new(engine(), &study.scene, &study.fixed, &study.effects, 0).unwrap();
    let (mut bench, nominal) = dataset(&study, machine).unwrap();
    set_reading_noise(&mut bench, &study.noise);
    (bench, nominal)
}

/// Symptom: no motion was said to tell a drive that weakens from log to log from one that does not.
/// Cause: the motion was examined as the first log of the study, in which the two do the same.
#[test]
fn the_next_experiment_follows_all_logs() {
    let (bench, nominal) = bench();
    let explained = |trials: &[Trial<'_>]| {
        let mut theta = nominal.clone();
        theta.extend(trials.iter().flat_map(|(_, values)| values.iter().copied()));
        let starts = bench.train.starts.clone();
        let begin = Begin::at(Point { theta, starts }, (&bench.open, &bench.reach));
        bench
            .explain(trials, begin, (Effort::LOOK, &Silent))
            .unwrap()
    };
    let trend = trend();
    let trials = [(&trend, vec![RATE])];
    let (weakens, none) = (explained(&trials), explained(&[]));
    let proposed = next(&bench, (&trials, &weakens), (&[], &none)).unwrap();
    assert_eq!(proposed.told.file, "next.csv", "{}", proposed.told.how);
    // Six logs have been played, and four tenths of the gain are left: some decimetres.
    let differ = proposed.told.how.split("differ by ").nth(1).unwrap();
    let deviations: f64 = differ.split(' ').next().unwrap().parse().unwrap();
    assert!(deviations > 100.0, "{}", proposed.told.how);
}

/// Symptom: the 3-D view showed a gap that the numbers beside it said is closed. Cause: every log
/// was replayed as the first one, in which a drive that weakens from log to log is still strong.
#[test]
fn a_log_is_shown_as_what_it_is_among_all_logs() {
    let (bench, nominal) = bench();
    let effect = EffectSpec {
        values: vec![("rate".to_owned(), RATE)],
        ..spec()
    };
    let model = bench.machine.with(&[effect]).unwrap();
    let plan = &bench.train.logs.episodes[0].plan;
    let point = Point {
        theta: nominal,
        starts: bench.train.starts.clone(),
    };
    let of = |number| positions(&*model, &bench.parameters, (plan, number), &point).unwrap();
    let (first, sixth) = (of(0), of(5));
    // Half of the gain is left, and the cart is linear in its command.
    let far = first.iter().fold(0.0_f64, |far, x| far.max(x.abs()));
    let pairs = first.iter().zip(&sixth);
    let off = pairs.fold(0.0_f64, |off, (a, b)| off.max((a - 2.0 * b).abs()));
    assert!(far > 0.1 && off < 1e-3 * far, "{far} {off}");
}
