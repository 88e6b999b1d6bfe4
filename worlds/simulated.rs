//! A simulator that plays the real world: a hidden truth, its own start poses, noisy trackers.

mod close_look;
mod pairs;
mod tracker;

use std::sync::atomic::{AtomicU64, Ordering};

use rand_distr::{Distribution, StandardNormal};

use asid_core::backend::Model;
use asid_core::episode::{ChannelColumns, Episode};
use asid_core::error::blames_a_plugin;
use asid_core::error::{Error, Result};
use asid_core::explore::Policy;
use asid_core::layout::Layout;
use asid_core::parameter::Parameter;
use asid_core::problem::{Batch, Problem, substeps};
use asid_core::progress::Silent;
use asid_core::real_world::{Attempt, RealEpisode, RealWorld};
use asid_core::rng::{Rng, Streams};
use asid_core::signal::Signal;
use asid_core::simulator::{Control, Rollout, Status};
use asid_core::solve::TaskPolicy;
use asid_core::task::Task;
use asid_core::tracker::ReadingFrames;
use asid_readings::SignalSet;
use close_look::CloseLook;
use pairs::{Pairs, note};
use tracker::Tracker;
pub use tracker::TrackerErrors;

/// Index of the simulation that is the world.
const WORLD: usize = 0;

/// Index of the copy that is read after every physics step.
const COPY: usize = 1;

/// A simulator with a hidden truth, its own start poses and noisy trackers.
///
/// Everything random in it has its own stream: the start pose and the noise of an exploration
/// (`exploration start`, `exploration noise`) and of an attempt (`task start`, `task noise`), wear
/// (`wear`, one index per play), and lost tracker readings. The random numbers that a method meets
/// therefore do not depend on its earlier actions: methods with the same seed meet the same ones.
pub struct SimulatedWorld<'a> {
    task: &'a dyn Task,
    parameters: &'a [Parameter],
    batch: Batch,
    signals: SignalSet,
    truth: Vec<f64>,
    streams: Streams,
    tracker: TrackerErrors,
    /// Number of episodes and attempts played.
    plays: u64,
    start: Option<Vec<f64>>,
}

impl<'a> SimulatedWorld<'a> {
    /// A world of `model` in which `parameters` have the values `truth`.
    ///
    /// Its trackers have the noise of `signals`; start poses and noise are drawn from `streams`.
    ///
    /// # Errors
    /// When the model is not that of the task's scene.
    pub fn new(
        task: &'a dyn Task,
        model: &dyn Model,
        parameters: &'a [Parameter],
        truth: &[f64],
        signals: &[Signal],
        streams: Streams,
    ) -> Result<Self> {
        let steps = AtomicU64::new(0);
        let problem = Problem {
            task,
            model,
            capabilities: asid_core::Capabilities::empty(),
            parameters,
            signals,
            threads: 1,
            streams,
            progress: &Silent,
            physics_counter: &steps,
            env_counter: &steps,
        };
        let batch = problem.batch(2)?;
        let signals = SignalSet::new(model.layout(), signals)?;
        Ok(Self {
            task,
            parameters,
            batch,
            signals,
            truth: truth.to_vec(),
            streams,
            tracker: TrackerErrors::default(),
            plays: 0,
            start: None,
        })
    }

    /// Adds systematic errors to the tracker, in exploration and in attempts.
    ///
    /// # Errors
    /// When the errors make no sense or do not match the tracked signals.
    pub fn with_tracker(mut self, tracker: TrackerErrors) -> Result<Self> {
        tracker.check(&self.signals)?;
        self.tracker = tracker;
        Ok(self)
    }

    /// Fixes the start pose of the exploration episode.
    #[must_use]
    pub fn with_exploration_start(mut self, start: Vec<f64>) -> Self {
        self.start = Some(start);
        self
    }

    /// The start pose with which the exploration episode will begin.
    #[must_use]
    pub fn exploration_start(&self) -> Vec<f64> {
        self.start.clone().unwrap_or_else(|| {
            draw(
                &self.task.exploration().start,
                &mut self.streams.stream("exploration start"),
            )
        })
    }

    /// Adds the physics steps taken in this world to `counter`.
    pub fn count_physics(&self, counter: &AtomicU64) {
        counter.fetch_add(self.batch.simulator.steps_taken(), Ordering::Relaxed);
    }

    /// The present true values, wear included.
    #[must_use]
    pub fn truth(&self) -> &[f64] {
        &self.truth
    }

