//! The model over one row of a log, and its derivatives, along a trajectory.
//!
//! `f` carries a state from a row of the log to the next under the row's command; `h` reads the sensors. Both
//! come from a batch of any engine: a pass walks all episodes side by side, sets every simulation to the
//! trajectory's state at each row, and steps it to the next. Derivatives are forward differences: one
//! simulation an episode for the model as it is, one for each coordinate of the state, each force and each value
//! that is varied. Effects that remember (a delay, a rotor behind its play) walk along with their
//! own simulation, so that their memory at a row is that of the trajectory before it.

mod late;
mod pass;
mod roll;
mod step;

use asid_core::layout::{Layout, Recording};
use asid_core::{BatchConfig, Parameter, Result};
use asid_effects::{Acts, EffectSpec};
use rayon::prelude::*;

use crate::data::Logs;
use crate::machine::Machine;

use super::walk::Walk;

pub use late::retime_columns;
use pass::Part;

/// Most simulations in one batch; each takes 50 to 500 kB.
const MOST_SIMULATIONS: usize = 1024;

/// A value of the parameters at which the model is evaluated besides the present one: the column is the
/// change from there to here, divided by `scale`.
#[derive(Clone, Debug)]
pub struct Variation {
    /// All parameters.
    pub theta: Vec<f64>,
    /// What the change is divided by.
    pub scale: f64,
}

/// What a pass computes besides the defects and residuals.
#[derive(Clone, Copy, Debug, Default)]
pub struct Derivatives {
    /// Slopes in the state.
    pub state: bool,
    /// Slopes in generalized forces, with the size of each force (N or N m) that differences are taken over.
    pub force: bool,
    /// Slopes in such forces that act in the first physics step of a row.
    pub jolt: bool,
}

/// One episode, linearised about a trajectory. Matrices are row-major, one a row of the log; states are counted
/// in tangent coordinates (`nx = 2 nv`), readings in the sensors' units.
#[derive(Clone, Debug, Default)]
pub struct LinearEpisode {
    /// Number of rows.
    pub rows: usize,
    /// `f(x_k) - x_{k+1}`, `(rows - 1) x nx`; not finite where the engine failed.
    pub defect: Vec<f64>,
    /// Slope of `f` in the state, `(rows - 1) x nx x nx`.
    pub a: Vec<f64>,
    /// Slope of `f` in a generalized force held over the row, `(rows - 1) x nx x nv`.
    pub b: Vec<f64>,
    /// The same of a force in the first physics step of the row.
    pub jolt: Vec<f64>,
    /// `y_k - h(x_k)`, `rows x ns`; NaN where a reading is missing.
    pub residual: Vec<f64>,
    /// Slope of `h` in the state, `rows x ns x nx`; of a segment the slope in its start.
    pub h: Vec<f64>,
    /// Readings of each entry that tell of before the first row, where a sensor is late; `ns`, or empty for none.
    pub early: Vec<f64>,
    /// How late the readings of each entry are, s; `ns`, or empty for none.
    pub late: Vec<f64>,
    /// Change of `f` by each variation, `(rows - 1) x nx x m`.
    pub state_columns: Vec<f64>,
    /// Change of `h` by each variation, `rows x ns x m`; of a segment that of its whole replay.
    pub reading_columns: Vec<f64>,
}

/// The model with some effects on some logs.
pub struct StepMap<'a> {
    common: Common<'a>,
    parts: Vec<Part>,
}

/// What all parts share.
struct Common<'a> {
    logs: &'a Logs,
    walks: &'a [Walk],
    layout: Layout,
    parameters: Vec<Parameter>,
    states: Recording,
    readings: Recording,
    /// Most roles in one pass.
    capacity: usize,
    /// Whether effects on the drive side remember, and whether some act on readings.
    remembers: bool,
    reads: bool,
    /// Whether some remember how the machine has moved.
    remembers_motion: bool,
    /// Whether one physics step tells the slopes of a row in the state.
    one_step: bool,
}

