//! Uncoupled degrees of freedom, each filtered as a block of its own.
//!
//! Two arms on a table, or an arm and an object beside it, each move on their own. The transition
//! and the derivatives with respect to forces and of the readings are block-diagonal, and so is the
//! covariance. One filter per block gives the same result as one filter for all. Its cost grows
//! with the cube of the largest block.
//!
//! The blocks are found in the derivatives themselves, where a coupling is an entry larger than
//! rounding. No knowledge of the machine is needed. Bodies that touch in some row of an episode
//! form one block throughout it.

use nalgebra::{DMatrix, DVector};

use crate::latent_force::islands::{Joined, depends};
use crate::latent_force::step_map::LinearEpisode;

use super::{NoiseModel, Problem, Regression, Smoothed, Start};

/// The blocks of an episode: degrees of freedom and entries of a reading in each.
pub(super) struct Blocks {
    dofs: Vec<Vec<usize>>,
    entries: Vec<Vec<usize>>,
}

/// Returns whether the readings of an episode tell of the force at each degree of freedom: whether
/// its block has one that is present.
pub(super) fn told(problem: Problem<'_>, noise: &NoiseModel) -> Vec<bool> {
    let (linear, b) = (problem.linear, problem.b);
    let nv = noise.q.len();
    let nx = 2 * nv;
    let mut joined = Joined::new(nv);
    let rows = linear.a.chunks_exact(nx).zip(b.chunks_exact(nv));
    for (row, (a, b)) in rows.enumerate() {
        joined.couple(a, Some(row % nv));
        joined.couple(b, Some(row % nv));
        if joined.sets() == 1 {
            break;
        }
    }
    let mut read = vec![false; nv];
    for (h, residual) in linear.h.chunks_exact(nx).zip(&linear.residual) {
        joined.couple(h, None);
        if residual.is_finite() {
            depends(h).for_each(|place| read[place % nv] = true);
        }
    }
    let mut told = vec![false; nv];
    for d in (0..nv).filter(|&d| read[d]) {
        told[joined.root(d)] = true;
    }
    (0..nv).map(|d| told[joined.root(d)]).collect()
}

impl Blocks {
    /// Finds the blocks of an episode; `None` if it is a single block.
    pub(super) fn of(problem: Problem<'_>, noise: &NoiseModel) -> Option<Self> {
        let (linear, b) = (problem.linear, problem.b);
        let (nv, ns) = (noise.q.len(), noise.r.len());
        let nx = 2 * nv;
        let mut joined = Joined::new(nv);
        for (row, (a, b)) in linear
            .a
            .chunks_exact(nx)
            .zip(b.chunks_exact(nv))
            .enumerate()
        {
            joined.couple(a, Some(row % nv));
            joined.couple(b, Some(row % nv));
            if joined.sets() == 1 {
                return None;
            }
        }
        for h in linear.h.chunks_exact(nx) {
            joined.couple(h, None);
        }
        if joined.sets() < 2 {
            return None;
        }
        let of_dof = joined.numbered();
        let mut blocks = Self {
            dofs: vec![Vec::new(); joined.sets()],
            entries: vec![Vec::new(); joined.sets()],
        };
        for (d, &own) in of_dof.iter().enumerate() {
            blocks.dofs[own].push(d);
        }
        for entry in 0..ns {
            let slopes = linear.h.chunks_exact(nx).skip(entry).step_by(ns);
            let read = slopes.flat_map(depends).next();
            // An entry that depends on no state may go to any block.
            blocks.entries[read.map_or(0, |i| of_dof[i % nv])].push(entry);
        }
        Some(blocks)
    }

    /// Returns the number of degrees of freedom of each block.
    #[cfg(test)]
    pub(super) fn sizes(&self) -> Vec<usize> {
        self.dofs.iter().map(Vec::len).collect()
    }

