//! Physics steps per second of a batch, compared with a bare loop over `mj_step`.
//!
//! `cargo run --release -p asid-mujoco --example throughput [SCENE.xml [TARGET]]` needs
//! `MUJOCO_DYNAMIC_LINK_DIR`. With a target, simulations differ in that parameter, and the time to
//! set it is printed as well. Both sides step the same scene from the same state with the same
//! commands, alternating, one thread against one and two against two. The best of several rounds
//! counts, because other load can only slow a round down.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::Path;
use std::time::Instant;

use asid_core::{Backend, BatchConfig, Control, Rollout, Scene};
use asid_core::{Layout, Target};
use asid_mujoco::MujocoBackend;
use mujoco_rs::wrappers::mj_model::MjModel;

/// A seven-joint arm of capsules with position servos, holding a rod over a ledge.
const ARM: &str = include_str!("arm.xml");
/// Steps of one simulation in a round.
const STEPS: usize = 500;
const ROUNDS: usize = 5;

/// Servo targets that vary around the keyframe's.
fn commands(layout: &Layout, frames: usize) -> Vec<f64> {
    let base = layout
        .keyframes
        .first()
        .map_or_else(|| vec![0.0; layout.nu()], |k| k.ctrl.clone());
    (0..frames)
        .flat_map(|frame| {
            let wave = (frame as f64 * 7.0 / frames as f64).sin() * 0.1;
            base.iter()
                .enumerate()
                .map(move |(i, u)| u + wave * (1.0 - 0.2 * i as f64))
        })
        .collect()
}

/// Steps per second of `threads` bare loops, each over its own data.
fn bare(model: &MjModel, commands: &[f64], simulations: usize, threads: usize) -> f64 {
    let nu = model.nu() as usize;
    let start = Instant::now();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let mut data = model.make_data();
                for _ in 0..simulations / threads {
                    data.reset();
                    if model.nkey() > 0 {
                        data.reset_keyframe(0).unwrap();
                    }
                    for command in commands.chunks_exact(nu) {
                        data.ctrl_mut().copy_from_slice(command);
                        for _ in 0..STEPS * nu / commands.len() {
                            data.step();
                        }
                    }
                }
            });
        }
    });
    (simulations * STEPS) as f64 / start.elapsed().as_secs_f64()
}

fn main() -> asid_core::Result<()> {
    let scene = match std::env::args().nth(1) {
        Some(path) => Scene::from_file(Path::new(&path))?,
        None => Scene::from_xml("arm.xml", ARM, &[])?,
    };
    let model = MujocoBackend::new()?.load(&scene)?;
    let layout = model.layout();
    let raw = MjModel::from_xml_string(scene.xml()).unwrap();
    let targets: Vec<Target> = match std::env::args().nth(2) {
        Some(target) => vec![target.parse()?],
        None => Vec::new(),
    };
    let joints: Vec<String> = layout
        .joints
        .iter()
        .map(|j| format!("qpos.{}", j.name))
        .collect();
    let sensors: Vec<String> = layout.sensors.iter().map(|s| s.name.clone()).collect();
    println!(
        "{}: nq {}, nu {}, {} sensors",
        scene.name(),
        layout.nq,
        layout.nu(),
        sensors.len()
    );
    for (what, names, substeps) in [
        ("qpos", &joints, 20),
        ("sensors", &sensors, 20),
        ("sensors", &sensors, 1),
    ] {
        let record = layout.recording(names)?;
        let frames = STEPS / substeps;
        let commands = commands(layout, frames);
        for (size, threads) in [(64, 1), (64, 2), (256, 1), (256, 2)] {
            let mut simulator = model.simulator(&BatchConfig {
                size,
                threads,
                targets: targets.clone(),
            })?;
            let sims: Vec<usize> = (0..size).collect();
            let mut out = vec![0.0; size * frames * record.width()];
            let (mut best, mut best_bare) = (0.0_f64, 0.0_f64);
            let mut setting = f64::INFINITY;
            for round in 0..ROUNDS {
                best_bare = best_bare.max(bare(&raw, &commands, size, threads));
                simulator.reset(&sims)?;
                if let Some(target) = targets.first() {
                    let nominal = model.nominal(target)?;
                    let values: Vec<f64> = (0..size)
                        .map(|i| nominal + 1e-4 * (i + round) as f64 / size as f64)
                        .collect();
                    let start = Instant::now();
                    simulator.set_parameters(&sims, &values)?;
                    setting = setting.min(start.elapsed().as_secs_f64());
                }
                let control = Control::Shared(&commands);
                let rollout = Rollout::new(&sims, frames, substeps, control, &record);
                let start = Instant::now();
                simulator.rollout(&rollout, &mut out)?;
                best = best.max((size * STEPS) as f64 / start.elapsed().as_secs_f64());
            }
            println!(
                "record {what:7} every {substeps:2} steps, batch {size:3}, threads {threads}: {best:8.0} steps/s, bare {best_bare:8.0}, ratio {:.3}",
                best / best_bare
            );
            if !targets.is_empty() {
                println!(
                    "    parameters set in {:.1} µs a simulation",
                    1e6 * setting / size as f64
                );
            }
        }
    }
    Ok(())
}
