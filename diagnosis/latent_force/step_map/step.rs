//! Steps of all simulations from one row to the next.
//!
//! Derivatives are the largest cost: one simulation per coordinate of the state, and one per value.
//! Where a row consists of many physics steps, they are those of one step in its middle, extended
//! to all of them ([`super::carried`]). This does not hold where the response to a change takes
//! several steps ([`one_step_tells`](crate::latent_force::one_step::one_step_tells)).

use std::collections::HashMap;

use crate::latent_force::islands::Islands;
use crate::latent_force::tangent::{difference, retract};
use asid_core::simulator::{StepHook, StepView};
use asid_core::{Control, Result, Rollout, Simulator as _};
use nalgebra::DMatrix;

use super::pass::{Part, STATE_STEP};
use super::role::Role;
use super::{Common, LinearEpisode, Request};

/// Fewest physics steps of a row for derivatives from one step: placing a simulation costs about as
/// much as a step.
const MANY: usize = 4;

/// Generalized forces applied to some rows of a rollout.
struct Push<'a> {
    islands: &'a Islands,
    /// The force at each degree of freedom.
    force: &'a [f64],
    /// For each row of the rollout: which forces act, and whether in the first physics step alone.
    rows: &'a [Option<(usize, bool)>],
}

impl StepHook for Push<'_> {
    fn before_step(&self, row: usize, step: usize, view: &mut StepView<'_>) {
        if let Some((slot, at_first)) = self.rows[row]
            && (step == 0 || !at_first)
        {
            for &dof in self.islands.pushed(slot) {
                view.force[dof] += self.force[dof];
            }
        }
    }
}

/// What is stepped together: roles, walks (by their places in the part), the row, and its physics
/// steps.
#[derive(Clone, Copy)]
pub(super) struct Stepped<'s> {
    pub(super) roles: &'s [Role],
    pub(super) now: &'s [usize],
    pub(super) k: usize,
    pub(super) substeps: usize,
}