    /// Splits an episode into its blocks, without columns.
    fn parts<'b, 'a: 'b>(
        &'b self,
        problem: Problem<'a>,
        noise: &'b NoiseModel,
    ) -> impl Iterator<Item = Owned<'a>> + 'b {
        let each = self.dofs.iter().zip(&self.entries);
        each.map(move |own| Owned::of(problem, noise, (own.0, own.1)))
    }

    /// Returns the log-likelihood of an episode.
    pub(super) fn log_likelihood(&self, problem: Problem<'_>, noise: &NoiseModel) -> f64 {
        let parts = self.parts(problem, noise);
        parts
            .map(|p| super::log_likelihood_of_one(p.problem(), &p.noise))
            .sum()
    }

    /// Returns the regression of an episode on its `m` columns, or on `some` of them.
    pub(super) fn regress(
        &self,
        problem: Problem<'_>,
        noise: &NoiseModel,
        (m, some): (usize, Option<&[usize]>),
    ) -> Regression {
        let asked: Vec<usize> = some.map_or_else(|| (0..m).collect(), <[usize]>::to_vec);
        let n = asked.len();
        let mut out = Regression {
            log_likelihood: 0.0,
            gram: DMatrix::zeros(n, n),
            moment: DVector::zeros(n),
        };
        for mut part in self.parts(problem, noise) {
            let places = part.take_columns(problem.linear, (m, &asked));
            let found = super::regress::regress(part.problem(), &part.noise, (places.len(), None));
            out.log_likelihood += found.log_likelihood;
            for (i, &p) in places.iter().enumerate() {
                out.moment[p] += found.moment[i];
                for (j, &q) in places.iter().enumerate() {
                    out.gram[(p, q)] += found.gram[(i, j)];
                }
            }
        }
        out
    }

    /// Smooths an episode.
    pub(super) fn smooth(&self, problem: Problem<'_>, noise: &NoiseModel) -> Smoothed {
        let rows = problem.linear.rows;
        let mut out = Smoothed::unmoved(rows, noise);
        let (nv, nx) = (noise.q.len(), 2 * noise.q.len());
        let parts = self.parts(problem, noise);
        for ((part, dofs), entries) in parts.zip(&self.dofs).zip(&self.entries) {
            let found = super::smooth_one(part.problem(), &part.noise);
            let coordinates = coordinates(dofs, nv);
            out.log_likelihood += found.log_likelihood;
            spread(&found.change, &coordinates, nx, &mut out.change);
            spread(
                &found.change_variance,
                &coordinates,
                nx,
                &mut out.change_variance,
            );
            spread(&found.force, dofs, nv, &mut out.force);
            spread(&found.force_variance, dofs, nv, &mut out.force_variance);
            (out.sums.steps, out.sums.seconds) = (found.sums.steps, found.sums.seconds);
            for (i, &d) in dofs.iter().enumerate() {
                out.sums.force[d] = found.sums.force[i];
                out.sums.white[d] = found.sums.white[i];
            }
            for (i, &entry) in entries.iter().enumerate() {
                out.sums.reading[entry] = found.sums.reading[i];
            }
        }
        out
    }
}

/// Tangent coordinates of some of `nv` degrees of freedom, positions before speeds.
fn coordinates(dofs: &[usize], nv: usize) -> Vec<usize> {
    let speeds = dofs.iter().map(|d| nv + d);
    dofs.iter().copied().chain(speeds).collect()
}

/// Writes the values of a block to their places in each row of `n` numbers.
fn spread(own: &[f64], places: &[usize], n: usize, to: &mut [f64]) {
    let rows = own.chunks_exact(places.len()).zip(to.chunks_exact_mut(n));
    for (own, to) in rows {
        places.iter().zip(own).for_each(|(&p, x)| to[p] = *x);
    }
}

/// Selects some places of each row of `n` numbers, for some rows of every `period`.
fn pick(
    all: &[f64],
    (n, places): (usize, &[usize]),
    (period, rows): (usize, &[usize]),
) -> Vec<f64> {
    let mut out = Vec::with_capacity(all.len() / (n * period).max(1) * rows.len() * places.len());
    for group in all.chunks_exact((n * period).max(1)) {
        for &row in rows {
            out.extend(places.iter().map(|&p| group[row * n + p]));
        }
    }
    out
}

