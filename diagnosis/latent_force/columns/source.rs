//! Where columns come from: the engine, or a trace of forces without it.

use asid_core::{Progress, Result};
use asid_effects::Reach;

use crate::candidate::Candidate;
use crate::latent_force::context::Context;
use crate::latent_force::step_map::{Anew, Derivatives, Variation, retime_columns};
use crate::latent_force::trace::trace;

use super::force_response::{ForceSlopes, Row};
use super::group::{Group, by_island, grouped};
use super::null_model::{NullModel, Way};
use super::together::{Account, Entries};

/// Most variations in one run of the engine.
///
/// Work can be stopped between two runs. With all variations at once, the memory would grow with
/// the number of candidates.
const SLICE: usize = 64;

/// A wanted column: a candidate with given values, and the divisor of its change.
#[derive(Clone)]
pub(super) struct Wanted {
    pub(super) candidate: usize,
    pub(super) values: Vec<f64>,
    pub(super) scale: f64,
}

impl Wanted {
    /// Returns the derivative of a candidate with respect to a parameter at given values, over a
    /// step into its range.
    pub(super) fn slope(
        candidates: &[Candidate],
        c: usize,
        begin: &[f64],
        parameter: usize,
        step: f64,
    ) -> Self {
        let [_, high] = candidates[c].limits(parameter);
        let mut values = begin.to_vec();
        let step = if values[parameter] + step <= high {
            step
        } else {
            -step
        };
        values[parameter] += step;
        Self {
            candidate: c,
            values,
            scale: step,
        }
    }
}

/// Columns along a walk: of the next states, `(rows - 1) x nx x m`, and of the readings,
/// `rows x ns x m`.
pub(super) type Along = (Vec<f64>, Vec<f64>);

/// Columns of the present model with some candidates: by the engine where it is needed, traced
/// otherwise.
#[derive(Clone, Copy)]
pub(super) struct Source<'s> {
    pub(super) candidates: &'s [Candidate],
    /// Whether any walk of all is a segment, even if none of those at hand is.
    pub(super) replayed: bool,
    /// The present model with the candidates for which one physics step is enough, and with those
    /// that need whole rows.
    pub(super) models: &'s [(Way, NullModel)],
    /// [`LinearEpisode::carried`](crate::latent_force::step_map::LinearEpisode::carried) of each
    /// walk; empty where one physics step is not enough.
    pub(super) carried: &'s [Vec<f64>],
    /// Derivatives with respect to forces, one per walk.
    pub(super) slopes: &'s [ForceSlopes],
    /// [`LinearEpisode::assigned`](crate::latent_force::step_map::LinearEpisode::assigned) of each
    /// walk in the present model.
    pub(super) assigned: &'s [Vec<Option<usize>>],
    /// Whether effects on the motion share runs of the engine, separated to a few percent of the
    /// largest column of a run.
    ///
    /// Effects on readings alone separate exactly, and always share runs.
    pub(super) together: bool,
    /// Says when work has to stop.
    pub(super) progress: &'s dyn Progress,
}

