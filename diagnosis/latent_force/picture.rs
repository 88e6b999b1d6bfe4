//! The missing force along the logs, as the report draws it.
//!
//! The report plots it against time, speed, position and load, before and with the accepted
//! effects, together with the force that these effects add to the model.

use asid_core::layout::JointKind;
use asid_core::{Layout, Result};
use nalgebra::{DMatrix, DVector};

use crate::candidate::Candidate;
use crate::trace::{ForceSeries, ForceTrace};

use super::context::Context;
use super::estimate::Estimate;
use super::search::Outcome;
use super::step_map::{Derivatives, Variation};

/// Largest number of degrees of freedom that are shown: as many as an arm has.
const SHOWN: usize = 6;
/// A degree of freedom is shown from this share of the largest missing force on, both relative to
/// the inertial forces.
const LEAST: f64 = 0.02;
/// Rows of the stretch drawn against time, and most rows drawn against speed, position and load.
const ROWS: usize = 400;
/// Significant digits that are kept of a number: a picture shows three.
const DIGITS: i32 = 5;

/// Name, place in the layout and kind of motion of a degree of freedom.
pub(super) struct Dof {
    /// Name of the joint, with the axis if the joint has several.
    pub(super) name: String,
    /// Index of the joint in the layout.
    joint: usize,
    /// Index in `qpos`; `None` for a rotation about a free axis.
    position: Option<usize>,
    /// Whether it is a rotation.
    turns: bool,
}

impl Dof {
    /// Unit of its force.
    pub(super) fn unit(&self) -> &'static str {
        if self.turns { "N m" } else { "N" }
    }
}

/// All degrees of freedom, in the order of `qvel`.
pub(super) fn dofs(layout: &Layout) -> Vec<Dof> {
    let mut all = Vec::with_capacity(layout.nv);
    for (joint, j) in layout.joints.iter().enumerate() {
        let axes: &[(&str, bool)] = match j.kind {
            JointKind::Slide => &[("", false)],
            JointKind::Hinge => &[("", true)],
            JointKind::Ball => &[(".rx", true), (".ry", true), (".rz", true)],
            JointKind::Free => &[
                (".x", false),
                (".y", false),
                (".z", false),
                (".rx", true),
                (".ry", true),
                (".rz", true),
            ],
        };
        for (i, &(axis, turns)) in axes.iter().enumerate() {
            all.push(Dof {
                name: format!("{}{axis}", j.name),
                joint,
                position: (axis.is_empty() || !turns).then_some(j.qpos + i),
                turns,
            });
        }
    }
    all
}

/// Rounds a number to the digits that a picture needs.
fn short(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let scale = 10f64.powi(DIGITS - 1 - x.abs().log10().floor() as i32);
    (x * scale).round() / scale
}

/// Force that the accepted effects, and the values fitted with them, add to the model without
/// effects.
///
/// It is the change of the speeds after a row, divided by the derivatives with respect to forces.
/// `(rows - 1) x nv`, one a walk; empty where no effect is accepted.
fn law(
    context: &Context<'_>,
    outcome: &Outcome,
    candidates: &[Candidate],
) -> Result<Vec<Vec<f64>>> {
    let (none, best) = (&outcome.none, &outcome.best);
    let fitted = &best.fitted;
    if best.candidates.is_empty() {
        return Ok(vec![Vec::new(); context.walks.len()]);
    }
    let nulls = best.candidates.iter().flat_map(|&c| {
        let parameters = candidates[c].parameters();
        parameters.iter().map(|p| p.null)
    });
    let theta: Vec<f64> = none.theta.iter().copied().chain(nulls).collect();
    let model = &fitted.hypothesis;
    let mut map = context.map(&model.specs, &model.parameters(), 2)?;
    let with = Variation {
        theta: fitted.theta.clone(),
        scale: 1.0,
    };
    let states = &fitted.estimate.trajectory;
    let linear = map.linearise(&theta, states, Derivatives::default(), &[], &[with])?;
    let nv = context.plant().layout.nv;
    let nx = 2 * nv;
    let walks = context.walks.iter().zip(&linear).zip(&none.estimate.b);
    let along = walks.map(|((walk, linear), b)| {
        if walk.segment.is_some() {
            return Vec::new();
        }
        let rows = walk.len() - 1;
        let mut forces = vec![f64::NAN; rows * nv];
        for k in 0..rows {
            let change = DVector::from_fn(nv, |i, _| linear.state_columns[k * nx + nv + i]);
            let slopes = DMatrix::from_fn(nv, nv, |i, j| b[(k * nx + nv + i) * nv + j]);
            if let Some(force) = slopes.lu().solve(&change) {
                forces[k * nv..(k + 1) * nv].copy_from_slice(force.as_slice());
            }
        }
        forces
    });
    Ok(along.collect())
}

/// The degrees of freedom that lack the most force relative to their inertial force, largest first.
///
/// Those of whose force no reading tells come last, and only if there are no others.
pub(super) fn most_missing_of(context: &Context<'_>, estimate: &Estimate) -> Vec<usize> {
    let missing = |d: usize| estimate.missing_power(context, d).sqrt();
    let mut order: Vec<usize> = (0..estimate.noise.q.len()).collect();
    order.sort_by(|&a, &b| missing(b).total_cmp(&missing(a)));
    let most = order.first().map_or(0.0, |&d| missing(d));
    order.retain(|&d| missing(d) >= LEAST * most);
    order.truncate(SHOWN);
    order
}