    fn wear(&mut self) {
        let mut chance = self.streams.indexed("wear", self.plays);
        self.plays += 1;
        self.task
            .wear(self.parameters, &mut self.truth, &mut chance);
    }

    fn begin(&mut self, start: &[f64]) -> Result<()> {
        let both = self.truth.repeat(2);
        let set = self.batch.set_parameters(&[WORLD, COPY], &both);
        set.map_err(|e| self.of_truth(e))?;
        self.batch.place(self.task, &[WORLD], start)
    }

    /// An engine's refusal of a parameter as an error about the unknown and its true value.
    fn of_truth(&self, error: Error) -> Error {
        let Error::Parameter { parameter, message } = error else {
            return error;
        };
        let own = |p: &Parameter| {
            p.name == parameter || p.targets.iter().any(|t| t.to_string() == parameter)
        };
        match self.parameters.iter().position(own) {
            Some(i) => Error::Parameter {
                parameter: self.parameters[i].name.clone(),
                message: format!(
                    "the real world cannot have its true value of {}: {message}",
                    self.truth[i]
                ),
            },
            None => Error::Parameter { parameter, message },
        }
    }

    /// Fails where a plugin's effect ended the simulation; a simulation that diverged by itself
    /// passes.
    fn check(&self) -> Result<()> {
        match &self.batch.simulator.status()[WORLD] {
            Status::Diverged { message, .. } if blames_a_plugin(message) => {
                Err(Error::Failed(message.clone()))
            }
            _ => Ok(()),
        }
    }
}

/// An empty log.
fn blank(layout: &Layout, channels: &[String]) -> Result<Episode> {
    let columns = |name: &String| -> Result<ChannelColumns> {
        Ok(ChannelColumns {
            name: name.clone(),
            len: layout.sensor(name)?.len,
        })
    };
    Ok(Episode {
        actuators: layout.actuators.iter().map(|a| a.name.clone()).collect(),
        channels: channels.iter().map(columns).collect::<Result<_>>()?,
        ..Episode::default()
    })
}

fn draw(coordinates: &[asid_core::task::Coordinate], rng: &mut Rng) -> Vec<f64> {
    use rand::Rng as _;
    coordinates.iter().map(|c| c.at(rng.random())).collect()
}

