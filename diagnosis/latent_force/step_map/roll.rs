//! Replays of short segments from their initial states, and readings there.

use asid_core::{Control, Result, Rollout, Simulator as _};

use crate::latent_force::walk::{Walk, by_substeps};

use super::Common;
use super::pass::Part;

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
        let (nq, nu) = (c.layout.nq, c.layout.nu());
        let width = nq + c.layout.nv;
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
        let (entries, readings) = (c.logs.entries.len(), c.readings.width());
        let mut read = Vec::new();
        let mut differ = vec![0.0; entries];
        let mut next = Vec::new();
        let longest = going.iter().map(|&e| walks[e].len()).max().unwrap_or(0);
        for k in 0..longest {
            going.retain(|&e| walks[e].len() > k);
            read.resize(going.len() * readings, 0.0);
            self.simulator.read(&going, &c.readings, &mut read)?;
            for (&e, read) in going.iter().zip(read.chunks_exact(readings)) {
                if walks[e].segment.is_some_and(|lead| k < lead) {
                    continue;
                }
                let logged = &c.logs.episodes[walks[e].episode].readings;
                let at = walks[e].rows[k] * readings;
                c.logs
                    .reading_difference(&logged[at..at + readings], read, &mut differ);
                let present = differ.iter().zip(variance).filter(|(d, _)| !d.is_nan());
                left[e] += present.map(|(d, v)| d * d / v).sum::<f64>();
            }
            going.retain(|&e| {
                let goes_on = most[self.walks[e]].is_some_and(|most| left[e] <= most);
                if !goes_on {
                    left[e] = f64::INFINITY;
                }
                goes_on && left[e].is_finite()
            });
            for (substeps, now) in by_substeps(&walks, going.clone(), k) {
                let ctrl: Vec<f64> = now
                    .iter()
                    .flat_map(|&e| walks[e].ctrl[k * nu..(k + 1) * nu].to_vec())
                    .collect();
                let control = Control::PerSimulation(&ctrl);
                let rollout = Rollout::new(&now, 1, substeps, control, &c.states);
                next.resize(now.len() * width, 0.0);
                self.simulator.rollout(&rollout, &mut next)?;
                let status = self.simulator.status();
                for (&e, next) in now.iter().zip(next.chunks_exact(width)) {
                    if status[e].is_running() && next.iter().all(|x| x.is_finite()) {
                        states[e][(k + 1) * width..(k + 2) * width].copy_from_slice(next);
                    } else {
                        left[e] = f64::INFINITY;
                    }
                }
            }
        }
        Ok(left)
    }
}
