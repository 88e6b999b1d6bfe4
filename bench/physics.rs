//! Physics steps per second of batches, compared with the engine's own bare loop.

use anyhow::Result;
use asid_core::{BatchConfig, Control, Model, Rollout, Simulator, Task};
use serde::Serialize;

use crate::bare::Bare;
use crate::clock::{Cost, timed};
use crate::loops::bare;
use crate::workload::{Episodes, Workload};

/// Batch sizes.
const SIZES: [usize; 4] = [1, 16, 64, 256];

/// Smallest number of physics steps in a measurement; smaller batches run several times.
const LEAST_STEPS: u64 = 16_000;

/// Measurement for one engine, batch size and number of threads.
#[derive(Clone, Debug, Serialize)]
pub struct PhysicsRow {
    engine: String,
    batch: usize,
    threads: usize,
    /// Physics steps of a round.
    steps: u64,
    rounds: usize,
    /// Best rate of the rounds, of the batch; the next field is that of the bare loop.
    steps_per_s: f64,
    bare_steps_per_s: f64,
    /// Ratio of the two rates.
    ratio: f64,
    /// CPU time of the bare loop divided by that of the batch, each the least of the rounds.
    cpu_ratio: f64,
}

/// Extent of the measurements.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Rounds of a row; each measures both sides.
    pub rounds: usize,
    /// Number of frames of an episode that are run.
    pub frames: usize,
}

/// All rows of one engine.
///
/// # Errors
/// If the engine fails.
pub fn rows(
    engine: &str,
    task: &dyn Task,
    model: &dyn Model,
    threads: &[usize],
    effort: Effort,
) -> Result<Vec<PhysicsRow>> {
    let parameters = task.parameters();
    let mut out = Vec::new();
    for batch in SIZES {
        let episodes = Episodes::random(task, &parameters, batch, 1);
        let work = Workload::new(
            task,
            model.layout(),
            &parameters,
            &episodes,
            &episodes.theta,
            1,
        )?
        .shortened(effort.frames);
        let mut loops = bare(engine, task.scene(), &work)?;
        for &threads in threads.iter().filter(|&&t| t == 1 || batch > 1) {
            eprintln!("physics: {engine}, batch {batch}, threads {threads}");
            let config = BatchConfig {
                size: batch,
                threads,
                targets: work.targets.clone(),
            };
            let simulator = model.simulator(&config)?;
            let mut sides = Sides::new(simulator, &mut *loops, task, &work)?;
            let repeats = LEAST_STEPS.div_ceil(work.steps()).max(1);
            let (mut best, mut best_bare) = (Cost::ENDLESS, Cost::ENDLESS);
            for _ in 0..effort.rounds {
                let (mut ours, mut theirs) = (Cost::default(), Cost::default());
                for _ in 0..repeats {
                    theirs += sides.bare(threads)?;
                    ours += sides.batch()?;
                }
                best = best.least(ours);
                best_bare = best_bare.least(theirs);
            }
            let steps = repeats * work.steps();
            out.push(PhysicsRow {
                engine: engine.to_owned(),
                batch,
                threads,
                steps,
                rounds: effort.rounds,
                steps_per_s: steps as f64 / best.wall_s,
                bare_steps_per_s: steps as f64 / best_bare.wall_s,
                ratio: best_bare.wall_s / best.wall_s,
                cpu_ratio: best_bare.cpu_s / best.cpu_s,
            });
        }
    }
    Ok(out)
}

/// A batch and a bare loop with the same workload.
struct Sides<'a, 'b> {
    simulator: Box<dyn Simulator>,
    loops: &'b mut (dyn Bare + 'a),
    work: &'a Workload,
    sims: Vec<usize>,
    record: asid_core::Recording,
    readings: Vec<f64>,
}

impl<'a, 'b> Sides<'a, 'b> {
    fn new(
        mut simulator: Box<dyn Simulator>,
        loops: &'b mut (dyn Bare + 'a),
        task: &dyn Task,
        work: &'a Workload,
    ) -> Result<Self> {
        let sims: Vec<usize> = (0..work.sims).collect();
        simulator.set_parameters(&sims, &work.values)?;
        let record = simulator
            .layout()
            .recording(&task.exploration().channels())?;
        Ok(Self {
            readings: vec![0.0; work.sims * work.frames * record.width()],
            simulator,
            loops,
            work,
            sims,
            record,
        })
    }

    fn batch(&mut self) -> Result<Cost> {
        let work = self.work;
        self.simulator.reset(&self.sims)?;
        self.simulator
            .set_state(&self.sims, &work.qpos, &work.qvel)?;
        let rollout = Rollout::new(
            &self.sims,
            work.frames,
            work.substeps,
            Control::PerSimulation(&work.control),
            &self.record,
        );
        let (done, cost) = timed(|| self.simulator.rollout(&rollout, &mut self.readings));
        done?;
        Ok(cost)
    }

    fn bare(&mut self, threads: usize) -> Result<Cost> {
        self.loops.rewind()?;
        Ok(timed(|| self.loops.run(threads)).1)
    }
}

/// The rows as a table.
pub fn table(rows: &[PhysicsRow]) -> Vec<Vec<String>> {
    rows.iter()
        .map(|r| {
            vec![
                r.engine.clone(),
                r.batch.to_string(),
                r.threads.to_string(),
                format!("{:.0}", r.steps_per_s),
                format!("{:.0}", r.bare_steps_per_s),
                format!("{:.2}", r.ratio),
                format!("{:.2}", r.cpu_ratio),
            ]
        })
        .collect()
}