impl Source<'_> {
    /// Returns the wanted columns along each walk, and whether all were computed.
    ///
    /// Where work is stopped, columns that the engine did not reach are zero.
    pub(super) fn columns(
        &self,
        context: &Context<'_>,
        states: &[Vec<f64>],
        wanted: &[Wanted],
    ) -> Result<(Vec<Along>, bool)> {
        let plant = context.plant();
        let (nv, m) = (plant.layout.nv, wanted.len());
        let (nx, ns) = (2 * nv, context.logs.entries.len());
        let way = |w: &Wanted| Way::of(self.replayed, plant, &self.candidates[w.candidate]);
        let mut out: Vec<Along> = context
            .walks
            .iter()
            .map(|w| {
                let n = w.len();
                (vec![0.0; (n - 1) * nx * m], vec![0.0; n * ns * m])
            })
            .collect();
        let mut complete = true;
        for (own, model) in self.models {
            let by_engine: Vec<usize> = (0..m).filter(|&i| way(&wanted[i]) == *own).collect();
            complete &= self.walk((context, states), (wanted, &by_engine), model, &mut out)?;
        }
        for (w, walk) in context.walks.iter().enumerate() {
            let b = &self.slopes[w].held;
            let traced = |w: &Wanted| way(w) == Way::Traced;
            for (i, wanted) in wanted.iter().enumerate().filter(|(_, w)| traced(w)) {
                let candidate = &self.candidates[wanted.candidate];
                let episode = context.logs.episodes[walk.episode].number;
                let along = (walk, episode);
                let forces = trace(plant, candidate, &wanted.values, along, &states[w])?;
                for (k, force) in forces.chunks_exact(nv).enumerate() {
                    if force.iter().all(|x| *x == 0.0) {
                        continue;
                    }
                    for s in 0..nx {
                        let b = &b[(k * nx + s) * nv..(k * nx + s + 1) * nv];
                        let sum: f64 = b.iter().zip(force).map(|(x, y)| x * y).sum();
                        out[w].0[(k * nx + s) * m + i] = sum / wanted.scale;
                    }
                }
            }
        }
        Ok((out, complete))
    }

    /// Fills in the columns that need the engine, in shared runs where they can be separated;
    /// returns whether there was time for all.
    fn walk(
        &self,
        (context, states): (&Context<'_>, &[Vec<f64>]),
        (wanted, by_engine): (&[Wanted], &[usize]),
        model: &NullModel,
        out: &mut [Along],
    ) -> Result<bool> {
        let plant = context.plant();
        let reach = |i: usize| {
            let candidate = &self.candidates[wanted[i].candidate];
            candidate.effect.reach(plant, &candidate.spec.site)
        };
        let reaches = by_engine.iter().map(|&i| (i, reach(i)));
        let (of_sensors, others): (Vec<_>, Vec<_>) =
            reaches.partition(|(_, reach)| matches!(reach, Reach::Sensor(_)));
        // Effects on readings leave the motion unchanged, and each sensor's readings are its own.
        let mut due = grouped(of_sensors.into_iter());
        // A segment's columns are those of its whole replay, which no derivatives of rows can
        // separate. If there are segments, a part of the walks without one lacks such derivatives
        // too.
        if self.together && !self.replayed {
            due.extend(grouped(others.into_iter()));
        } else if !self.replayed {
            due.extend(by_island(others.into_iter(), &context.islands));
        } else {
            let alone = others.into_iter();
            due.extend(alone.map(|(i, reach)| Group::single(i, reach)));
        }
        let entries = Entries::of(context);
        let mut begun = false;
        while !due.is_empty() {
            if begun && self.progress.is_stopped() {
                return Ok(false);
            }
            begun = true;
            let rest = due.split_off(SLICE.min(due.len()));
            let balances = self.slice((context, states), (&due, wanted), (model, &entries), out)?;
            // Columns that reach further than declared are computed apart.
            let odd = due.into_iter().zip(balances).filter(|(_, fine)| !fine);
            due = odd
                .flat_map(|(group, _)| group.apart(&context.islands))
                .collect();
            due.extend(rest);
        }
        Ok(true)
    }

    /// Runs the engine once for some groups; returns for each whether its members could be
    /// separated.
    fn slice(
        &self,
        (context, states): (&Context<'_>, &[Vec<f64>]),
        (groups, wanted): (&[Group], &[Wanted]),
        (model, entries): (&NullModel, &Entries),
        out: &mut [Along],
    ) -> Result<Vec<bool>> {
        let (nv, m, own) = (context.plant().layout.nv, wanted.len(), groups.len());
        let (nx, ns) = (2 * nv, entries.sensors.len());
        let variation = |group: &Group| {
            let each = group.members.iter().map(|&i| &wanted[i]);
            Variation {
                theta: model.with_all(each),
                scale: 1.0,
            }
        };
        let variations: Vec<Variation> = groups.iter().map(variation).collect();
        let mut map = context.map(&model.specs, &model.parameters, own + 1)?;
        map.by_one_step(!self.carried.is_empty());
        let anew = Anew {
            state: &vec![false; states.len()],
            carried: self.carried,
            ..Anew::default()
        };
        let wanted_too = (Derivatives::default(), anew);
        let found = map.linearise_anew(&model.theta, states, wanted_too, &[], &variations)?;
        // Only a separation by forces needs derivatives with respect to forces; if every column has
        // a run of its own, there may be none.
        let by_islands: Vec<Option<Vec<usize>>> =
            groups.iter().map(|g| g.islands(&context.islands)).collect();
        let several = groups.iter().zip(&by_islands);
        let by_forces = several
            .into_iter()
            .any(|(g, own)| g.members.len() > 1 && own.is_none() && !g.is_of_sensors());
        let mut accounts = vec![Account::default(); own];
        let mut change = vec![0.0; nx.max(ns)];
        for (w, mut linear) in found.into_iter().enumerate() {
            if let Some(assigned) = self.assigned.get(w) {
                retime_columns(&mut linear.reading_columns, assigned, ns, own);
            }
            let (to_states, to_readings) = &mut out[w];
            // A segment has no state columns, only columns of its readings.
            for (k, block) in linear.state_columns.chunks_exact(nx * own).enumerate() {
                let row = by_forces.then(|| {
                    let steps = context.walks[w].substeps[k];
                    Row::of(&self.slopes[w].part(k..k + 1, nx * nv), nv, steps)
                });
                let to = &mut to_states[k * nx * m..(k + 1) * nx * m];
                spread(
                    block,
                    (groups, wanted),
                    &mut change[..nx],
                    to,
                    |g, change, set| {
                        let set = |i: usize, part: &[f64]| {
                            part.iter().enumerate().for_each(|(s, x)| set(i, s, *x));
                        };
                        let account = &mut accounts[g];
                        match (&by_islands[g], &row) {
                            (Some(own), _) => {
                                let own = (&own[..], &context.islands);
                                account.by_islands(own, (change, &context.scale), set);
                            }
                            (None, Some(row)) if !groups[g].is_of_sensors() => {
                                account.states(&groups[g], row, change, set);
                            }
                            _ => account.still(change, &context.scale),
                        }
                    },
                );
            }
            for (k, block) in linear.reading_columns.chunks_exact(ns * own).enumerate() {
                let to = &mut to_readings[k * ns * m..(k + 1) * ns * m];
                spread(
                    block,
                    (groups, wanted),
                    &mut change[..ns],
                    to,
                    |g, change, set| {
                        accounts[g].readings(&groups[g], entries, change, set);
                    },
                );
            }
        }
        Ok(accounts.iter().map(Account::balances).collect())
    }
}

/// Distributes the changes of a row (`block`, as many numbers per group as `change` holds) to the
/// columns of the groups' members (`to`).
///
/// The changes of a group of one are copied. Others are separated by `apart`, which receives the
/// group's place, its changes and a setter for its members.
fn spread(
    block: &[f64],
    (groups, wanted): (&[Group], &[Wanted]),
    change: &mut [f64],
    to: &mut [f64],
    mut apart: impl FnMut(usize, &[f64], &mut dyn FnMut(usize, usize, f64)),
) {
    for (g, group) in groups.iter().enumerate() {
        let column = block.iter().skip(g).step_by(groups.len());
        change.iter_mut().zip(column).for_each(|(c, x)| *c = *x);
        let mut set = |member: usize, s: usize, x: f64| {
            let place = group.members[member];
            to[s * wanted.len() + place] = x / wanted[place].scale;
        };
        if group.members.len() == 1 {
            change.iter().enumerate().for_each(|(s, x)| set(0, s, *x));
        } else {
            apart(g, change, &mut set);
        }
    }
}
