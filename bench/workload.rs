//! The simulated workload: simulations of one task, each with its own parameter value, initial
//! state and commands.

use anyhow::Result;
use asid_core::layout::Layout;
use asid_core::problem::{home, substeps};
use asid_core::rng::Rng;
use asid_core::{Parameter, Streams, Target, Task};
use rand::Rng as _;

/// Control steps for which a random push keeps its direction.
///
/// A walk that changes direction at every step stays where it is and rarely meets the object.
const HELD: usize = 5;

/// Simulations to run; arrays have one row per simulation.
pub struct Workload {
    /// Number of simulations.
    pub sims: usize,
    /// Targets that [`Workload::values`] sets.
    pub targets: Vec<Target>,
    /// Parameter values, `sims x targets`.
    pub values: Vec<f64>,
    /// Initial positions, `sims x nq`.
    pub qpos: Vec<f64>,
    /// Initial velocities, `sims x nv`.
    pub qvel: Vec<f64>,
    /// Commands, `sims x frames x nu`.
    pub control: Vec<f64>,
    /// Frames per simulation.
    pub frames: usize,
    /// Physics steps per frame.
    pub substeps: usize,
    /// Number of entries of a command.
    pub nu: usize,
}

/// Exploration episodes before they are laid out for an engine.
pub struct Episodes {
    /// Control steps.
    pub horizon: usize,
    /// Unknowns, `episodes x d`.
    pub theta: Vec<f64>,
    /// Initial poses, `episodes x coordinates`.
    pub starts: Vec<f64>,
    /// Actions by control step: `horizon` rows of `episodes x action`.
    pub actions: Vec<Vec<f64>>,
}

impl Episodes {
    /// Random episodes: unknowns and initial poses from their priors, and pushes that keep their
    /// direction for half a second.
    pub fn random(task: &dyn Task, parameters: &[Parameter], episodes: usize, seed: u64) -> Self {
        let mut rng: Rng = Streams::new(seed).stream("bench");
        let protocol = task.exploration();
        let draw = |rng: &mut Rng, c: &asid_core::task::Coordinate| c.at(rng.random());
        let mut theta = Vec::new();
        let mut starts = Vec::new();
        for _ in 0..episodes {
            theta.extend(parameters.iter().map(|p| p.sample(&mut rng)));
            starts.extend(protocol.start.iter().map(|c| draw(&mut rng, c)));
        }
        let mut actions: Vec<Vec<f64>> = Vec::with_capacity(protocol.horizon);
        for step in 0..protocol.horizon {
            let row = match actions.last() {
                Some(last) if step % HELD != 0 => last.clone(),
                _ => (0..episodes)
                    .flat_map(|_| &protocol.action)
                    .map(|c| draw(&mut rng, c))
                    .collect(),
            };
            actions.push(row);
        }
        Self {
            horizon: protocol.horizon,
            theta,
            starts,
            actions,
        }
    }

    /// Commands of every episode, `episodes x frames x nu`.
    ///
    /// # Errors
    /// If the task has no commander.
    pub fn commands(&self, task: &dyn Task, nu: usize) -> Result<Vec<f64>> {
        let protocol = task.exploration();
        let (block, width) = (protocol.frames_per_step * nu, protocol.action.len());
        let episodes = self.actions[0].len() / width;
        let mut out = vec![0.0; episodes * self.horizon * block];
        let mut commander = task.commander()?;
        for (e, rows) in out.chunks_exact_mut(self.horizon * block).enumerate() {
            commander.reset();
            for (step, row) in rows.chunks_exact_mut(block).enumerate() {
                commander.commands(&self.actions[step][e * width..(e + 1) * width], row);
            }
        }
        Ok(out)
    }
}

impl Workload {
    /// The episodes as simulations: `copies` of each, with the unknowns `theta`
    /// (`episodes x copies x d`).
    ///
    /// # Errors
    /// If the layout is not that of the task's scene.
    pub fn new(
        task: &dyn Task,
        layout: &Layout,
        parameters: &[Parameter],
        episodes: &Episodes,
        theta: &[f64],
        copies: usize,
    ) -> Result<Self> {
        let protocol = task.exploration();
        let (d, k) = (parameters.len(), protocol.start.len());
        let sims = theta.len() / d;
        let nu = layout.nu();
        let frames = protocol.frames();
        let commands = episodes.commands(task, nu)?;
        let (home_qpos, home_qvel) = home(layout);
        let mut out = Self {
            sims,
            targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
            values: Vec::new(),
            qpos: Vec::with_capacity(sims * layout.nq),
            qvel: home_qvel.repeat(sims),
            control: Vec::with_capacity(sims * frames * nu),
            frames,
            substeps: substeps(layout, protocol.frame_period)?,
            nu,
        };
        for sim in 0..sims {
            let e = sim / copies;
            for (parameter, &x) in parameters.iter().zip(&theta[sim * d..(sim + 1) * d]) {
                out.values
                    .extend(std::iter::repeat_n(x, parameter.targets.len()));
            }
            out.qpos.extend_from_slice(&home_qpos);
            let at = out.qpos.len() - layout.nq;
            let start = &episodes.starts[e * k..(e + 1) * k];
            task.place(layout, start, &mut out.qpos[at..])?;
            let row = frames * nu;
            out.control
                .extend_from_slice(&commands[e * row..(e + 1) * row]);
        }
        Ok(out)
    }

    /// The same workload with fewer frames.
    pub fn shortened(mut self, frames: usize) -> Self {
        let old = self.frames * self.nu;
        let new = frames.min(self.frames) * self.nu;
        let rows = self.control.chunks_exact(old);
        self.control = rows.flat_map(|row| row[..new].iter().copied()).collect();
        self.frames = frames.min(self.frames);
        self
    }

    /// Physics steps of all simulations.
    pub fn steps(&self) -> u64 {
        (self.sims * self.frames * self.substeps) as u64
    }

    /// Row `i` of an array with one row per simulation.
    pub fn row<'a>(&self, array: &'a [f64], i: usize) -> &'a [f64] {
        let width = array.len() / self.sims;
        &array[i * width..(i + 1) * width]
    }
}
