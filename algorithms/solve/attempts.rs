//! Simulated attempts at a task, over draws from a belief.

use asid_core::problem::Batch;
use asid_core::rng::Rng;
use asid_core::{Control, Posterior, Problem, Recording, Result, Rollout};
use asid_readings::SignalSet;
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};

/// What attempts start from: unknowns, start poses, and what the trackers show of the latter.
#[derive(Clone, Debug, Default)]
pub struct Situations {
    /// Unknowns, `n x unknowns`.
    theta: Vec<f64>,
    /// Start poses, `n x coordinates`.
    starts: Vec<f64>,
    /// Start pose that a noisy reading shows, one per situation.
    pub believed: Vec<Vec<f64>>,
}

impl Situations {
    /// Number of situations.
    #[must_use]
    pub fn len(&self) -> usize {
        self.believed.len()
    }

    /// Whether there are no situations.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.believed.is_empty()
    }
}

/// Runs attempts in batches of at most a fixed size.
pub struct Attempts<'a> {
    problem: &'a Problem<'a>,
    belief: Posterior,
    batch: Batch,
    signals: SignalSet,
    tracked: Recording,
    recording: Recording,
    substeps: usize,
}

impl<'a> Attempts<'a> {
    /// Prepares up to `size` simultaneous attempts.
    ///
    /// # Errors
    /// When the engine lacks a channel of the task or cannot set an unknown.
    pub fn new(problem: &'a Problem<'a>, belief: &Posterior, size: usize) -> Result<Self> {
        let protocol = problem.task.downstream();
        let layout = problem.model.layout();
        let names: Vec<&str> = problem.signals.iter().map(|s| &*s.sensor).collect();
        Ok(Self {
            batch: problem.batch(size)?,
            signals: SignalSet::new(layout, problem.signals)?,
            tracked: layout.recording(&names)?,
            recording: layout.recording(&protocol.channels)?,
            substeps: problem.substeps(protocol.frame_period)?,
            problem,
            belief: belief.clone(),
        })
    }

    /// Draws `n` situations: unknowns from the belief, start poses from their range, and sensor
    /// noise.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn draw(&mut self, n: usize, rng: &mut Rng) -> Result<Situations> {
        let problem = self.problem;
        let protocol = problem.task.downstream();
        let sims: Vec<usize> = (0..n).collect();
        let theta = self.belief.resample(n, rng).concat();
        let starts: Vec<f64> = (0..n)
            .flat_map(|_| {
                protocol
                    .start
                    .iter()
                    .map(|c| c.at(rng.random()))
                    .collect::<Vec<_>>()
            })
            .collect();
        self.batch.set_parameters(&sims, &theta)?;
        self.batch.place(problem.task, &sims, &starts)?;
        let width = self.tracked.width();
        let mut seen = vec![0.0; n * width];
        self.batch.simulator.read(&sims, &self.tracked, &mut seen)?;
        let believed = seen
            .chunks_exact_mut(width)
            .map(|reading| {
                self.signals
                    .add_noise(reading, || StandardNormal.sample(rng));
                problem.task.locate(reading)
            })
            .collect();
        Ok(Situations {
            theta,
            starts,
            believed,
        })
    }

    /// Cost of an attempt in each situation, with `actions[i]` in the `i`-th.
    ///
    /// # Errors
    /// When the engine fails or the task cannot turn an action into commands.
    pub fn costs(&mut self, situations: &Situations, actions: &[&[f64]]) -> Result<Vec<f64>> {
        self.repeated(situations, 1, actions)
    }

    /// Mean cost of each action over all situations.
    ///
    /// # Errors
    /// As [`Self::costs`].
    pub fn mean_costs(
        &mut self,
        situations: &Situations,
        actions: &[Vec<f64>],
    ) -> Result<Vec<f64>> {
        let samples = situations.len();
        let each: Vec<&[f64]> = actions
            .iter()
            .flat_map(|a| std::iter::repeat_n(&**a, samples))
            .collect();
        let costs = self.repeated(situations, actions.len(), &each)?;
        Ok(costs
            .chunks_exact(samples)
            .map(|c| c.iter().sum::<f64>() / samples as f64)
            .collect())
    }

    /// Runs attempts in all situations `times` times; `actions` has one action per situation each
    /// time.
    fn repeated(
        &mut self,
        situations: &Situations,
        times: usize,
        actions: &[&[f64]],
    ) -> Result<Vec<f64>> {
        let problem = self.problem;
        let protocol = problem.task.downstream();
        let n = situations.len() * times;
        debug_assert_eq!(actions.len(), n);
        let sims: Vec<usize> = (0..n).collect();
        self.batch
            .set_parameters(&sims, &situations.theta.repeat(times))?;
        self.batch
            .place(problem.task, &sims, &situations.starts.repeat(times))?;
        let nu = problem.model.layout().nu();
        let mut control = Vec::with_capacity(n * protocol.frames * nu);
        for (action, start) in actions.iter().zip(situations.believed.iter().cycle()) {
            control.extend(problem.task.attempt(start, action)?);
        }
        let width = self.recording.width();
        let mut readings = vec![0.0; n * protocol.frames * width];
        let before = self.batch.simulator.steps_taken();
        let rollout = Rollout::new(
            &sims,
            protocol.frames,
            self.substeps,
            Control::PerSimulation(&control),
            &self.recording,
        );
        self.batch.simulator.rollout(&rollout, &mut readings)?;
        problem.count_physics(&self.batch, before);
        Ok(readings
            .chunks_exact(protocol.frames * width)
            .map(|r| problem.task.outcome(r).cost)
            .collect())
    }
}
