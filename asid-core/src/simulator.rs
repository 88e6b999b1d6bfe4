//! A batch of simulations of one scene.
//!
//! Everything is a call on the whole batch with caller-owned, row-major arrays of `f64`, one row a
//! simulation. This makes an engine fast (one call, all cores, no allocation), allows it to be a C
//! table (as an engine plugin is), and makes results independent of the number of threads. The
//! price is that a single simulation is a batch of one.
//!
//! A *frame* is the interval at which commands change and readings are recorded; it takes one or
//! more physics steps (`substeps`).

mod checks;

use std::any::Any;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::layout::{Layout, Recording};
use crate::target::Target;
pub use checks::{check_copy, check_len, check_sims, check_state};

/// State of one simulation.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Status {
    /// The simulation runs.
    #[default]
    Running,
    /// Its state left the finite or plausible range. It stands still, records NaN, and takes no
    /// part until it is reset, loaded or copied into.
    Diverged {
        /// Simulated time at which the divergence was detected, s.
        time: f64,
        /// The engine's message.
        message: String,
    },
}

impl Status {
    /// Whether it runs.
    #[must_use]
    pub fn is_running(&self) -> bool {
        matches!(self, Self::Running)
    }
}

/// Configuration of a batch.
#[derive(Clone, Debug, Default)]
pub struct BatchConfig {
    /// Number of simulations.
    pub size: usize,
    /// Threads; 0 for one a core. Results do not depend on it.
    pub threads: usize,
    /// The targets that [`Simulator::set_parameters`] sets, one column each.
    pub targets: Vec<Target>,
}

impl BatchConfig {
    /// Number of threads: the given one, or one a core.
    #[must_use]
    pub fn thread_count(&self) -> usize {
        match self.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        }
    }
}

/// States of some simulations, opaque and exact: a restored simulation continues to the bit. It is
/// valid in every batch of the same compiled scene.
#[derive(Clone)]
pub struct Snapshot {
    data: Arc<dyn Any + Send + Sync>,
    rows: usize,
}

impl std::fmt::Debug for Snapshot {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Snapshot({} rows)", self.rows)
    }
}

impl Snapshot {
    /// Wraps an engine's own data for `rows` simulations.
    pub fn new<T: Any + Send + Sync>(data: T, rows: usize) -> Self {
        Self {
            data: Arc::new(data),
            rows,
        }
    }

    /// Number of states that it holds.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The engine's own data, if it is of type `T`.
    #[must_use]
    pub fn data<T: Any>(&self) -> Option<&T> {
        self.data.downcast_ref()
    }

    /// The data from which `rows` are restored into as many of `sims`; `is_own` says whether it is
    /// of the same compiled scene.
    ///
    /// # Errors
    /// [`Error::Shape`] when it is of another scene, or has no such row.
    pub fn restored<T: Any>(
        &self,
        rows: &[usize],
        sims: &[usize],
        is_own: impl FnOnce(&T) -> bool,
    ) -> Result<&T> {
        check_len("rows", rows.len(), sims.len())?;
        if let Some(row) = rows.iter().find(|&&r| r >= self.rows) {
            let all = self.rows;
            return Err(Error::Shape(format!(
                "row {row} of a snapshot with {all} rows"
            )));
        }
        let own = self.data().filter(|data| is_own(data));
        own.ok_or_else(|| Error::Shape("the snapshot is of another scene".into()))
    }
}

/// Commands of a rollout.
#[derive(Clone, Copy, Debug)]
pub enum Control<'a> {
    /// One trajectory for all, `frames x nu`.
    Shared(&'a [f64]),
    /// One trajectory a simulation, `sims x frames x nu`.
    PerSimulation(&'a [f64]),
}

/// A wrench on one body, constant over each frame: force (N) and torque (N m)
/// in the world frame, at the body's centre of mass.
#[derive(Clone, Copy, Debug)]
pub struct ExternalForce<'a> {
    /// Index in [`Layout::bodies`].
    pub body: usize,
    /// `sims x frames x 6`: force, then torque.
    pub wrench: &'a [f64],
}

/// A parameter that takes another value from a given frame on.
#[derive(Clone, Copy, Debug)]
pub struct ParameterChange<'a> {
    /// First frame with the new value.
    pub frame: usize,
    /// Column in [`BatchConfig::targets`].
    pub column: usize,
    /// New values, one a simulation of the rollout.
    pub values: &'a [f64],
}

/// What a [`StepHook`] sees of a simulation before a physics step, and what it may change.
#[derive(Debug)]
pub struct StepView<'a> {
    /// Simulated time since the last reset or load, s.
    pub time: f64,
    /// Positions, `nq`.
    pub qpos: &'a [f64],
    /// Velocities, `nv`.
    pub qvel: &'a [f64],
    /// Command of this step, `nu`; a change applies to this step only.
    pub ctrl: &'a mut [f64],
    /// Generalised force to add in this step, `nv`; zero on entry.
    pub force: &'a mut [f64],
    /// The simulation's parameters, one for each column of [`BatchConfig::targets`].
    ///
    /// On entry they are as [`Simulator::set_parameters`] left them. If the engine has
    /// [`LIVE_PARAMETERS`](crate::Capabilities::LIVE_PARAMETERS), friction of geoms and joints,
    /// damping and stiffness may be changed, for this step only; changes of other columns are
    /// ignored. For other engines the slice is empty.
    pub parameters: &'a mut [f64],
}

