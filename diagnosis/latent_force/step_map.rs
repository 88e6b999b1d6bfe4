//! The model over one row of a log, and its derivatives along a trajectory.
//!
//! `f` maps the state at one row of the log to the state at the next, under the row's command. `h`
//! is the sensors' readings of a state. Both come from a batch of any engine. A pass walks all
//! episodes side by side: at each row it sets every simulation to the trajectory's state and steps
//! it to the next row. Segments are set at their first row alone, and replayed from there.
//!
//! Derivatives are forward differences. Each episode has one simulation for the unperturbed model
//! and one for each perturbed coordinate of the state, force or value. An effect with memory (a
//! delay, a rotor behind backlash) runs along with its own simulation. Its memory at a row is that
//! of the trajectory before the row.

mod along;
mod carried;
mod common;
mod late;
mod leg;
mod linear_episode;
mod pass;
mod reading;
mod request;
mod role;
mod roll;
mod sensors;
mod shares;
mod step;

use asid_core::layout::Layout;
use asid_core::{BatchConfig, Model as _, Parameter, Result, Simulator as _};
use asid_effects::{Acts, EffectSpec};
use rayon::prelude::*;

use crate::batch_columns::BatchColumns;
use crate::data::Logs;
use crate::machine::Machine;

use super::islands::Islands;
use super::walk::Walk;

use common::Common;
pub use late::retime_columns;
pub use linear_episode::{Derivatives, LinearEpisode, Variation};
use pass::Part;
pub use request::Anew;
use request::Request;
use sensors::Sensors;
use shares::share_out;

/// Most simulations in one batch; each takes 50 to 500 kB.
const MOST_SIMULATIONS: usize = 1024;

/// The model with some effects on some logs.
pub struct StepMap<'a> {
    common: Common<'a>,
    parts: Vec<Part>,
}

