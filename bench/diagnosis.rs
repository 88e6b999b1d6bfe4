//! Cost of a diagnosis by joints and rows: arms with servos that lack nothing, and arms that lack
//! friction at one joint.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use asid_core::simulator::BatchConfig;
use asid_core::{Backend, Control, Rollout, Scene, Streams};
use rand::Rng as _;
use serde::Serialize;

/// Joints of an arm, and rows of all its training logs at 100 Hz; the last is one minute of an arm
/// with seven joints.
const SIZES: [(usize, usize); 6] = [(1, 600), (1, 6000), (2, 600), (4, 600), (7, 600), (7, 6000)];
/// Numbers of training logs and of held-out logs.
const LOGS: [usize; 2] = [3, 1];
/// Time between the rows of a log, s; the next constant is the number of physics steps in it.
const ROW: f64 = 0.01;
const SUBSTEPS: usize = 5;
/// Damping of each joint of the model, and extra friction of the first joint of the real arm, N m
/// s/rad.
const DAMPING: f64 = 0.05;
const FRICTION: f64 = 0.2;
/// Standard deviation of the angle sensors' noise, rad.
const NOISE: f64 = 5e-4;

/// Cost of one diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct DiagnosisRow {
    engine: String,
    joints: usize,
    rows: usize,
    lacks: &'static str,
    /// Effects at sites that a screening compared.
    candidates: usize,
    /// The named effects.
    named: String,
    first_table_s: f64,
    wall_s: f64,
}

