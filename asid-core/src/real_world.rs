//! The real world: what answers with one episode, and lets a task be tried once.

use std::sync::atomic::{AtomicU64, Ordering};

use rand_distr::{Distribution, StandardNormal};

use crate::backend::Model;
use crate::episode::{ChannelColumns, Episode};
use crate::error::{Error, Result};
use crate::explore::Policy;
use crate::layout::{Layout, Recording};
use crate::parameter::Parameter;
use crate::plugin::blames_a_plugin;
use crate::problem::{Batch, Problem, substeps};
use crate::progress::Silent;
use crate::rng::{Rng, Streams};
use crate::signal::{Signal, SignalSet};
use crate::simulator::{Control, Rollout, Simulator, Status};
use crate::solve::TaskPolicy;
use crate::task::{Outcome, Task};
use crate::tracker::ReadingFrames;

/// An episode as it was, and what only a simulated world can tell of it.
#[derive(Clone, Debug)]
pub struct RealEpisode {
    /// The log.
    pub episode: Episode,
    /// Actions of the policy, `horizon x action`, in the task's units.
    pub actions: Vec<f64>,
    /// Share of control steps in which the machine touched the object, as seen after every
    /// physics step: a touch can be shorter than a frame.
    pub contact_fraction: f64,
    /// The same share for each of the task's objects by itself.
    pub touched: Vec<f64>,
    /// True start pose, where it is known.
    pub true_start: Option<Vec<f64>>,
}

/// One attempt at the task.
#[derive(Clone, Debug)]
pub struct Attempt {
    /// What came of it.
    pub outcome: Outcome,
    /// The action.
    pub action: Vec<f64>,
    /// Start pose that the machine believed in.
    pub believed_start: Vec<f64>,
    /// Readings of the task's channels, `frames x width`.
    pub readings: Vec<f64>,
    /// The log: commands, and what trackers and the machine's own sensors read.
    pub episode: Episode,
}

/// What can be explored once and tried once.
pub trait RealWorld {
    /// Plays a policy for one episode.
    ///
    /// # Errors
    /// When the policy or the world fails.
    fn explore(&mut self, policy: &mut dyn Policy) -> Result<RealEpisode>;

    /// Tries the task once.
    ///
    /// # Errors
    /// When the policy or the world fails.
    fn attempt(&mut self, policy: &mut dyn TaskPolicy) -> Result<Attempt>;
}

/// The simulation beside the world's own, which is 0.
const COPY: usize = 1;

/// A simulator with a hidden truth, its own start poses and noisy trackers.
pub struct SimulatedWorld<'a> {
    task: &'a dyn Task,
    parameters: &'a [Parameter],
    batch: Batch,
    signals: SignalSet,
    truth: Vec<f64>,
    streams: Streams,
    wear: Rng,
    start: Option<Vec<f64>>,
}

impl<'a> SimulatedWorld<'a> {
    /// A world of `model` whose `parameters` have the values `truth` and whose trackers
    /// have the noise of `signals`; `streams` draws start poses and noise.
    ///
    /// # Errors
    /// When the model is not one of the task's scene.
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
            capabilities: crate::Capabilities::empty(),
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
            wear: streams.stream("wear"),
            start: None,
        })
    }

    /// The same world, whose exploration episode begins with this start pose.
    #[must_use]
    pub fn with_exploration_start(mut self, start: Vec<f64>) -> Self {
        self.start = Some(start);
        self
    }

    /// The start pose that the world will begin its exploration episode with.
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

    /// The true values as they are by now.
    #[must_use]
    pub fn truth(&self) -> &[f64] {
        &self.truth
    }

    fn wear(&mut self) {
        self.task
            .wear(self.parameters, &mut self.truth, &mut self.wear);
    }

    fn begin(&mut self, start: &[f64]) -> Result<()> {
        let both = self.truth.repeat(2);
        self.batch.set_parameters(&[0, COPY], &both)?;
        self.batch.place(self.task, &[0], start)
    }

    /// Whether the simulation goes on; one that a plugin's effect ended does not count.
    fn check(&self) -> Result<()> {
        match &self.batch.simulator.status()[0] {
            Status::Diverged { message, .. } if blames_a_plugin(message) => {
                Err(Error::Failed(message.clone()))
            }
            _ => Ok(()),
        }
    }
}

/// Looks for touches between the frames. A copy of the world plays the control step and is read
/// after every physics step, so that looking leaves the world as it is.
struct Touch {
    recording: Recording,
    frames: usize,
    substeps: usize,
    ctrl: Vec<f64>,
    forces: Vec<f64>,
}

impl Touch {
    /// Of these channels, in control steps of so many frames and physics steps a frame.
    fn new(layout: &Layout, channels: &[String], frames: usize, substeps: usize) -> Result<Self> {
        let recording = layout.recording(channels)?;
        Ok(Self {
            ctrl: vec![0.0; frames * substeps * layout.nu()],
            forces: vec![0.0; frames * substeps * recording.width()],
            recording,
            frames,
            substeps,
        })
    }