impl Part {
    /// Steps some walks from a row to the next, and takes the differences there.
    pub(super) fn step_row(
        &mut self,
        c: &Common<'_>,
        stepped: Stepped<'_>,
        request: Request<'_>,
        out: &mut [LinearEpisode],
        row: &mut RowBuffers,
    ) -> Result<()> {
        let Stepped {
            roles,
            now,
            k,
            substeps,
        } = stepped;
        let (read, all): (Vec<usize>, Vec<usize>) =
            (0..roles.len()).partition(|&v| request.is_read_alone(roles[v]));
        let (mut short, mut whole) = (Vec::new(), all.clone());
        if c.one_step && substeps >= MANY {
            (short, whole) = self.told_by_one_step(c, stepped, request, out);
        }
        let mut done = 0;
        if !short.is_empty() {
            done = (substeps - 1) / 2;
            self.advance(c, (stepped, &whole), 0..done, request, row)?;
            self.place_at_nominal(c, (stepped, &short), request, row)?;
            self.advance(c, (stepped, &all), done..done + 1, request, row)?;
            done += 1;
            self.carry_over(c, (stepped, &all, &short), request, row, out);
        }
        self.advance(c, (stepped, &whole), done..substeps, request, row)?;
        for v in read {
            // Their command is that of the unperturbed model too: a drive's force depends on it.
            let sims: Vec<usize> = now.iter().map(|e| v * self.walks.len() + e).collect();
            self.simulator.follow(now, &sims)?;
        }
        let (nv, m) = (c.layout.nv, request.variations.len());
        let (nx, width) = (2 * nv, c.layout.nq + nv);
        let mut differ = vec![0.0; nx];
        for (i, &e) in now.iter().enumerate() {
            let nominal = row.state(i, width);
            let ahead = &request.trajectory[self.walks[e]][(k + 1) * width..(k + 2) * width];
            let defect = &mut out[e].defect[k * nx..(k + 1) * nx];
            difference(&c.layout, nominal, ahead, defect);
            for (place, &v) in whole.iter().enumerate().skip(1) {
                let other = row.state(place * now.len() + i, width);
                difference(&c.layout, other, nominal, &mut differ);
                let role = roles[v];
                let (matrix, columns) = match role {
                    Role::State(_) => (&mut out[e].a, nx),
                    Role::Force(_) => (&mut out[e].b, nv),
                    Role::Jolt(_) => (&mut out[e].jolt, nv),
                    Role::Varied(_) => (&mut out[e].state_columns, m),
                    Role::Nominal | Role::Reading(_) | Role::Ramp(_) => continue,
                };
                let told = |s: usize| match role {
                    Role::State(slot) => Some((c.islands.coordinate_told(slot, s)?, STATE_STEP)),
                    Role::Force(slot) | Role::Jolt(slot) => {
                        let dof = c.islands.dof_told(slot, s)?;
                        Some((dof, request.push[dof]))
                    }
                    Role::Varied(i) => Some((i, request.variations[i].scale)),
                    Role::Nominal | Role::Reading(_) | Role::Ramp(_) => None,
                };
                for (s, d) in differ.iter().enumerate() {
                    if let Some((at, scale)) = told(s) {
                        let value = d / scale;
                        matrix[(k * nx + s) * columns + at] =
                            if value.is_finite() { value } else { 0.0 };
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes some physics steps of a row in some roles; writes their states to `row.next`.
    fn advance(
        &mut self,
        c: &Common<'_>,
        (stepped, which): (Stepped<'_>, &[usize]),
        steps: std::ops::Range<usize>,
        request: Request<'_>,
        row: &mut RowBuffers,
    ) -> Result<()> {
        let Stepped { roles, now, k, .. } = stepped;
        let (n, nu) = (self.walks.len(), c.layout.nu());
        row.sims.clear();
        row.ctrl.clear();
        row.pushes.clear();
        for &v in which {
            for &e in now {
                row.sims.push(v * n + e);
                let ctrl = &c.walks[self.walks[e]].ctrl[k * nu..(k + 1) * nu];
                row.ctrl.extend_from_slice(ctrl);
                row.pushes.push(match roles[v] {
                    Role::Force(slot) => Some((slot, false)),
                    Role::Jolt(slot) if steps.start == 0 => Some((slot, true)),
                    _ => None,
                });
            }
        }
        let hook = Push {
            islands: &c.islands,
            force: request.push,
            rows: &row.pushes,
        };
        let mut rollout = Rollout::new(
            &row.sims,
            1,
            steps.len(),
            Control::PerSimulation(&row.ctrl),
            &c.states,
        );
        if row.pushes.iter().any(Option::is_some) {
            rollout.hook = Some(&hook);
        }
        let width = c.layout.nq + c.layout.nv;
        row.next.resize(row.sims.len() * width, 0.0);
        self.simulator.rollout(&rollout, &mut row.next)
    }

    /// Places the simulations of some roles at the present states of the nominal ones, the first of
    /// `row.next`.
    ///
    /// Those for derivatives with respect to the state have their coordinate moved. Where the
    /// engine has failed, they begin at the row.
    fn place_at_nominal(
        &mut self,
        c: &Common<'_>,
        (stepped, which): (Stepped<'_>, &[usize]),
        request: Request<'_>,
        row: &mut RowBuffers,
    ) -> Result<()> {
        let Stepped { roles, now, k, .. } = stepped;
        let (n, nq, nv) = (self.walks.len(), c.layout.nq, c.layout.nv);
        let width = nq + nv;
        row.sims.clear();
        row.qpos.clear();
        row.qvel.clear();
        let mut change = vec![0.0; 2 * nv];
        for &v in which {
            for (i, &e) in now.iter().enumerate() {
                let mut state = row.state(i, width).to_vec();
                if !state.iter().all(|x| x.is_finite()) {
                    let states = &request.trajectory[self.walks[e]];
                    state.copy_from_slice(&states[k * width..(k + 1) * width]);
                }
                if let Some(slot) = roles[v].slot() {
                    c.islands.moved(slot).for_each(|i| change[i] = STATE_STEP);
                    retract(&c.layout, &mut state, &change);
                    change.fill(0.0);
                }
                row.sims.push(v * n + e);
                row.qpos.extend_from_slice(&state[..nq]);
                row.qvel.extend_from_slice(&state[nq..]);
            }
        }
        let nominal = now.repeat(which.len());
        self.simulator.copy_state(&nominal, &row.sims)?;
        self.begin_anew(c, &row.sims, k)?;
        self.simulator.displace(&row.sims, &row.qpos, &row.qvel)
    }

    /// Resets simulations, with the time of row `k` of their walks: effects that grow with time
    /// count it from the beginning of the log.
    pub(super) fn reset_at(&mut self, c: &Common<'_>, sims: &[usize], k: usize) -> Result<()> {
        self.simulator.reset(sims)?;
        for &sim in sims {
            let walk = self.walks[sim % self.walks.len()];
            let steps = (c.walks[walk].time[k] / c.layout.timestep).round();
            self.simulator.pass_time(&[sim], steps as u64);
        }
        Ok(())
    }

    /// Resets the simulations that have failed, at row `k`.
    pub(super) fn begin_anew(&mut self, c: &Common<'_>, sims: &[usize], k: usize) -> Result<()> {
        let status = self.simulator.status();
        let failed = sims.iter().copied().filter(|&s| !status[s].is_running());
        let failed: Vec<usize> = failed.collect();
        if failed.is_empty() {
            return Ok(());
        }
        self.reset_at(c, &failed, k)
    }
}

/// Arrays of one row, kept between rows.
#[derive(Default)]
pub(super) struct RowBuffers {
    pub(super) sims: Vec<usize>,
    pub(super) qpos: Vec<f64>,
    pub(super) qvel: Vec<f64>,
    ctrl: Vec<f64>,
    pushes: Vec<Option<(usize, bool)>>,
    pub(super) read: Vec<f64>,
    next: Vec<f64>,
    /// The last derivative of one step of each walk that is not a jump.
    pub(super) of_step: HashMap<usize, DMatrix<f64>>,
}

impl RowBuffers {
    /// Returns one of the stepped states, of the given width.
    pub(super) fn state(&self, place: usize, width: usize) -> &[f64] {
        &self.next[place * width..(place + 1) * width]
    }
}
