//! A position servo that gets its commands late by a third of a period of its motion, integrated by
//! hand.
//!
//! A drive without any response has smaller residuals on such a motion than one that responds too
//! early. That is no evidence for another unit. Servos that lag because of friction are no evidence
//! for another clock.

use std::fmt::Write as _;

use asid::diagnosis::study::Study;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::wiring::mended;
use super::world::write_files;

const NOMINAL: &str = r#"<mujoco model="wrist"><option timestep="0.002" integrator="implicitfast"/>
  <worldbody><body name="hand"><joint name="wrist" type="hinge" axis="0 0 1"/>
    <geom name="hand" type="sphere" pos="0.1 0 0" size="0.01" mass="1" contype="0" conaffinity="0"/></body>
    <body name="finger" pos="0 1 0"><joint name="knuckle" type="hinge" axis="0 0 1"/>
    <geom name="finger" type="sphere" pos="0.1 0 0" size="0.01" mass="1" contype="0" conaffinity="0"/></body></worldbody>
  <actuator><position name="s_wrist" joint="wrist" kp="20" kv="0.9"/><position name="s_knuckle" joint="knuckle" kp="20" kv="0.9"/></actuator>
  <sensor><jointpos name="q_wrist" joint="wrist"/><jointpos name="q_knuckle" joint="knuckle"/>
    <jointvel name="v_wrist" joint="wrist"/></sensor>
</mujoco>
"#;
/// Gains, N m/rad and N m s/rad, and the inertia about the joint, kg m².
const GAINS: [f64; 2] = [20.0, 0.9];
const INERTIA: f64 = 0.01 + 0.4 * 1e-4;
/// Delay of the wrist drive's commands, s: a third of a period of the motion.
const DELAY: f64 = 0.05;
const NOISE: f64 = 1e-3;
const SECONDS: f64 = 3.0;
const ROW: f64 = 0.01;

/// Command of a drive at a time; zero before the log begins. A `pace` below 1 slows the motion.
fn command(pace: f64, episode: usize, drive: usize, time: f64) -> f64 {
    let row = (time / ROW + 1e-9).floor();
    if row < 0.0 {
        return 0.0;
    }
    let (t, k) = (pace * row * ROW, (episode + 3 * drive) as f64);
    0.2 * ((34.0 + k) * t).sin() + 0.1 * ((41.0 - k) * t + k).sin()
}

/// The two drives of the real machine: delay of the commands, s, and the friction that the model
/// lacks, N m s/rad.
type Drives = [(f64, f64); 2];

fn log(episode: usize, (drives, pace): (Drives, f64)) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(40 + episode as u64);
    let mut noise = || NOISE * ((0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0);
    let (mut q, mut v) = ([0.0; 2], [0.0; 2]);
    let steps = 100;
    let h = ROW / f64::from(steps);
    let mut text = "time,ctrl.s_wrist,ctrl.s_knuckle,q_wrist,q_knuckle,v_wrist,qpos.wrist,qpos.knuckle,qvel.wrist,qvel.knuckle".to_owned();
    for row in 0..(SECONDS / ROW) as usize {
        let time = ROW * row as f64;
        let u = [0, 1].map(|drive| command(pace, episode, drive, time));
        let read = [q[0], q[1], v[0]].map(|x| x + noise());
        let start = if row == 0 { "0,0,0,0" } else { ",,," };
        let _ = write!(
            text,
            "\n{time:.2},{},{},{},{},{},{start}",
            u[0], u[1], read[0], read[1], read[2]
        );
        for step in 0..steps {
            let now = time + h * f64::from(step);
            for (drive, (late, friction)) in drives.into_iter().enumerate() {
                // Symplectic Euler with a step of 0.1 ms.
                let error = command(pace, episode, drive, now - late) - q[drive];
                v[drive] += h / INERTIA * (GAINS[0] * error - (GAINS[1] + friction) * v[drive]);
                q[drive] += h * v[drive];
            }
        }
    }
    text + "\n"
}

/// Returns the wiring faults named in logs of a machine with these drives, which moves at a pace.
///
/// `starts` says whether the logs keep the state at the first row.
fn faults(drives: Drives, pace: f64, starts: bool) -> Vec<(String, String)> {
    let folder = tempfile::tempdir().unwrap();
    let mass = "name = \"mass\"\ntarget = \"geom/hand/mass\"\nrange = [0.8, 1.2]";
    write_files(folder.path(), NOMINAL, mass, |episode| {
        log(episode, (drives, pace))
    });
    let mut study = Study::read(folder.path()).unwrap();
    if !starts {
        study.train.iter_mut().for_each(|(_, e)| e.initial = None);
    }
    let found = mended(&study);
    let named = found.wiring.into_iter();
    named.map(|w| (w.fault, w.mend)).collect()
}

#[test]
fn a_drive_that_answers_late_is_not_accused_of_another_unit() {
    assert_eq!(faults([(DELAY, 0.0), (0.0, 0.0)], 1.0, true), []);
}

/// Servos of 20 N m/rad with 1.6 N m s/rad lag by 80 ms, in a motion with periods of about one
/// second. In a log that begins in motion no reading shows a dead time.
#[test]
fn servos_that_friction_makes_lag_are_not_taken_for_another_clock() {
    assert_eq!(faults([(0.0, 1.6); 2], 0.15, false), []);
}
