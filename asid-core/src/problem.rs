//! Input of an algorithm: a task, an engine, the unknowns, seed and threads.

use std::sync::atomic::{AtomicU64, Ordering};

use crate::backend::{Capabilities, Model};
use crate::error::{Error, Result};
use crate::layout::Layout;
use crate::parameter::Parameter;
use crate::progress::Progress;
use crate::rng::Streams;
use crate::signal::Signal;
use crate::simulator::{BatchConfig, Simulator};
use crate::task::Task;

/// A task on an engine, with the unknowns to identify.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The task.
    pub task: &'a dyn Task,
    /// The scene, compiled by the engine that the method may use.
    pub model: &'a dyn Model,
    /// Capabilities of that engine.
    pub capabilities: Capabilities,
    /// The unknowns.
    pub parameters: &'a [Parameter],
    /// The tracked signals, with their assumed noise.
    pub signals: &'a [Signal],
    /// Threads; 0 for one a core.
    pub threads: usize,
    /// Random streams.
    pub streams: Streams,
    /// Receiver of progress reports.
    pub progress: &'a dyn Progress,
    /// Physics steps taken so far.
    pub physics_counter: &'a AtomicU64,
    /// Control steps of exploration episodes simulated so far.
    pub env_counter: &'a AtomicU64,
}

impl Problem<'_> {
    /// A batch of `size` simulations whose columns are the unknowns.
    ///
    /// # Errors
    /// When the engine cannot set one of the unknowns.
    pub fn batch(&self, size: usize) -> Result<Batch> {
        let targets = self
            .parameters
            .iter()
            .flat_map(|p| p.targets.iter().cloned())
            .collect();
        let simulator = self.model.simulator(&BatchConfig {
            size,
            threads: self.threads,
            targets,
        })?;
        Ok(Batch {
            parameters: self.parameters.to_vec(),
            home: home(self.model.layout()),
            columns: Vec::new(),
            simulator,
        })
    }

    /// Counts the physics steps that `batch` took.
    pub fn count_physics(&self, batch: &Batch, before: u64) {
        self.physics_counter
            .fetch_add(batch.simulator.steps_taken() - before, Ordering::Relaxed);
    }

    /// Physics steps counted so far.
    #[must_use]
    pub fn physics_steps(&self) -> u64 {
        self.physics_counter.load(Ordering::Relaxed)
    }

    /// Physics steps of one frame.
    ///
    /// # Errors
    /// When the frame is not a whole number of physics steps.
    pub fn substeps(&self, frame_period: f64) -> Result<usize> {
        substeps(self.model.layout(), frame_period)
    }
}

/// Physics steps of a frame of `frame_period` seconds.
///
/// # Errors
/// When the frame is not a whole number of physics steps.
pub fn substeps(layout: &Layout, frame_period: f64) -> Result<usize> {
    let ratio = frame_period / layout.timestep;
    let whole = ratio.round();
    if whole < 1.0 || (ratio - whole).abs() > 1e-6 * whole {
        return Err(Error::Parameter {
            parameter: "option/timestep".into(),
            message: format!(
                "a frame of {frame_period} s is not a whole number of physics steps of {} s",
                layout.timestep
            ),
        });
    }
    Ok(whole as usize)
}

/// Positions and velocities of the first keyframe; without one, zeros with unit quaternions.
#[must_use]
pub fn home(layout: &Layout) -> (Vec<f64>, Vec<f64>) {
    if let Some(key) = layout.keyframes.first() {
        return (key.qpos.clone(), key.qvel.clone());
    }
    let mut qpos = vec![0.0; layout.nq];
    for joint in &layout.joints {
        match joint.kind {
            crate::layout::JointKind::Free => qpos[joint.qpos + 3] = 1.0,
            crate::layout::JointKind::Ball => qpos[joint.qpos] = 1.0,
            _ => {}
        }
    }
    (qpos, vec![0.0; layout.nv])
}

/// A simulator whose parameter columns are the problem's unknowns.
pub struct Batch {
    /// The simulator.
    pub simulator: Box<dyn Simulator>,
    parameters: Vec<Parameter>,
    home: (Vec<f64>, Vec<f64>),
    columns: Vec<f64>,
}

impl Batch {
    /// Sets the unknowns of some simulations: `sims x d`, in their units.
    ///
    /// # Errors
    /// As [`Simulator::set_parameters`].
    pub fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        let d = self.parameters.len();
        self.columns.clear();
        for row in values.chunks_exact(d.max(1)) {
            for (&x, p) in row.iter().zip(&self.parameters) {
                self.columns
                    .extend(std::iter::repeat_n(p.setting(x), p.targets.len()));
            }
        }
        self.simulator.set_parameters(sims, &self.columns)
    }

    /// Resets simulations and places the object: `starts` is `sims x start coordinates`.
    ///
    /// # Errors
    /// As [`Task::place`] and [`Simulator::set_state`].
    pub fn place(&mut self, task: &dyn Task, sims: &[usize], starts: &[f64]) -> Result<()> {
        self.simulator.reset(sims)?;
        let k = starts.len() / sims.len().max(1);
        let (nq, nv) = (self.home.0.len(), self.home.1.len());
        let mut qpos = Vec::with_capacity(sims.len() * nq);
        for i in 0..sims.len() {
            qpos.extend_from_slice(&self.home.0);
            task.place(
                self.simulator.layout(),
                &starts[i * k..(i + 1) * k],
                &mut qpos[i * nq..],
            )?;
        }
        let qvel = self.home.1.repeat(sims.len());
        debug_assert_eq!(qvel.len(), sims.len() * nv);
        self.simulator.set_state(sims, &qpos, &qvel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: "config timestep", a key that no configuration has. Cause: the time step belongs to
    /// the model.
    #[test]
    fn a_frame_that_no_steps_fill_names_the_models_option() {
        let layout = Layout {
            timestep: 0.01,
            ..Layout::default()
        };
        assert_eq!(substeps(&layout, 0.05).unwrap(), 5);
        let error = substeps(&layout, 0.015).unwrap_err().to_string();
        assert!(error.starts_with("parameter `option/timestep`"), "{error}");
    }
}
