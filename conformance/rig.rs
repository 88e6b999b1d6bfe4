//! Helpers of the checks: a scene, a batch and its readings in few words.

use std::sync::Arc;

use asid_core::simulator::{ExternalForce, ParameterChange, StepHook};
use asid_core::{
    Backend, BatchConfig, Capabilities, Control, Error, Layout, Model, Recording, Result, Rollout,
    Scene, Simulator, Target,
};

/// Standard gravity of the scenes, m/s².
pub const G: f64 = 9.81;

/// Physics time step of the scenes, s, unless they set another.
pub const STEP: f64 = 0.002;

/// A scene with this content, in radians and with steps of [`STEP`].
///
/// # Errors
/// If it is no MJCF.
pub fn scene(inside: &str) -> Result<Scene> {
    let xml = format!(
        "<mujoco><compiler angle=\"radian\"/><option timestep=\"{STEP}\"/>{inside}</mujoco>"
    );
    Scene::from_xml("conformance", &xml, &[])
}

/// Whether an engine claims to save states. One that does not is never asked to save, restore or
/// copy any.
pub fn saves(backend: &dyn Backend) -> bool {
    (backend.capabilities()).contains(Capabilities::EXACT_SNAPSHOT)
}

/// The make-up of a rig besides its scene.
#[derive(Clone, Copy, Debug)]
pub struct Size<'a> {
    /// Number of simulations.
    pub sims: usize,
    /// Number of threads.
    pub threads: usize,
    /// Targets of the parameters.
    pub targets: &'a [&'a str],
}

/// One simulation, one thread, no parameters.
pub const ONE: Size<'static> = Size {
    sims: 1,
    threads: 1,
    targets: &[],
};

/// A batch with recorded channels.
pub struct Rig {
    /// The compiled scene.
    pub model: Arc<dyn Model>,
    /// The batch.
    pub simulator: Box<dyn Simulator>,
    /// The recorded channels.
    pub record: Recording,
}

/// Recorded rows, by simulation, then by frame.
pub type Rows = Vec<Vec<f64>>;

impl Rig {
    /// One simulation of a document with this content.
    ///
    /// # Errors
    /// If the engine refuses the scene or a channel.
    pub fn new(backend: &dyn Backend, inside: &str, channels: &[&str]) -> Result<Self> {
        Self::with(backend, inside, channels, ONE)
    }

    /// A batch of a document with this content.
    ///
    /// # Errors
    /// If the engine refuses the scene, a channel or a target.
    pub fn with(
        backend: &dyn Backend,
        inside: &str,
        channels: &[&str],
        size: Size<'_>,
    ) -> Result<Self> {
        Self::of(backend.load(&scene(inside)?)?, channels, size)
    }

    /// A batch of a compiled scene.
    ///
    /// # Errors
    /// If the engine refuses a channel or a target.
    pub fn of(model: Arc<dyn Model>, channels: &[&str], size: Size<'_>) -> Result<Self> {
        let targets: Result<Vec<Target>> = size.targets.iter().map(|t| t.parse()).collect();
        let simulator = model.simulator(&BatchConfig {
            size: size.sims,
            threads: size.threads,
            targets: targets?,
        })?;
        let record = model.layout().recording(channels)?;
        Ok(Self {
            model,
            simulator,
            record,
        })
    }

    /// Another batch of the same compiled scene, without parameters.
    ///
    /// # Errors
    /// As [`Model::simulator`].
    pub fn another(&self, sims: usize, threads: usize) -> Result<Self> {
        let simulator = self.model.simulator(&BatchConfig {
            size: sims,
            threads,
            targets: Vec::new(),
        })?;
        Ok(Self {
            model: Arc::clone(&self.model),
            simulator,
            record: self.record.clone(),
        })
    }

    /// The same command for every actuator.
    pub fn command(&self, value: f64) -> Vec<f64> {
        vec![value; self.simulator.layout().nu()]
    }

    /// Numbers of all simulations.
    pub fn all(&self) -> Vec<usize> {
        (0..self.simulator.batch_size()).collect()
    }

    /// Sets every simulation to the same state.
    ///
    /// # Errors
    /// If a length does not fit.
    pub fn place(&mut self, qpos: &[f64], qvel: &[f64]) -> Result<()> {
        let sims = self.all();
        self.simulator
            .set_state(&sims, &qpos.repeat(sims.len()), &qvel.repeat(sims.len()))
    }