impl Common<'_> {
    /// Whether a walk is replayed from its first row, and its derivatives are those of the replay: a segment, but where the
    /// slopes in forces are wanted, which are those of rows.
    fn rolls(&self, walk: usize, want: Derivatives) -> bool {
        self.walks[walk].segment.is_some() && !want.force
    }
}

/// The linearisation point and what is wanted of it.
#[derive(Clone, Copy)]
struct Request<'r> {
    theta: &'r [f64],
    trajectory: &'r [Vec<f64>],
    want: Derivatives,
    push: &'r [f64],
    variations: &'r [Variation],
    /// Walks whose slopes in the state are wanted; empty for all.
    due: &'r [bool],
}

impl Request<'_> {
    /// Whether the slopes of a walk in the state are wanted, where any are.
    fn due(&self, walk: usize) -> bool {
        self.due.get(walk).is_none_or(|due| *due)
    }
}

impl<'a> StepMap<'a> {
    /// Of a machine with more effects, whose parameters are given; `roles` is how many evaluations a pass
    /// will want.
    ///
    /// # Errors
    /// When the engine refuses an effect or a target.
    pub fn new(
        machine: &Machine,
        specs: &[EffectSpec],
        parameters: &[Parameter],
        (logs, walks): (&'a Logs, &'a [Walk]),
        roles: usize,
    ) -> Result<Self> {
        let model = machine.with(specs)?;
        let layout = model.layout().clone();
        let cores = match machine.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let shares = share_out(walks, cores);
        let most = shares.iter().map(Vec::len).max().unwrap_or(1).max(1);
        let capacity = roles.clamp(2, (MOST_SIMULATIONS / cores / most).max(2));
        let parts = shares
            .into_iter()
            .map(|walks| {
                let simulator = model.simulator(&BatchConfig {
                    size: capacity * walks.len(),
                    threads: 1,
                    targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
                })?;
                Ok(Part { walks, simulator })
            })
            .collect::<Result<_>>()?;
        let joints = || layout.joints.iter();
        let names = joints().map(|j| format!("qpos.{}", j.name));
        let names: Vec<String> = names
            .chain(joints().map(|j| format!("qvel.{}", j.name)))
            .collect();
        let (mut remembers, mut reads, mut remembers_motion) = (false, false, false);
        for spec in machine.given_effects().iter().chain(specs) {
            let effect = spec.find(&machine.plant)?;
            remembers_motion |= effect.remembers_motion();
            match effect.acts() {
                Acts::Measurement => reads = true,
                Acts::Command | Acts::Force => remembers = true,
                Acts::Model => {}
            }
        }
        let common = Common {
            states: layout.recording(&names)?,
            readings: layout.recording(&logs.channels())?,
            logs,
            walks,
            layout,
            parameters: parameters.to_vec(),
            capacity,
            remembers,
            reads,
            remembers_motion,
            one_step: false,
        };
        Ok(Self { common, parts })
    }

    /// Takes slopes in the state from one physics step of each row, where nothing remembers the motion; from the whole row otherwise, as a new
    /// map does.
    pub fn by_one_step(&mut self, one: bool) {
        self.common.one_step = one;
    }

    /// Whether an effect acts on readings, which then may remember.
    #[must_use]
    pub fn reads(&self) -> bool {
        self.common.reads
    }

    /// Whether some walks are segments.
    #[must_use]
    pub fn has_segments(&self) -> bool {
        self.common.walks.iter().any(|w| w.segment.is_some())
    }

    /// Whether all walks are.
    #[must_use]
    pub fn is_all_segments(&self) -> bool {
        self.common.walks.iter().all(|w| w.segment.is_some())
    }

