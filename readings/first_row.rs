//! Readings of a log's first row that depend on a command before the log.
//!
//! The force of a drive, an acceleration or the pressure below a foot follows the command that acts
//! when it is read. In the first row that is a command from before the log, which no row contains.
//! A simulation begins without a command. If the log's first command is zero, the machine was idle
//! before, and the two agree. If it is not, no model can predict such a reading, however right it
//! is, and the reading counts as missing.
//!
//! A trial finds which sensors follow which actuator, so that this works on any engine and for any
//! sensor. In states along a replay of a log, each actuator in turn gets another command for one
//! step, and the state is then restored.

use asid_core::episode::InitialState;
use asid_core::simulator::BatchConfig;
use asid_core::{Control, Episode, Model, Recording, Result, Rollout, Simulator};

use crate::replay::ReplayPlan;

/// States of a replay in which sensors are tested: a foot may be off the ground in some.
const STATES: usize = 8;
/// Relative difference of a reading that shows that it follows a command: a contact solver ends
/// within a millionth.
const DIFFERS: f64 = 1e-4;

/// Batch of simulations: one with the commands of the log, and one for each actuator with another
/// command.
struct Trial {
    simulator: Box<dyn Simulator>,
    sims: Vec<usize>,
    /// Positions and velocities, in the order of [`Simulator::set_state`].
    state: Recording,
    sensors: Recording,
    nq: usize,
}

impl Trial {
    fn new(model: &dyn Model, sensors: &[String]) -> Result<Self> {
        let layout = model.layout();
        let size = 1 + layout.nu();
        let config = BatchConfig {
            size,
            threads: 1,
            targets: Vec::new(),
        };
        Ok(Self {
            simulator: model.simulator(&config)?,
            sims: (0..size).collect(),
            state: layout.recording(&layout.state_channels())?,
            sensors: layout.recording(sensors)?,
            nq: layout.nq,
        })
    }

    /// Sets the first simulation to a state of an episode.
    fn begin(&mut self, start: &InitialState) -> Result<()> {
        self.simulator.reset(&self.sims)?;
        self.simulator
            .set_state(&self.sims[..1], &start.qpos, &start.qvel)
    }

    /// Marks the entries of the sensors that follow the command of each actuator in the present
    /// state.
    ///
    /// The state is that of the first simulation, and stays as it is. `commands` has a row of
    /// commands for each simulation, `follows` a row of entries for each actuator.
    fn mark(&mut self, commands: &[f64], follows: &mut [bool]) -> Result<()> {
        let (n, width) = (self.sims.len(), self.sensors.width());
        let simulator = &mut *self.simulator;
        let own = &self.sims[..1];
        let before = simulator.save(own)?;
        let mut state = vec![0.0; self.state.width()];
        simulator.read(own, &self.state, &mut state)?;
        if state.iter().any(|x| !x.is_finite()) {
            // A replay that diverged marks nothing.
            return Ok(());
        }
        simulator.load(&before, &vec![0; n], &self.sims)?;
        let mut stepped = vec![0.0; n * width];
        let control = Control::PerSimulation(commands);
        simulator.rollout(
            &Rollout::new(&self.sims, 1, 1, control, &self.sensors),
            &mut stepped,
        )?;
        let (qpos, qvel) = state.split_at(self.nq);
        simulator.set_state(&self.sims, &qpos.repeat(n), &qvel.repeat(n))?;
        let mut readings = vec![0.0; n * width];
        simulator.read(&self.sims, &self.sensors, &mut readings)?;
        simulator.load(&before, &[0], own)?;
        let (first, others) = readings.split_at(width);
        let each = others
            .chunks_exact(width)
            .zip(follows.chunks_exact_mut(width));
        for (other, follows) in each {
            for ((follows, a), b) in follows.iter_mut().zip(first).zip(other) {
                // A diverged reading (NaN or infinite) marks nothing: the comparison is false.
                *follows |= (a - b).abs() > DIFFERS * a.abs().max(b.abs());
            }
        }
        Ok(())
    }
}

/// Commands for each simulation of a [`Trial`].
///
/// They are those of the first row of the first log. For each actuator, its command is replaced by
/// the one of all logs that is farthest from it, or by none: a simulation begins without a command.
fn commands(logs: &[&Episode], first: &[f64]) -> Vec<f64> {
    let nu = first.len();
    let farthest = |a: usize| {
        let of_logs = logs.iter().flat_map(|e| e.ctrl.iter().skip(a).step_by(nu));
        let all = of_logs.copied().chain([0.0]);
        let far = |x: &f64| (x - first[a]).abs();
        all.filter(|x| x.is_finite())
            .max_by(|x, y| far(x).total_cmp(&far(y)))
    };
    let with = |a: usize| {
        let mut own = first.to_vec();
        own[a] = farthest(a).unwrap_or(own[a]);
        own
    };
    let moved = (0..nu).flat_map(with);
    first.iter().copied().chain(moved).collect()
}

/// For each actuator of a scene, the sensors that follow its command at once.
#[derive(Clone, Debug, Default)]
pub struct Followers {
    of_actuators: Vec<Vec<String>>,
}

impl Followers {
    /// Finds the followers among the sensors of some logs, in states along a replay of the first of
    /// them from an initial state.
    ///
    /// # Errors
    /// As [`Simulator::rollout`].
    pub fn of(model: &dyn Model, start: &InitialState, logs: &[&Episode]) -> Result<Self> {
        let layout = model.layout();
        let nu = layout.nu();
        let is_read = |name: &str| logs.iter().any(|e| e.channel(name).is_some());
        let sensors = layout.sensors.iter().filter(|s| is_read(&s.name));
        let sensors: Vec<String> = sensors.map(|s| s.name.clone()).collect();
        let first = logs.first().filter(|e| e.rows() > 1);
        let Some(episode) = first.filter(|_| nu > 0 && !sensors.is_empty()) else {
            return Ok(Self::default());
        };
        let commands = commands(logs, &episode.ctrl[..nu]);
        let plan = ReplayPlan::new(layout, episode, episode.rows());
        let mut trial = Trial::new(model, &sensors)?;
        trial.begin(start)?;
        let width = trial.sensors.width();
        let mut follows = vec![false; nu * width];
        let frames = plan.frames.div_ceil(STATES);
        for part in plan.ctrl.chunks(frames * nu) {
            trial.mark(&commands, &mut follows)?;
            let n = part.len() / nu;
            let mut passed = vec![0.0; n * width];
            let control = Control::Shared(part);
            let own = &trial.sims[..1];
            let rollout = Rollout::new(own, n, plan.substeps, control, &trial.sensors);
            trial.simulator.rollout(&rollout, &mut passed)?;
        }
        let followers = |follows: &[bool]| {
            let any = |i: &usize| follows[trial.sensors.range(*i)].contains(&true);
            let places = (0..sensors.len()).filter(any);
            places.map(|i| sensors[i].clone()).collect()
        };
        Ok(Self {
            of_actuators: follows.chunks_exact(width).map(followers).collect(),
        })
    }

    /// Removes the readings that follow a command from before an episode from its first row.
    ///
    /// These are the followers of actuators whose first command is not zero.
    pub fn open(&self, episode: &mut Episode) {
        let commanded = self.of_actuators.iter().zip(episode.ctrl.clone());
        let commanded = commanded.filter(|(_, command)| *command != 0.0);
        for name in commanded.flat_map(|(sensors, _)| sensors) {
            if let Some(range) = episode.channel(name) {
                episode.readings[range].fill(f64::NAN);
            }
        }
    }
}