    /// Notes the channels of which a force is seen after any physics step of a control step that
    /// the copy plays.
    fn between(
        &mut self,
        simulator: &mut dyn Simulator,
        ctrl: &[f64],
        touched: &mut [bool],
    ) -> Result<()> {
        if self.forces.is_empty() {
            return Ok(());
        }
        let nu = ctrl.len() / self.frames;
        let steps = self.frames * self.substeps;
        for i in 0..steps {
            self.ctrl[i * nu..][..nu].copy_from_slice(&ctrl[i / self.substeps * nu..][..nu]);
        }
        let control = Control::Shared(&self.ctrl);
        let rollout = Rollout::new(&[COPY], steps, 1, control, &self.recording);
        simulator.rollout(&rollout, &mut self.forces)?;
        self.forces
            .chunks_exact(touched.len())
            .for_each(|row| note(row, touched));
        Ok(())
    }
}

/// Notes where there is a force.
fn note(forces: &[f64], touched: &mut [bool]) {
    for (touched, force) in touched.iter_mut().zip(forces) {
        *touched |= *force > 0.0;
    }
}

/// Pairs of bodies whose contact is looked for, and which of them count for what.
struct Pairs {
    /// Channels of contact force, each once.
    channels: Vec<String>,
    /// Channels that count as interaction, then those of each of the task's objects.
    counted: Vec<Vec<usize>>,
    /// Control steps in which one of them had a force.
    steps: Vec<usize>,
}

impl Pairs {
    fn of(task: &dyn Task) -> Self {
        let objects = task.objects().into_iter().map(|o| o.contact);
        let groups = std::iter::once(task.exploration().contact.clone()).chain(objects);
        let mut channels: Vec<String> = Vec::new();
        let mut place = |[a, b]: [String; 2]| {
            let name = format!("contact.{a}/{b}");
            let found = channels.iter().position(|c| *c == name);
            found.unwrap_or_else(|| {
                channels.push(name);
                channels.len() - 1
            })
        };
        let counted: Vec<Vec<usize>> = groups
            .map(|pairs| pairs.into_iter().map(&mut place).collect())
            .collect();
        Self {
            steps: vec![0; counted.len()],
            counted,
            channels,
        }
    }

    /// Counts a control step with these forces seen, a flag a channel.
    fn count(&mut self, touched: &[bool]) {
        for (steps, pairs) in self.steps.iter_mut().zip(&self.counted) {
            *steps += usize::from(pairs.iter().any(|&i| touched[i]));
        }
    }

    /// Shares of `horizon` control steps: of interaction, and of each object's.
    fn shares(&self, horizon: usize) -> (f64, Vec<f64>) {
        let mut shares = self.steps.iter().map(|&n| n as f64 / horizon as f64);
        (shares.next().unwrap_or_default(), shares.collect())
    }
}

/// A log without rows.
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

/// Times of the start and of the ends of frames, s, without the dust of products.
fn times(frames: usize, period: f64) -> Vec<f64> {
    let at = |k| (k as f64 * period * 1e9).round() / 1e9;
    (0..=frames).map(at).collect()
}

fn draw(coordinates: &[crate::task::Coordinate], rng: &mut Rng) -> Vec<f64> {
    use rand::Rng as _;
    coordinates.iter().map(|c| c.at(rng.random())).collect()
}

