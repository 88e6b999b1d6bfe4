//! Replays of short segments from their initial states, and readings there.

use asid_core::{Result, Simulator as _};

use crate::latent_force::walk::Walk;

use super::Common;
use super::leg::legs;
use super::pass::Part;

/// Most rows in one rollout. A replay beyond its limit is noticed only after them.
const ROWS: usize = 16;

impl Part {
    /// Sets the parameters of some of its walks' simulations, and places them at given states
    /// (`nq + nv`).
    fn begin_at(
        &mut self,
        c: &Common<'_>,
        theta: &[f64],
        (which, states): (&[usize], &[&[f64]]),
    ) -> Result<()> {
        let nq = c.layout.nq;
        let mut columns = Vec::new();
        for &e in which {
            c.columns
                .push(theta, c.episode(self.walks[e]), &mut columns);
        }
        self.reset_at(c, which, 0)?;
        self.simulator.set_parameters(which, &columns)?;
        let qpos: Vec<f64> = states.iter().flat_map(|s| s[..nq].to_vec()).collect();
        let qvel: Vec<f64> = states.iter().flat_map(|s| s[nq..].to_vec()).collect();
        self.simulator.set_state(which, &qpos, &qvel)
    }

    /// Returns what the logs' sensors read at a state of each of its walks.
    pub(super) fn readings_at(
        &mut self,
        c: &Common<'_>,
        theta: &[f64],
        states: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>> {
        let which: Vec<usize> = (0..self.walks.len()).collect();
        let states: Vec<&[f64]> = self.walks.iter().map(|&w| &states[w][..]).collect();
        self.begin_at(c, theta, (&which, &states))?;
        let mut read = vec![0.0; which.len() * c.readings.width()];
        self.simulator.read(&which, &c.readings, &mut read)?;
        let each = read.chunks_exact(c.readings.width());
        Ok(each.map(<[f64]>::to_vec).collect())
    }

    /// Replays some of its segments; see [`StepMap::roll`](super::StepMap::roll).
    pub(super) fn roll(
        &mut self,
        c: &Common<'_>,
        (theta, variance): (&[f64], &[f64]),
        (states, most): (&mut [Vec<f64>], &[Option<f64>]),
    ) -> Result<Vec<f64>> {
        let width = c.layout.nq + c.layout.nv;
        let walks: Vec<&Walk> = self.walks.iter().map(|&w| &c.walks[w]).collect();
        let mut going: Vec<usize> = (0..walks.len())
            .filter(|&e| walks[e].segment.is_some() && most[self.walks[e]].is_some())
            .collect();
        let mut left = vec![0.0; walks.len()];
        if going.is_empty() {
            return Ok(left);
        }
        let first: Vec<&[f64]> = going.iter().map(|&e| &states[e][..width]).collect();
        self.begin_at(c, theta, (&going, &first))?;
        let mut differ = vec![0.0; c.logs.entries.len()];
        let mut sum = |e: usize, k: usize, read: &[f64]| {
            c.residual((walks[e], k), read, &mut differ);
            let present = differ.iter().zip(variance).filter(|(d, _)| !d.is_nan());
            present.map(|(d, v)| d * d / v).sum::<f64>()
        };
        let limit: Vec<f64> = self.walks.iter().map(|&w| most[w].unwrap_or(0.0)).collect();
        let readings = c.readings.width();
        let mut read = vec![0.0; going.len() * readings];
        self.simulator.read(&going, &c.readings, &mut read)?;
        for (&e, read) in going.iter().zip(read.chunks_exact(readings)) {
            left[e] = within(sum(e, 0, read), limit[e]);
        }
        let (mut reached, mut rolled) = (vec![0; walks.len()], Vec::new());
        loop {
            going.retain(|&e| left[e].is_finite());
            let next = legs(&walks, (&going, &reached), ROWS);
            if next.is_empty() {
                return Ok(left);
            }
            for leg in next {
                self.roll_on(c, (&leg, 1), &mut rolled)?;
                let rows = rolled.chunks_exact(c.states_and_readings.width());
                for (i, row) in rows.enumerate() {
                    let e = leg.walks[i / leg.rows];
                    let (state, read) = row.split_at(width);
                    if !left[e].is_finite() {
                        continue;
                    }
                    if !state.iter().all(|x| x.is_finite()) {
                        left[e] = f64::INFINITY;
                        continue;
                    }
                    reached[e] += 1;
                    let k = reached[e];
                    states[e][k * width..(k + 1) * width].copy_from_slice(state);
                    left[e] = within(left[e] + sum(e, k, read), limit[e]);
                }
            }
        }
    }
}

/// The sum, or infinity beyond the limit.
fn within(sum: f64, limit: f64) -> f64 {
    if sum <= limit { sum } else { f64::INFINITY }
}