/// Traces of the missing force at the degrees of freedom that lack the most.
///
/// # Errors
/// When the engine fails.
pub(super) fn forces(
    context: &Context<'_>,
    outcome: &Outcome,
    candidates: &[Candidate],
) -> Result<Vec<ForceTrace>> {
    let smoothed: Vec<usize> = (0..context.walks.len())
        .filter(|&w| context.walks[w].segment.is_none())
        .collect();
    let dofs = dofs(&context.plant().layout);
    let order = most_missing_of(context, &outcome.none.estimate);
    if smoothed.is_empty() {
        return Ok(Vec::new());
    }
    let law = law(context, outcome, candidates)?;
    let rows: Vec<(usize, usize)> = smoothed
        .iter()
        .flat_map(|&w| (0..context.walks[w].len() - 1).map(move |k| (w, k)))
        .collect();
    let spread: Vec<(usize, usize)> = rows
        .iter()
        .step_by(rows.len().div_ceil(ROWS).max(1))
        .copied()
        .collect();
    // All rows of the episode that lacks the most force, at the degree of freedom that lacks the
    // most.
    let first = most_missing(context, outcome, &smoothed, order[0]);
    let of_episode = first
        .first()
        .map_or(0..0, |s| 0..context.walks[s.0].len() - 1);
    let whole: Vec<(usize, usize)> = (of_episode.clone())
        .step_by(of_episode.len().div_ceil(asid_view::motion::FRAMES).max(1))
        .map(|k| (first[0].0, k))
        .collect();
    let trace = |&d: &usize| {
        let stretch = most_missing(context, outcome, &smoothed, d);
        let walk = stretch.first().map_or(0, |s| s.0);
        let episode = &context.logs.episodes[context.walks[walk].episode];
        ForceTrace {
            dof: dofs[d].name.clone(),
            unit: dofs[d].unit().to_owned(),
            position_unit: if dofs[d].turns { "rad" } else { "m" }.to_owned(),
            episode: episode.name.clone(),
            stretch: series(context, outcome, &law, (&dofs[d], d), &stretch),
            spread: series(context, outcome, &law, (&dofs[d], d), &spread),
            whole: ForceSeries {
                position: Vec::new(),
                speed: Vec::new(),
                load: Vec::new(),
                law: Vec::new(),
                ..series(context, outcome, &law, (&dofs[d], d), &whole)
            },
        }
    };
    Ok(order.iter().map(trace).collect())
}

/// The rows of one walk, [`ROWS`] at most, that lack the most force at a degree of freedom.
fn most_missing(
    context: &Context<'_>,
    outcome: &Outcome,
    smoothed: &[usize],
    d: usize,
) -> Vec<(usize, usize)> {
    let nv = context.plant().layout.nv;
    let mut best = (f64::NEG_INFINITY, 0..0, 0);
    for &w in smoothed {
        let rows = context.walks[w].len() - 1;
        let force = &outcome.none.estimate.smoothed[w].force;
        for first in (0..rows).step_by(ROWS / 2) {
            let range = first..rows.min(first + ROWS);
            let power: f64 = range.clone().map(|k| force[k * nv + d].powi(2)).sum();
            if power > best.0 {
                best = (power, range, w);
            }
        }
    }
    let (_, range, w) = best;
    range.map(|k| (w, k)).collect()
}

/// Series of a degree of freedom along some rows, each given as (walk, row).
pub(super) fn series(
    context: &Context<'_>,
    outcome: &Outcome,
    law: &[Vec<f64>],
    (dof, d): (&Dof, usize),
    rows: &[(usize, usize)],
) -> ForceSeries {
    let plant = context.plant();
    let (nq, nv, nu) = (plant.layout.nq, plant.layout.nv, plant.layout.nu());
    let estimate = [&outcome.none.estimate, &outcome.best.fitted.estimate];
    let along = |f: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
        rows.iter().map(|&(w, k)| short(f(w, k))).collect()
    };
    let state = |w: usize, k: usize| {
        let states = &estimate[1].trajectory[w];
        &states[k * (nq + nv)..(k + 1) * (nq + nv)]
    };
    let force = |which: usize| along(&|w, k| estimate[which].smoothed[w].force[k * nv + d]);
    let drives: Vec<_> = plant.drives_of(dof.joint).collect();
    let load = |w: usize, k: usize| -> f64 {
        let (qpos, qvel) = state(w, k).split_at(nq);
        let ctrl = &context.walks[w].ctrl[k * nu..(k + 1) * nu];
        let position = dof.position.map_or(f64::NAN, |p| qpos[p]);
        drives
            .iter()
            .map(|(i, drive)| drive.force(ctrl[*i], position, qvel[d]))
            .sum()
    };
    ForceSeries {
        time: along(&|w, k| {
            let walk = &context.walks[w];
            let log = &context.logs.episodes[walk.episode].episode;
            log.time[walk.rows[k]] - log.time[0]
        }),
        position: (dof.position).map_or_else(Vec::new, |p| along(&|w, k| state(w, k)[p])),
        speed: along(&|w, k| state(w, k)[nq + d]),
        // The force of a drive with a filter or a delay does not follow from the present command.
        load: if drives.is_empty() || !drives.iter().all(|(_, d)| d.is_memoryless()) {
            Vec::new()
        } else {
            along(&load)
        },
        before: force(0),
        // A fit that was stopped at its first linearisation has no new smoothed force.
        after: if force(1) == force(0) && !law.iter().all(Vec::is_empty) {
            Vec::new()
        } else {
            force(1)
        },
        law: if law.iter().all(Vec::is_empty) {
            Vec::new()
        } else {
            along(&|w, k| law[w].get(k * nv + d).copied().unwrap_or(f64::NAN))
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_digits_that_are_seen() {
        assert_eq!(short(123_456.789), 123_460.0);
        assert_eq!(short(-0.001_234_567), -0.001_234_6);
        assert_eq!(short(0.0), 0.0);
        assert!(short(f64::NAN).is_nan());
    }
}
