//! Cost of the C ABI: compares an engine loaded as a plugin with the same engine linked in.
//!
//! Both do the same work in turns, in one process: whole episodes in one call, and frame by frame,
//! as a learner steps them. Their readings must agree to the bit.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use asid_core::{BatchConfig, Control, Model, Recording, Rollout, Simulator, Task};
use serde::Serialize;

use crate::clock::{Cost, timed};
use crate::workload::{Episodes, Workload};

/// Number of simulations in the batch.
const BATCH: usize = 64;

/// Factor of the rounds compared with other measurements.
const MORE_ROUNDS: usize = 5;

/// Measurement for one engine, way of calling and number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct PluginRow {
    engine: String,
    calls: &'static str,
    batch: usize,
    threads: usize,
    rounds: usize,
    /// Physics steps per second of the linked engine, best of the rounds.
    steps_per_s: f64,
    /// Time of the loaded engine divided by that of the linked one, each the best of the rounds.
    ratio: f64,
    /// The same ratio of CPU times.
    cpu_ratio: f64,
    /// Median over the rounds of the ratio within one round.
    median_ratio: f64,
}

/// Path at which the build leaves the plugin of an engine.
///
/// # Errors
/// If it is missing.
pub fn library(engine: &str) -> Result<PathBuf> {
    let own = std::env::current_exe().context("cannot tell where this program lies")?;
    let name = format!(
        "{}asid_engine_{engine}{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    let path = own.with_file_name(name);
    ensure!(path.exists(), "{} is not built", path.display());
    Ok(path)
}

/// All rows of one engine.
///
/// # Errors
/// If an engine fails, or if the readings of the two differ.
pub fn rows(
    engine: &str,
    task: &dyn Task,
    linked: &dyn Model,
    library: &Path,
    threads: &[usize],
    rounds: usize,
) -> Result<Vec<PluginRow>> {
    let loaded = asid_abi::open_engine(library)?
        .backend(engine)
        .load(task.scene())?;
    let parameters = task.parameters();
    let episodes = Episodes::random(task, &parameters, BATCH, 1);
    let work = Workload::new(
        task,
        linked.layout(),
        &parameters,
        &episodes,
        &episodes.theta,
        1,
    )?;
    let mut out = Vec::new();
    for &threads in threads {
        for (calls, frames) in [("episode", work.frames), ("frame", 1)] {
            eprintln!("plugin: {engine}, a call each {calls}, threads {threads}");
            let mut one = Side::new(linked, task, &work, threads)?;
            let mut other = Side::new(&*loaded, task, &work, threads)?;
            let rounds = rounds * MORE_ROUNDS;
            let (mut best, mut best_loaded) = (Cost::ENDLESS, Cost::ENDLESS);
            let mut ratios = Vec::new();
            for round in 0..rounds {
                // The sides take turns in going first, so that neither always finds a warm cache.
                let (a, b) = if round % 2 == 0 {
                    let a = one.run(frames)?;
                    (a, other.run(frames)?)
                } else {
                    let b = other.run(frames)?;
                    (one.run(frames)?, b)
                };
                ratios.push(b.wall_s / a.wall_s);
                best = best.least(a);
                best_loaded = best_loaded.least(b);
            }
            ensure!(
                one.bits() == other.bits(),
                "{engine} reads otherwise when it is loaded"
            );
            ratios.sort_by(f64::total_cmp);
            out.push(PluginRow {
                engine: engine.to_owned(),
                calls,
                batch: BATCH,
                threads,
                rounds,
                steps_per_s: work.steps() as f64 / best.wall_s,
                ratio: best_loaded.wall_s / best.wall_s,
                cpu_ratio: best_loaded.cpu_s / best.cpu_s,
                median_ratio: ratios[rounds / 2],
            });
        }
    }
    Ok(out)
}

/// A batch with its workload.
struct Side<'a> {
    simulator: Box<dyn Simulator>,
    work: &'a Workload,
    sims: Vec<usize>,
    record: Recording,
    /// Commands, frame by frame, `frames x sims x nu`.
    by_frame: Vec<f64>,
    readings: Vec<f64>,
}

impl<'a> Side<'a> {
    fn new(model: &dyn Model, task: &dyn Task, work: &'a Workload, threads: usize) -> Result<Self> {
        let config = BatchConfig {
            size: work.sims,
            threads,
            targets: work.targets.clone(),
        };
        let mut simulator = model.simulator(&config)?;
        let sims: Vec<usize> = (0..work.sims).collect();
        simulator.set_parameters(&sims, &work.values)?;
        let record = model.layout().recording(&task.exploration().channels())?;
        let nu = work.nu;
        let mut by_frame = Vec::with_capacity(work.control.len());
        for frame in 0..work.frames {
            for &sim in &sims {
                let at = (sim * work.frames + frame) * nu;
                by_frame.extend_from_slice(&work.control[at..at + nu]);
            }
        }
        Ok(Self {
            readings: vec![0.0; work.sims * work.frames * record.width()],
            by_frame,
            simulator,
            work,
            sims,
            record,
        })
    }

    /// Runs all episodes with `frames` frames per call.
    fn run(&mut self, frames: usize) -> Result<Cost> {
        let work = self.work;
        self.simulator.reset(&self.sims)?;
        self.simulator
            .set_state(&self.sims, &work.qpos, &work.qvel)?;
        let control: &[f64] = if frames == work.frames {
            &work.control
        } else {
            &self.by_frame
        };
        let calls = work.frames / frames;
        let commands = control.len() / calls;
        let readings = self.readings.len() / calls;
        let (simulator, sims, record) = (&mut self.simulator, &self.sims, &self.record);
        let out = &mut self.readings;
        let (done, cost) = timed(|| {
            for call in 0..calls {
                let rollout = Rollout::new(
                    sims,
                    frames,
                    work.substeps,
                    Control::PerSimulation(&control[call * commands..(call + 1) * commands]),
                    record,
                );
                let out = &mut out[call * readings..(call + 1) * readings];
                simulator.rollout(&rollout, out)?;
            }
            asid_core::Result::<()>::Ok(())
        });
        done?;
        Ok(cost)
    }

    fn bits(&self) -> Vec<u64> {
        self.readings.iter().map(|x| x.to_bits()).collect()
    }
}

/// The rows as a table.
pub fn table(rows: &[PluginRow]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|r| {
            vec![
                r.engine.clone(),
                r.calls.to_owned(),
                r.threads.to_string(),
                format!("{:.0}", r.steps_per_s),
                format!("{:.3}", r.ratio),
                format!("{:.3}", r.cpu_ratio),
                format!("{:.3}", r.median_ratio),
            ]
        })
        .collect()
}