impl RealWorld for SimulatedWorld<'_> {
    fn explore(&mut self, policy: &mut dyn Policy) -> Result<RealEpisode> {
        let protocol = self.task.exploration();
        let start = self.exploration_start();
        self.begin(&start)?;
        let layout = self.batch.simulator.layout().clone();
        let names = protocol.channels();
        let mut pairs = Pairs::of(self.task);
        let mut all = names.clone();
        all.extend(pairs.channels.iter().cloned());
        let recording = layout.recording(&all)?;
        let width = layout.recording(&names)?.width();
        let tracked = self.signals.width();
        let substeps = substeps(&layout, protocol.frame_period)?;
        let (frames, nu) = (protocol.frames_per_step, layout.nu());
        let chance = ["exploration noise", "exploration losses"].map(|n| self.streams.stream(n));
        let rate = ReadingFrames::of(self.task, protocol.frame_period);
        let errors = (&self.signals, &self.tracker);
        let mut tracker = Tracker::new(errors, rate, &layout, substeps, chance);
        let mut look = CloseLook::new(recording.clone(), COPY, frames, substeps);
        let looks = tracker.late > 0 || recording.width() > width;
        let mut commander = self.task.commander()?;
        commander.reset();
        policy.reset();

        let mut episode = blank(&layout, &names)?;
        let all_width = recording.width();
        let mut row = vec![0.0; all_width];
        let simulator = &mut *self.batch.simulator;
        simulator.read(&[WORLD], &recording, &mut row)?;
        tracker.begin(&row);
        row.truncate(width);
        let mut true_readings = row.clone();
        tracker.read(&mut row);
        episode.readings.extend_from_slice(&row);
        // Where a reading is missing the policy keeps the last one, as a tracker's driver does.
        let mut latest = row;
        let mut action = vec![0.0; protocol.action.len()];
        let mut ctrl = vec![0.0; frames * nu];
        let mut out = vec![0.0; frames * all_width];
        let mut touched = vec![false; pairs.channels.len()];
        let mut actions = Vec::new();
        for step in 0..protocol.horizon {
            policy.act(step, &latest, &mut action)?;
            for (a, c) in action.iter_mut().zip(&protocol.action) {
                *a = a.clamp(c.range[0], c.range[1]);
            }
            actions.extend_from_slice(&action);
            commander.commands(&action, &mut ctrl);
            let simulator = &mut *self.batch.simulator;
            touched.fill(false);
            if looks {
                look.play(simulator, WORLD, &ctrl)?;
                look.rows().for_each(|r| note(&r[width..], &mut touched));
                tracker.look(look.rows());
            }
            let control = Control::Shared(&ctrl);
            let rollout = Rollout::new(&[WORLD], frames, substeps, control, &recording);
            simulator.rollout(&rollout, &mut out)?;
            self.check()?;
            episode.ctrl.extend_from_slice(&ctrl);
            for frame in out.chunks_exact(all_width) {
                note(&frame[width..], &mut touched);
                true_readings.extend_from_slice(&frame[..width]);
                let mut seen = frame[..width].to_vec();
                if tracker.read(&mut seen) {
                    latest.copy_from_slice(&seen);
                } else {
                    latest[tracked..].copy_from_slice(&seen[tracked..]);
                    seen[..tracked].fill(f64::NAN);
                }
                episode.readings.extend_from_slice(&seen);
            }
            pairs.count(&touched);
        }
        self.wear();
        episode.close(protocol.frame_period);
        let (contact_fraction, touched) = pairs.shares(protocol.horizon);
        Ok(RealEpisode {
            episode,
            actions,
            contact_fraction,
            touched,
            true_start: Some(start),
            true_readings: Some(true_readings),
        })
    }

    fn attempt(&mut self, policy: &mut dyn TaskPolicy) -> Result<Attempt> {
        let protocol = self.task.downstream();
        let mut rng = self.streams.stream("task start");
        let start = draw(&protocol.start, &mut rng);
        self.begin(&start)?;
        let layout = self.batch.simulator.layout().clone();
        let signals = self.task.exploration().signals.iter();
        let tracked: Vec<String> = signals.map(|s| s.sensor.clone()).collect();
        let tracked = layout.recording(&tracked)?;
        let simulator = &mut *self.batch.simulator;
        let mut seen = vec![0.0; self.signals.width()];
        simulator.read(&[WORLD], &tracked, &mut seen)?;
        self.tracker.shift(&self.signals, &mut seen);
        self.signals
            .add_noise(&mut seen, || StandardNormal.sample(&mut rng));
        let believed = self.task.locate(&seen);
        let mut action = vec![0.0; protocol.action.len()];
        policy.act(&believed, &mut action)?;
        let ctrl = self.task.attempt(&believed, &action)?;
        // Channels of the metric first, then those of the log.
        let names = self.task.exploration().channels();
        let mut all = protocol.channels.clone();
        all.extend(names.iter().cloned());
        let recording = layout.recording(&all)?;
        let width = recording.width();
        let own = layout.recording(&protocol.channels)?.width();
        let substeps = substeps(&layout, protocol.frame_period)?;
        let chance = ["task noise", "task losses"].map(|n| self.streams.stream(n));
        let rate = ReadingFrames::of(self.task, protocol.frame_period);
        let errors = (&self.signals, &self.tracker);
        let mut tracker = Tracker::new(errors, rate, &layout, substeps, chance);
        let simulator = &mut *self.batch.simulator;
        let mut out = vec![0.0; (protocol.frames + 1) * width];
        let (first, frames) = out.split_at_mut(width);
        simulator.read(&[WORLD], &recording, first)?;
        tracker.begin(&first[own..]);
        if tracker.late > 0 {
            let mut look = CloseLook::new(tracked, COPY, protocol.frames, substeps);
            look.play(simulator, WORLD, &ctrl)?;
            tracker.look(look.rows());
        }
        let control = Control::Shared(&ctrl);
        let rollout = Rollout::new(&[WORLD], protocol.frames, substeps, control, &recording);
        simulator.rollout(&rollout, frames)?;
        self.check()?;
        let readings: Vec<f64> = frames
            .chunks_exact(width)
            .flat_map(|row| row[..own].to_vec())
            .collect();
        let mut episode = blank(&layout, &names)?;
        for row in out.chunks_exact_mut(width) {
            let seen = &mut row[own..];
            if !tracker.read(seen) {
                seen[..self.signals.width()].fill(f64::NAN);
            }
            episode.readings.extend_from_slice(seen);
        }
        self.wear();
        episode.ctrl = ctrl;
        episode.close(protocol.frame_period);
        Ok(Attempt {
            outcome: self.task.outcome(&readings),
            action,
            believed_start: believed,
            readings,
            episode,
        })
    }
}