/// An arm of rods in a row with a servo at each joint; the axes alternate between across and along
/// the rod.
fn arm(joints: usize, friction: f64) -> String {
    let (mut bodies, mut drives, mut sensors) = (String::new(), String::new(), String::new());
    for j in 0..joints {
        let axis = ["0 1 0", "1 0 0", "0 0 1"][j % 3];
        let damping = DAMPING + if j == 0 { friction } else { 0.0 };
        let place = if j == 0 { "0 0 0" } else { "0.2 0 0" };
        let _ = write!(
            bodies,
            r#"<body name="b{j}" pos="{place}"><joint name="j{j}" type="hinge" axis="{axis}" damping="{damping}" armature="0.02"/>
            <geom name="g{j}" type="capsule" fromto="0 0 0 0.2 0 0.02" size="0.03" mass="0.5" contype="0" conaffinity="0"/>"#
        );
        let _ = write!(
            drives,
            r#"<position name="s{j}" joint="j{j}" kp="60" kv="3"/>"#
        );
        let _ = write!(sensors, r#"<jointpos name="q{j}" joint="j{j}"/>"#);
    }
    let end = "</body>".repeat(joints);
    let step = ROW / SUBSTEPS as f64;
    format!(
        r#"<mujoco model="arm"><option timestep="{step}" integrator="implicitfast"/>
        <worldbody>{bodies}{end}</worldbody><actuator>{drives}</actuator><sensor>{sensors}</sensor></mujoco>"#
    )
}

/// A log of an arm that follows sums of two sines from rest.
fn log(
    engine: &dyn Backend,
    document: &str,
    joints: usize,
    rows: usize,
    seed: u64,
) -> Result<String> {
    let mut rng = Streams::new(seed).stream("diagnosis bench");
    let model = engine.load(&Scene::from_xml("arm", document, &[])?)?;
    let mut simulator = model.simulator(&BatchConfig {
        size: 1,
        threads: 1,
        targets: Vec::new(),
    })?;
    let names: Vec<String> = (0..joints).map(|j| format!("q{j}")).collect();
    let record = model.layout().recording(&names)?;
    let waves: Vec<[f64; 4]> = (0..joints)
        .map(|_| std::array::from_fn(|_| rng.random_range(0.5..1.5)))
        .collect();
    let command = |k: usize, [a, b, w, z]: &[f64; 4]| {
        let t = k as f64 * ROW;
        0.5 * a * (3.0 * w * t).sin() + 0.25 * b * (7.0 * z * t).sin()
    };
    let control: Vec<f64> = (0..rows)
        .flat_map(|k| waves.iter().map(move |w| command(k, w)))
        .collect();
    let rollout = Rollout::new(
        &[0],
        rows,
        SUBSTEPS,
        Control::PerSimulation(&control),
        &record,
    );
    let mut read = vec![0.0; rows * joints];
    simulator.reset(&[0])?;
    simulator.rollout(&rollout, &mut read)?;
    let mut noise = || NOISE * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
    let columns = |name: &str| -> String { (0..joints).map(|j| format!(",{name}{j}")).collect() };
    let mut text = format!(
        "time{}{}{}{}\n",
        columns("ctrl.s"),
        columns("q"),
        columns("qpos.j"),
        columns("qvel.j")
    );
    for k in 0..rows {
        let _ = write!(text, "{:.3}", k as f64 * ROW);
        for j in 0..joints {
            let _ = write!(text, ",{}", control[k * joints + j]);
        }
        for j in 0..joints {
            // The reading of a row precedes the action of its command.
            let angle = if k == 0 {
                0.0
            } else {
                read[(k - 1) * joints + j]
            };
            let _ = write!(text, ",{}", angle + noise());
        }
        let start = if k == 0 { ",0" } else { "," };
        text += &start.repeat(2 * joints);
        text.push('\n');
    }
    Ok(text)
}

/// Writes the study of an arm.
fn write_study(
    folder: &Path,
    engine: &dyn Backend,
    (joints, rows): (usize, usize),
    friction: f64,
) -> Result<()> {
    std::fs::write(folder.join("nominal.xml"), arm(joints, 0.0))?;
    let study = "model = \"nominal.xml\"\ntrain = [\"train_*.csv\"]\ntest = [\"test_*.csv\"]\n";
    std::fs::write(folder.join("study.toml"), study)?;
    let real = arm(joints, friction);
    for (first, name, count) in [(0, "train", LOGS[0]), (100, "test", LOGS[1])] {
        for k in 0..count {
            let text = log(engine, &real, joints, rows / LOGS[0], first + k as u64)?;
            std::fs::write(folder.join(format!("{name}_{k}.csv")), text)?;
        }
    }
    Ok(())
}

/// Diagnoses arms of several sizes.
///
/// # Errors
/// If the engine or the program fails.
pub fn rows(asid: &Path, name: &str, engine: &dyn Backend) -> Result<Vec<DiagnosisRow>> {
    let mut out = Vec::new();
    for size in SIZES {
        for (lacks, friction) in [("nothing", 0.0), ("friction", FRICTION)] {
            let (joints, rows) = size;
            eprintln!("diagnosis: {name}, {joints} joints, {rows} rows, lacks {lacks}");
            let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
            write_study(folder.path(), engine, size, friction)?;
            let result = folder.path().join("out");
            let start = Instant::now();
            let status = Command::new(asid)
                .arg("diagnose")
                .arg(folder.path())
                .args(["--backend", name, "--quiet", "--minutes", "10", "--out"])
                .arg(&result)
                .stdout(Stdio::null())
                .status()
                .context("cannot start asid")?;
            let wall_s = start.elapsed().as_secs_f64();
            if !status.success() {
                bail!("`asid diagnose` ended with {status}");
            }
            let text = std::fs::read(result.join("result.json"))?;
            let result: serde_json::Value = serde_json::from_slice(&text)?;
            let effects = result["verdict"]["effects"].as_array();
            let named = effects.into_iter().flatten().filter_map(|e| e.as_str());
            let named: Vec<&str> = named.collect();
            out.push(DiagnosisRow {
                engine: name.to_owned(),
                joints,
                rows,
                lacks,
                candidates: result["detection_limits"].as_array().map_or(0, Vec::len),
                named: match &named[..] {
                    [] => result["verdict"]["kind"].as_str().unwrap_or("").to_owned(),
                    named => named.join(" + "),
                },
                first_table_s: result["seconds_to_first_table"]
                    .as_f64()
                    .unwrap_or(f64::NAN),
                wall_s,
            });
        }
    }
    Ok(out)
}

/// The diagnoses as a table.
pub fn table(rows: &[DiagnosisRow]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|r| {
            vec![
                r.engine.clone(),
                r.joints.to_string(),
                r.rows.to_string(),
                r.candidates.to_string(),
                r.lacks.to_owned(),
                r.named.clone(),
                format!("{:.1}", r.first_table_s),
                format!("{:.1}", r.wall_s),
            ]
        })
        .collect()
}