    /// The machine's layout.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.common.layout
    }

    /// Physics steps so far.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.parts.iter().map(|p| p.simulator.steps_taken()).sum()
    }

    /// Linearises about a trajectory (`rows x (nq + nv)`, one a walk) at some parameters. `push` is what slopes are taken over:
    /// in each generalized force, or in each coordinate of the starts of segments.
    ///
    /// # Errors
    /// When a value is not physical or the engine fails.
    pub fn linearise(
        &mut self,
        theta: &[f64],
        trajectory: &[Vec<f64>],
        want: Derivatives,
        push: &[f64],
        variations: &[Variation],
    ) -> Result<Vec<LinearEpisode>> {
        self.linearise_due(theta, trajectory, (want, &[]), push, variations)
    }

    /// The same, with slopes in the state of those walks alone that are due (one flag a walk; empty for all): those of the others are
    /// zero.
    ///
    /// # Errors
    /// As [`StepMap::linearise`].
    pub fn linearise_due(
        &mut self,
        theta: &[f64],
        trajectory: &[Vec<f64>],
        (want, due): (Derivatives, &[bool]),
        push: &[f64],
        variations: &[Variation],
    ) -> Result<Vec<LinearEpisode>> {
        let request = Request {
            theta,
            trajectory,
            want,
            push,
            variations,
            due,
        };
        let common = &self.common;
        let found: Vec<Vec<LinearEpisode>> = self
            .parts
            .par_iter_mut()
            .map(|part| part.linearise(common, request))
            .collect::<Result<_>>()?;
        let mut out = vec![LinearEpisode::default(); self.common.walks.len()];
        for (part, episodes) in self.parts.iter().zip(found) {
            for (&w, episode) in part.walks.iter().zip(episodes) {
                out[w] = episode;
            }
        }
        Ok(out)
    }

    /// Replays some of the segments from the first rows of their trajectories, which become those of the replays. With the sum of
    /// squares of what is left of the readings that count, each divided by its `variance` (one an entry); 0 for other walks,
    /// infinite where the engine failed.
    ///
    /// # Errors
    /// As [`StepMap::linearise`].
    pub fn roll(
        &mut self,
        theta: &[f64],
        (trajectory, which): (&mut [Vec<f64>], &[bool]),
        variance: &[f64],
    ) -> Result<Vec<f64>> {
        let common = &self.common;
        let mut shares: Vec<Vec<Vec<f64>>> = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let own = part
                .walks
                .iter()
                .map(|&w| std::mem::take(&mut trajectory[w]));
            shares.push(own.collect());
        }
        let left: Vec<Result<Vec<f64>>> = self
            .parts
            .par_iter_mut()
            .zip(&mut shares)
            .map(|(part, states)| part.roll(common, (theta, variance), (states, which)))
            .collect();
        let mut out = vec![0.0; self.common.walks.len()];
        for ((part, states), left) in self.parts.iter().zip(shares).zip(left) {
            for (&w, states) in part.walks.iter().zip(states) {
                trajectory[w] = states;
            }
            for (&w, left) in part.walks.iter().zip(left?) {
                out[w] = left;
            }
        }
        Ok(out)
    }
}

/// Shares walks out among cores, the longest first, each to the one that has least.
fn share_out(walks: &[Walk], cores: usize) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..walks.len()).collect();
    order.sort_by_key(|&w| std::cmp::Reverse(walks[w].len()));
    let mut shares = vec![(0, Vec::new()); cores.max(1)];
    for w in order {
        if let Some(least) = shares.iter_mut().min_by_key(|s| s.0) {
            least.0 += walks[w].len();
            least.1.push(w);
        }
    }
    let shares = shares.into_iter().map(|(_, mut walks)| {
        walks.sort_unstable();
        walks
    });
    shares.filter(|s: &Vec<usize>| !s.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_are_shared_out_so_that_the_longest_share_is_short() {
        let walk = |rows: usize| Walk {
            episode: 0,
            rows: (0..rows).collect(),
            time: Vec::new(),
            substeps: Vec::new(),
            ctrl: Vec::new(),
            segment: None,
        };
        let walks: Vec<Walk> = [3, 9, 4, 5, 2].map(walk).into();
        // 9 and 3 rows against 5, 4 and 2.
        assert_eq!(share_out(&walks, 2), [vec![0, 1], vec![2, 3, 4]]);
        // No core without a walk, and every walk once.
        assert_eq!(share_out(&walks, 8).concat().len(), 5);
        assert_eq!(share_out(&walks, 8).len(), 5);
        assert_eq!(share_out(&walks, 0), [vec![0, 1, 2, 3, 4]]);
    }
}