impl RealWorld for SimulatedWorld<'_> {
    fn explore(&mut self, policy: &mut dyn Policy) -> Result<RealEpisode> {
        let protocol = self.task.exploration();
        let start = self.exploration_start();
        self.begin(&start)?;
        let layout = self.batch.simulator.layout().clone();
        let mut noise = self.streams.stream("exploration noise");
        let names = protocol.channels();
        let mut pairs = Pairs::of(self.task);
        let mut all = names.clone();
        all.extend(pairs.channels.iter().cloned());
        let recording = layout.recording(&all)?;
        let width = layout.recording(&names)?.width();
        let substeps = substeps(&layout, protocol.frame_period)?;
        let mut touch = Touch::new(
            &layout,
            &all[names.len()..],
            protocol.frames_per_step,
            substeps,
        )?;
        let (frames, nu) = (protocol.frames_per_step, layout.nu());
        let mut commander = self.task.commander()?;
        commander.reset();
        policy.reset();

        let mut episode = blank(&layout, &names)?;
        let all_width = recording.width();
        let mut row = vec![0.0; all_width];
        self.batch.simulator.read(&[0], &recording, &mut row)?;
        let tracked = self.signals.width();
        let read = ReadingFrames::of(self.task, protocol.frame_period);
        // At another rate they are the same readings, some of them missing.
        let mut observe = |frame: usize, row: &[f64]| {
            let mut seen = row[..width].to_vec();
            self.signals
                .add_noise(&mut seen[..tracked], || StandardNormal.sample(&mut noise));
            if !read.has(frame) {
                seen[..tracked].fill(f64::NAN);
            }
            seen
        };
        episode.readings.extend(observe(0, &row));
        let mut action = vec![0.0; protocol.action.len()];
        let mut ctrl = vec![0.0; frames * nu];
        let mut out = vec![0.0; frames * all_width];
        let mut touched = vec![false; pairs.channels.len()];
        let mut actions = Vec::new();
        for step in 0..protocol.horizon {
            let latest = episode.reading_tail(width).to_vec();
            policy.act(step, &latest, &mut action)?;
            for (a, c) in action.iter_mut().zip(&protocol.action) {
                *a = a.clamp(c.range[0], c.range[1]);
            }
            actions.extend_from_slice(&action);
            commander.commands(&action, &mut ctrl);
            self.batch.simulator.copy_state(&[0], &[COPY])?;
            let rollout = Rollout::new(&[0], frames, substeps, Control::Shared(&ctrl), &recording);
            self.batch.simulator.rollout(&rollout, &mut out)?;
            self.check()?;
            episode.ctrl.extend_from_slice(&ctrl);
            touched.fill(false);
            for (k, row) in out.chunks_exact(all_width).enumerate() {
                episode.readings.extend(observe(step * frames + k + 1, row));
                note(&row[width..], &mut touched);
            }
            if !touched.iter().all(|t| *t) {
                touch.between(&mut *self.batch.simulator, &ctrl, &mut touched)?;
            }
            pairs.count(&touched);
        }
        self.wear();
        let last = episode.ctrl[episode.ctrl.len() - nu..].to_vec();
        episode.ctrl.extend(last);
        episode.time = times(protocol.frames(), protocol.frame_period);
        let (contact_fraction, touched) = pairs.shares(protocol.horizon);
        Ok(RealEpisode {
            episode,
            actions,
            contact_fraction,
            touched,
            true_start: Some(start),
        })
    }

    fn attempt(&mut self, policy: &mut dyn TaskPolicy) -> Result<Attempt> {
        let protocol = self.task.downstream();
        let mut rng = self.streams.stream("task start");
        let start = draw(&protocol.start, &mut rng);
        self.begin(&start)?;
        let layout = self.batch.simulator.layout().clone();
        let tracked: Vec<String> = self
            .task
            .exploration()
            .signals
            .iter()
            .map(|s| s.sensor.clone())
            .collect();
        let mut seen = vec![0.0; self.signals.width()];
        self.batch
            .simulator
            .read(&[0], &layout.recording(&tracked)?, &mut seen)?;
        self.signals
            .add_noise(&mut seen, || StandardNormal.sample(&mut rng));
        let believed = self.task.locate(&seen);
        let mut action = vec![0.0; protocol.action.len()];
        policy.act(&believed, &mut action)?;
        let ctrl = self.task.attempt(&believed, &action)?;
        // The metric's channels, then those of the log.
        let names = self.task.exploration().channels();
        let mut all = protocol.channels.clone();
        all.extend(names.iter().cloned());
        let recording = layout.recording(&all)?;
        let (width, own) = (
            recording.width(),
            layout.recording(&protocol.channels)?.width(),
        );
        let substeps = substeps(&layout, protocol.frame_period)?;
        let mut out = vec![0.0; (protocol.frames + 1) * width];
        let (first, frames) = out.split_at_mut(width);
        self.batch.simulator.read(&[0], &recording, first)?;
        let control = Control::Shared(&ctrl);
        let rollout = Rollout::new(&[0], protocol.frames, substeps, control, &recording);
        self.batch.simulator.rollout(&rollout, frames)?;
        self.check()?;
        self.wear();
        let readings: Vec<f64> = frames
            .chunks_exact(width)
            .flat_map(|row| row[..own].to_vec())
            .collect();
        let mut episode = blank(&layout, &names)?;
        let mut noise = self.streams.stream("task noise");
        let tracked = self.signals.width();
        let read = ReadingFrames::of(self.task, protocol.frame_period);
        for (frame, row) in out.chunks_exact_mut(width).enumerate() {
            let seen = &mut row[own..];
            self.signals
                .add_noise(&mut seen[..tracked], || StandardNormal.sample(&mut noise));
            if !read.has(frame) {
                seen[..tracked].fill(f64::NAN);
            }
            episode.readings.extend_from_slice(seen);
        }
        let nu = layout.nu();
        episode.ctrl = ctrl;
        let last = episode.ctrl[episode.ctrl.len() - nu..].to_vec();
        episode.ctrl.extend(last);
        episode.time = times(protocol.frames, protocol.frame_period);
        Ok(Attempt {
            outcome: self.task.outcome(&readings),
            action,
            believed_start: believed,
            readings,
            episode,
        })
    }
}
