//! Physics steps per second of a batch against a bare loop over `mj_step`.
//!
//! `cargo run --release -p asid-mujoco --example throughput [SCENE.xml]`; it
//! needs `MUJOCO_DYNAMIC_LINK_DIR`. Both sides step the same scene from the same
//! state under the same commands, one thread against one and two against two,
//! in turns; the best of several rounds counts, as other load only slows down.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

use std::path::Path;
use std::time::Instant;

use asid_core::layout::Layout;
use asid_core::{Backend, BatchConfig, Control, Rollout, Scene};
use asid_mujoco::MujocoBackend;
use mujoco_rs::wrappers::mj_model::MjModel;

/// A seven-joint arm of capsules with position servos, holding a rod over a ledge.
const ARM: &str = include_str!("arm.xml");
const SUBSTEPS: usize = 20;
const FRAMES: usize = 25;
const ROUNDS: usize = 5;

/// Servo targets that wander around the keyframe's.
fn commands(layout: &Layout) -> Vec<f64> {
    let base = layout
        .keyframes
        .first()
        .map_or_else(|| vec![0.0; layout.nu()], |k| k.ctrl.clone());
    (0..FRAMES)
        .flat_map(|frame| {
            let wave = (frame as f64 * 0.3).sin() * 0.1;
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
                        for _ in 0..SUBSTEPS {
                            data.step();
                        }
                    }
                }
            });
        }
    });
    (simulations * FRAMES * SUBSTEPS) as f64 / start.elapsed().as_secs_f64()
}

fn main() -> asid_core::Result<()> {
    let scene = match std::env::args().nth(1) {
        Some(path) => Scene::from_file(Path::new(&path))?,
        None => Scene::from_xml("arm.xml", ARM, &[])?,
    };
    let model = MujocoBackend::new()?.load(&scene)?;
    let layout = model.layout();
    let raw = MjModel::from_xml_string(scene.xml()).unwrap();
    let commands = commands(layout);
    let joints: Vec<String> = layout
        .joints
        .iter()
        .map(|j| format!("qpos.{}", j.name))
        .collect();
    let sensors: Vec<String> = layout.sensors.iter().map(|s| s.name.clone()).collect();
    println!(
        "{}: nq {}, nu {}, {} sensors; {FRAMES} frames of {SUBSTEPS} steps",
        scene.name(),
        layout.nq,
        layout.nu(),
        sensors.len()
    );
    for (what, names) in [("qpos", &joints), ("sensors", &sensors)] {
        let record = layout.recording(names)?;
        for size in [64, 256] {
            for threads in [1, 2] {
                let mut simulator = model.simulator(&BatchConfig {
                    size,
                    threads,
                    targets: Vec::new(),
                })?;
                let sims: Vec<usize> = (0..size).collect();
                let mut out = vec![0.0; size * FRAMES * record.width()];
                let (mut best, mut best_bare) = (0.0_f64, 0.0_f64);
                for _ in 0..ROUNDS {
                    best_bare = best_bare.max(bare(&raw, &commands, size, threads));
                    simulator.reset(&sims)?;
                    let control = Control::Shared(&commands);
                    let rollout = Rollout::new(&sims, FRAMES, SUBSTEPS, control, &record);
                    let start = Instant::now();
                    simulator.rollout(&rollout, &mut out)?;
                    let steps = (size * FRAMES * SUBSTEPS) as f64;
                    best = best.max(steps / start.elapsed().as_secs_f64());
                }
                println!(
                    "record {what:7} batch {size:3} threads {threads}: {best:8.0} steps/s, bare {best_bare:8.0}, ratio {:.3}",
                    best / best_bare
                );
            }
        }
    }
    Ok(())
}