/// One block of an episode, which owns what a [`Problem`] borrows.
struct Owned<'a> {
    of: Problem<'a>,
    linear: LinearEpisode,
    b: Vec<f64>,
    start: Start,
    free: Vec<f64>,
    noise: NoiseModel,
    /// The block's coordinates of the state and its entries of a reading, each with the number of
    /// all in the episode.
    own: [(Vec<usize>, usize); 2],
}

impl<'a> Owned<'a> {
    /// Extracts the block of some degrees of freedom and entries, without columns.
    fn of(problem: Problem<'a>, noise: &NoiseModel, (dofs, entries): (&[usize], &[usize])) -> Self {
        let (nv, ns) = (noise.q.len(), noise.r.len());
        let nx = 2 * nv;
        let linear = problem.linear;
        let own = coordinates(dofs, nv);
        let some = |all: &[f64], places: &[usize]| -> Vec<f64> {
            places.iter().filter_map(|&p| all.get(p).copied()).collect()
        };
        let mut defect = pick(&linear.defect, (1, &[0]), (nx, &own));
        // Where the engine failed, no part of the machine was stepped.
        let rows = defect
            .chunks_exact_mut(own.len())
            .zip(linear.defect.chunks_exact(nx));
        for (part, whole) in rows {
            if !whole.iter().all(|x| x.is_finite()) {
                part.fill(f64::NAN);
            }
        }
        Self {
            of: problem,
            linear: LinearEpisode {
                rows: linear.rows,
                defect,
                a: pick(&linear.a, (nx, &own), (nx, &own)),
                residual: pick(&linear.residual, (1, &[0]), (ns, entries)),
                h: pick(&linear.h, (nx, &own), (ns, entries)),
                early: some(&linear.early, entries),
                ..LinearEpisode::default()
            },
            b: pick(problem.b, (nv, dofs), (nx, &own)),
            start: Start {
                mean: some(&problem.start.mean, &own),
                variance: some(&problem.start.variance, &own),
                unknown: some(&problem.start.unknown, &own),
            },
            free: pick(problem.free, (1, &[0]), (nv, dofs)),
            noise: NoiseModel {
                q: some(&noise.q, dofs),
                tau: some(&noise.tau, dofs),
                white: some(&noise.white, dofs),
                r: some(&noise.r, entries),
            },
            own: [(own, nx), (entries.to_vec(), ns)],
        }
    }

    /// Copies the requested columns that are non-zero in the block; returns their places among the
    /// requested ones.
    fn take_columns(
        &mut self,
        linear: &LinearEpisode,
        (m, asked): (usize, &[usize]),
    ) -> Vec<usize> {
        let [of_states, of_readings] = &self.own;
        let along = [
            (&linear.state_columns, of_states),
            (&linear.reading_columns, of_readings),
        ];
        let mut shows = vec![false; asked.len()];
        for (columns, (rows, period)) in along {
            for group in columns.chunks_exact((m * period).max(1)) {
                for &row in rows {
                    let own = &group[row * m..(row + 1) * m];
                    let each = shows.iter_mut().zip(asked);
                    each.for_each(|(s, &c)| *s |= own[c] != 0.0);
                }
            }
        }
        let places: Vec<usize> = (0..asked.len()).filter(|&i| shows[i]).collect();
        let columns: Vec<usize> = places.iter().map(|&i| asked[i]).collect();
        let [states, readings] =
            along.map(|(all, (rows, period))| pick(all, (m, &columns), (*period, rows)));
        (self.linear.state_columns, self.linear.reading_columns) = (states, readings);
        places
    }

    fn problem(&self) -> Problem<'_> {
        Problem {
            walk: self.of.walk,
            linear: &self.linear,
            b: &self.b,
            start: &self.start,
            free: &self.free,
            scatter: &[],
        }
    }
}