    /// Sets the parameters of every simulation, row by row.
    ///
    /// # Errors
    /// If a length or a value does not fit.
    pub fn set(&mut self, values: &[f64]) -> Result<()> {
        let sims = self.all();
        self.simulator.set_parameters(&sims, values)
    }

    /// Runs frames of one physics step each under one constant command.
    ///
    /// # Errors
    /// As [`Simulator::rollout`].
    pub fn run(&mut self, frames: usize, ctrl: &[f64]) -> Result<Rows> {
        self.run_with(frames, 1, ctrl, |_| {})
    }

    /// Runs frames under one constant command; `change` sets forces, changes, a hook or other
    /// simulations.
    ///
    /// # Errors
    /// As [`Simulator::rollout`].
    pub fn run_with<'a>(
        &mut self,
        frames: usize,
        substeps: usize,
        ctrl: &[f64],
        change: impl FnOnce(&mut Extras<'a>),
    ) -> Result<Rows> {
        let mut extras = Extras {
            sims: self.all(),
            ..Extras::default()
        };
        change(&mut extras);
        let control = ctrl.repeat(frames);
        let width = self.record.width();
        let mut out = vec![0.0; extras.sims.len() * frames * width];
        let rollout = Rollout {
            forces: &extras.forces,
            changes: &extras.changes,
            hook: extras.hook,
            ..Rollout::new(
                &extras.sims,
                frames,
                substeps,
                Control::Shared(&control),
                &self.record,
            )
        };
        self.simulator.rollout(&rollout, &mut out)?;
        Ok(out.chunks(width.max(1)).map(<[f64]>::to_vec).collect())
    }

    /// Reads the present state of every simulation.
    ///
    /// # Errors
    /// As [`Simulator::read`].
    pub fn read(&mut self) -> Result<Rows> {
        let sims = self.all();
        let width = self.record.width();
        let mut out = vec![0.0; sims.len() * width];
        self.simulator.read(&sims, &self.record, &mut out)?;
        Ok(out.chunks(width.max(1)).map(<[f64]>::to_vec).collect())
    }
}

/// Inputs of a rollout besides commands.
#[derive(Default)]
pub struct Extras<'a> {
    /// Numbers of the simulations, all by default.
    pub sims: Vec<usize>,
    /// External forces.
    pub forces: Vec<ExternalForce<'a>>,
    /// Parameter changes.
    pub changes: Vec<ParameterChange<'a>>,
    /// Hook.
    pub hook: Option<&'a dyn StepHook>,
}

/// Names of the channels of a complete state: `qpos` of each joint, then `qvel` of each.
pub fn state_channels(layout: &Layout) -> Vec<String> {
    let of = |kind: &'static str| {
        let joints = layout.joints.iter();
        joints.map(move |joint| format!("{kind}.{}", joint.name))
    };
    of("qpos").chain(of("qvel")).collect()
}

/// The last row.
///
/// # Errors
/// If there is none.
pub fn last(rows: &[Vec<f64>]) -> Result<&[f64]> {
    rows.last()
        .map(Vec::as_slice)
        .ok_or_else(|| Error::Failed("nothing was recorded".into()))
}

/// Relative deviation of `value` from `theory`.
pub fn relative(value: f64, theory: f64) -> f64 {
    value / theory - 1.0
}

/// The largest magnitude; NaN if any value is NaN.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |worst: f64, value| {
        if worst.is_nan() || value.is_nan() {
            f64::NAN
        } else {
            worst.max(value.abs())
        }
    })
}

/// Number of readings that differ in any bit.
pub fn differing_bits(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let lengths = a.len().abs_diff(b.len());
    let unequal = a
        .iter()
        .flatten()
        .zip(b.iter().flatten())
        .filter(|(x, y)| x.to_bits() != y.to_bits())
        .count();
    (lengths + unequal) as f64
}

/// Number of broken promises.
pub fn broken<const N: usize>(promises: [bool; N]) -> f64 {
    promises.iter().filter(|kept| !**kept).count() as f64
}

/// Mean time between upward crossings of `level`, s, for samples one step apart.
pub fn period(samples: &[f64], level: f64) -> f64 {
    let crossings: Vec<f64> = samples
        .windows(2)
        .enumerate()
        .filter(|(_, w)| w[0] < level && w[1] >= level)
        .map(|(i, w)| i as f64 + (level - w[0]) / (w[1] - w[0]))
        .collect();
    match crossings[..] {
        [first, .., last] => (last - first) / (crossings.len() - 1) as f64 * STEP,
        _ => f64::NAN,
    }
}