/// Physics that an engine lacks, called before each physics step of each simulation, from several
/// threads at once.
///
/// It is the interface for effects whose force depends on the state. It costs one call a step; a
/// rollout without a hook costs nothing.
pub trait StepHook: Sync {
    /// Called before a physics step.
    ///
    /// `row` is the row of the rollout (not the simulation's number), `step` the physics step since
    /// its start.
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>);
}

/// One rollout of some simulations of a batch.
#[derive(Clone, Copy)]
pub struct Rollout<'a> {
    /// Which simulations, strictly increasing.
    pub sims: &'a [usize],
    /// Number of frames.
    pub frames: usize,
    /// Physics steps per frame.
    pub substeps: usize,
    /// Commands.
    pub control: Control<'a>,
    /// External forces, at most one entry a body.
    pub forces: &'a [ExternalForce<'a>],
    /// Parameter changes, by frame.
    pub changes: &'a [ParameterChange<'a>],
    /// Hook with physics that the engine lacks.
    pub hook: Option<&'a dyn StepHook>,
    /// What is recorded at the end of each frame: the state at that time, before any later command
    /// acts.
    pub record: &'a Recording,
}

impl<'a> Rollout<'a> {
    /// A plain rollout: commands in, readings out.
    #[must_use]
    pub fn new(
        sims: &'a [usize],
        frames: usize,
        substeps: usize,
        control: Control<'a>,
        record: &'a Recording,
    ) -> Self {
        Self {
            sims,
            frames,
            substeps,
            control,
            forces: &[],
            changes: &[],
            hook: None,
            record,
        }
    }
}

/// A batch of `n` simulations of one scene, with their own states and parameters.
///
/// All methods take the simulations they act on as strictly increasing indices and check the
/// lengths of arrays. Errors concern the call. What happens to one simulation is in
/// [`Simulator::status`] and never disturbs the others.
pub trait Simulator: Send {
    /// Names and indices.
    fn layout(&self) -> &Layout;

    /// Number of simulations, `n`.
    fn batch_size(&self) -> usize;

    /// Sets the parameters of some simulations: `sims x columns`, in the order of
    /// [`BatchConfig::targets`].
    ///
    /// States stay unchanged.
    ///
    /// # Errors
    /// When a length does not fit or a value is not finite or not physical (a negative mass or
    /// friction).
    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()>;

    /// Resets simulations to the scene's first keyframe, or its default state without one, at time
    /// zero and without memory.
    ///
    /// # Errors
    /// When `sims` do not fit.
    fn reset(&mut self, sims: &[usize]) -> Result<()>;

    /// Sets positions (`sims x nq`) and velocities (`sims x nv`); quaternions are normalised.
    ///
    /// Contacts are detected anew; time and parameters stay unchanged.
    ///
    /// # Errors
    /// When a length does not fit or a value is not finite.
    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()>;

    /// Sets positions and velocities within an episode: what actuators remember of earlier commands
    /// stays, such as the state of a filter.
    ///
    /// By default it is [`Simulator::set_state`], which is right for models that do not
    /// [remember commands](crate::Model::remembers_commands).
    ///
    /// # Errors
    /// As [`Simulator::set_state`].
    fn displace(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.set_state(sims, qpos, qvel)
    }

    /// Runs a rollout and writes `sims x frames x record.width()` readings.
    ///
    /// Rows of a diverged simulation are NaN from that frame on.
    ///
    /// # Errors
    /// When an array does not fit.
    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()>;

    /// Reads the current state without stepping: `sims x record.width()`.
    ///
    /// # Errors
    /// When an array does not fit.
    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()>;

    /// Saves the states of some simulations, one row each. Parameters are not part of a state.
    ///
    /// # Errors
    /// When `sims` do not fit.
    fn save(&mut self, sims: &[usize]) -> Result<Snapshot>;

    /// Restores states: simulation `sims[i]` takes row `rows[i]`, and keeps its parameters.
    ///
    /// # Errors
    /// When the snapshot is of another scene or an index does not fit.
    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()>;

    /// Copies states within the batch: `to[i]` takes the state of `from[i]` and keeps
    /// its own parameters. `to` must not contain an index that is in `from`.
    ///
    /// # Errors
    /// When an index does not fit.
    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()>;

    /// Status of each simulation, `n`.
    fn status(&self) -> &[Status];

    /// Physics steps taken by all simulations of the batch since its creation.
    fn steps_taken(&self) -> u64;
}
