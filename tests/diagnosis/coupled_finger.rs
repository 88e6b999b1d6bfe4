//! Two gripper fingers coupled by an equality constraint, with dry friction that the model lacks.

use std::fmt::Write as _;
use std::path::Path;

use asid::diagnosis::result::RankedSet;

use super::one_joint::normal;
use super::played::Player;
use super::rows::{write_episode, write_model};
use super::{has_contacts, run_on};

/// Rows of a log, time between them and time step, s, and standard deviation of a reading, m.
const ROWS: usize = 300;
const ROW: f64 = 0.01;
const STEP: f64 = 0.002;
const NOISE: f64 = 5e-5;

/// Two fingers on slides. A servo drives one of them, which has dry friction `friction` (N).
fn scene(friction: f64) -> String {
    format!(
        r#"<mujoco model="gripper"><option timestep="0.002" integrator="implicitfast"/><worldbody>
        <body name="left"><joint name="left" type="slide" axis="1 0 0" damping="3" armature="0.2" frictionloss="{friction}"/>
          <geom type="box" size="0.006 0.01 0.03" mass="0.06" contype="0" conaffinity="0"/></body>
        <body name="right"><joint name="right" type="slide" axis="-1 0 0" damping="3" armature="0.2"/>
          <geom type="box" size="0.006 0.01 0.03" mass="0.06" contype="0" conaffinity="0"/></body></worldbody>
        <equality><joint joint1="right" joint2="left"/></equality>
        <actuator><position name="grip" joint="left" kp="300" kv="10" forcerange="-20 20"/></actuator>
        <sensor><jointpos name="gap" joint="left"/></sensor></mujoco>"#
    )
}

fn write_study(folder: &Path) {
    let mut player = Player::of(&scene(1.2), &["gap"], [ROW, STEP]);
    for episode in 0..4_u32 {
        let mut noise = normal(90 + u64::from(episode));
        let turn =
            |row: usize, speed: f64| (speed * ROW * row as f64 + 1.7 * f64::from(episode)).sin();
        let command = |row: usize| 0.025 + 0.012 * turn(row, 2.1) + 0.008 * turn(row, 5.3);
        let commands: Vec<f64> = (0..ROWS).map(command).collect();
        let start = [commands[0]; 2];
        let places = player.play((&start, &[0.0; 2]), &commands[..ROWS - 1], ROWS);
        let mut text = "time,ctrl.grip,gap,qpos.left,qpos.right,qvel.left,qvel.right".to_owned();
        for (k, (command, place)) in commands.iter().zip(&places).enumerate() {
            let read = place + NOISE * noise();
            write!(text, "\n{:.2},{command},{read},", ROW * k as f64).unwrap();
            text.push_str(&if k == 0 {
                format!("{},{},0,0", start[0], start[1])
            } else {
                ",,,".to_owned()
            });
        }
        text.push('\n');
        write_episode(folder, (episode as usize, 3), &text);
    }
    write_model(folder, &scene(0.0));
}

/// Before either is fitted, a dead band of the drive shows five times the evidence of the friction.
/// Only fits tell the two apart.
#[test]
fn friction_of_a_coupled_finger_is_fitted_beside_a_dead_band_that_leads() {
    if !has_contacts() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path());
    let result = run_on(folder.path(), &[]).0.result;
    let fitted = |name: &str| {
        let alone = |r: &&RankedSet| r.effects == [name];
        result.ranking.iter().find(alone).and_then(|r| r.fitted)
    };
    assert!(
        fitted("actuator-deadband@grip").is_some(),
        "{}",
        result.sentence
    );
    assert!(
        fitted("coulomb-friction@left").is_some(),
        "{}",
        result.sentence
    );
}