impl<'a> StepMap<'a> {
    /// Builds the map of a machine with additional effects, whose parameters are given.
    ///
    /// `roles` is the number of evaluations that a pass is expected to need.
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
        let model = machine.refined(specs)?;
        let layout = model.layout().clone();
        let columns = BatchColumns::new(&*model, parameters);
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
                let simulator = model.batch(&BatchConfig {
                    size: capacity * walks.len(),
                    threads: 1,
                    targets: columns.targets(),
                })?;
                Ok(Part { walks, simulator })
            })
            .collect::<Result<_>>()?;
        let names = layout.state_channels();
        let (mut depends_on_past, mut remembers_readings) = (model.remembers_commands(), false);
        let (mut in_each_step, mut on_readings) = (Vec::new(), Vec::new());
        let mut late = vec![false; logs.entries.len()];
        for spec in machine.given_effects().iter().chain(specs) {
            let effect = spec.find(&machine.plant)?;
            if effect.remembers_readings() {
                remembers_readings = true;
                for (late, entry) in late.iter_mut().zip(&logs.entries) {
                    // Without a site it is an effect on all sensors.
                    let sensor = &logs.sensors[entry.sensor].name;
                    *late |= spec.site.is_empty() || spec.site == *sensor;
                }
            }
            depends_on_past |= effect.acts() != Acts::Model;
            if matches!(effect.acts(), Acts::Model | Acts::Measurement) {
                in_each_step.push(spec.label());
            }
            if effect.acts() == Acts::Measurement {
                on_readings.push(spec.label());
            }
        }
        let is_measured = |p: &Parameter| {
            let mut targets = p.targets.iter();
            targets.all(|t| t.element == "effect" && on_readings.contains(&t.name))
        };
        let acts_at_once = |p: &Parameter| {
            let mut targets = p.targets.iter();
            targets.all(|t| t.element != "effect" || in_each_step.contains(&t.name))
        };
        let common = Common {
            states: layout.recording(&names)?,
            islands: Islands::one(layout.nv, logs.entries.len()),
            readings: layout.recording(&logs.channels())?,
            states_and_readings: layout.recording(&[names, logs.channels()].concat())?,
            logs,
            walks,
            layout,
            columns,
            capacity,
            depends_on_past,
            remembers_readings,
            late,
            alters_readings: !on_readings.is_empty(),
            one_step: false,
            at_once: parameters.iter().map(acts_at_once).collect(),
            measured: parameters.iter().map(is_measured).collect(),
            sensors: Sensors::of(&model.layout().sensors, logs, (&on_readings, parameters)),
        };
        Ok(Self { common, parts })
    }

    /// Sets whether one physics step of each row gives the derivatives with respect to the state.
    ///
    /// A new map takes them over whole rows.
    pub fn by_one_step(&mut self, one: bool) {
        self.common.one_step = one;
    }

    /// Perturbs uncoupled degrees of freedom together; no walk may be a segment.
    pub fn apart(&mut self, islands: &Islands) {
        self.common.islands.clone_from(islands);
    }

    /// Whether an effect makes readings depend on earlier ones.
    #[must_use]
    pub fn remembers_readings(&self) -> bool {
        self.common.remembers_readings
    }

    /// Whether an effect changes what sensors read.
    #[must_use]
    pub fn alters_readings(&self) -> bool {
        self.common.alters_readings
    }

    /// Whether some walks are segments.
    #[must_use]
    pub fn has_segments(&self) -> bool {
        self.common.walks.iter().any(|w| w.segment.is_some())
    }

    /// Whether all walks are segments.
    #[must_use]
    pub fn is_all_segments(&self) -> bool {
        self.common.walks.iter().all(|w| w.segment.is_some())
    }

    /// The machine's layout.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.common.layout
    }

    /// Number of physics steps taken so far.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.parts.iter().map(|p| p.simulator.steps_taken()).sum()
    }

    /// Linearises about a trajectory (`rows x (nq + nv)`, one per walk) at given parameters.
    ///
    /// `push` holds the steps of the differences: one per generalized force, or one per coordinate
    /// of the initial states of segments.
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
        self.linearise_anew(theta, trajectory, (want, Anew::default()), push, variations)
    }

    /// As [`StepMap::linearise`], but computes only the parts that `anew` selects.
    ///
    /// # Errors
    /// As [`StepMap::linearise`].
    pub fn linearise_anew(
        &mut self,
        theta: &[f64],
        trajectory: &[Vec<f64>],
        (want, anew): (Derivatives, Anew<'_>),
        push: &[f64],
        variations: &[Variation],
    ) -> Result<Vec<LinearEpisode>> {
        let common = &self.common;
        let at_once: Vec<bool> = variations
            .iter()
            .map(|v| common.acts_at_once(theta, v))
            .collect();
        let read: Vec<bool> = variations
            .iter()
            .map(|v| common.is_read(theta, v))
            .collect();
        let alone: Vec<bool> = variations
            .iter()
            .map(|v| common.is_read_alone(theta, v))
            .collect();
        let request = Request {
            theta,
            trajectory,
            want,
            push,
            variations,
            anew,
            at_once: &at_once,
            read: &read,
            alone: &alone,
        };
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

    /// Returns what the logs' sensors read at a state (`nq + nv`) of each walk, in the order of the
    /// logs' channels.
    ///
    /// # Errors
    /// As [`StepMap::linearise`].
    pub fn readings_at(&mut self, theta: &[f64], states: &[Vec<f64>]) -> Result<Vec<Vec<f64>>> {
        let common = &self.common;
        let mut out = vec![Vec::new(); common.walks.len()];
        let read: Vec<Vec<Vec<f64>>> = self
            .parts
            .par_iter_mut()
            .map(|part| part.readings_at(common, theta, states))
            .collect::<Result<_>>()?;
        for (part, read) in self.parts.iter().zip(read) {
            for (&w, read) in part.walks.iter().zip(read) {
                out[w] = read;
            }
        }
        Ok(out)
    }

    /// Replays some of the segments from the first rows of their trajectories, and overwrites the
    /// trajectories with the replays.
    ///
    /// Returns, for each walk, the sum of squared residuals of the readings that count, each
    /// divided by its `variance` (one per entry); 0 for other walks. `most` holds one limit per
    /// walk, or `None` if it is not replayed. A replay ends some rows after its sum exceeds the
    /// limit; the sum is then infinite, as where the engine fails.
    ///
    /// # Errors
    /// As [`StepMap::linearise`].
    pub fn roll(
        &mut self,
        theta: &[f64],
        (trajectory, most): (&mut [Vec<f64>], &[Option<f64>]),
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
            .map(|(part, states)| part.roll(common, (theta, variance), (states, most)))
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
