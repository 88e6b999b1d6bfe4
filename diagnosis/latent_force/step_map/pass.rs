//! One pass along the rows: every simulation is set to the trajectory at each row, read, and
//! stepped to the next.
//!
//! Segments are replayed from their first row ([`super::along`]). They take a pass only where
//! derivatives with respect to forces are wanted, and for values of effects on readings: those
//! simulations follow the unperturbed one and are only read.

use std::collections::BTreeMap;

use asid_core::{Result, Simulator as _};
use asid_effects::refined::RefinedSimulator;

use crate::latent_force::tangent::retract;
use crate::latent_force::walk::{Walk, by_substeps};

use super::late::retime;
use super::role::Role;
use super::step::{RowBuffers, Stepped};
use super::{Common, LinearEpisode, Request};

/// Step of the finite differences in a coordinate of the state, rad, m, rad/s or m/s.
///
/// Forward differences of smooth dynamics in double precision are right to about six digits.
pub(super) const STATE_STEP: f64 = 1e-6;

/// What is wanted of a walk: whether it is replayed from its first row, derivatives with respect to
/// its state, columns of all variations, and the blind coordinates of its initial state.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Class<'r> {
    replayed: bool,
    state: bool,
    columns: bool,
    blind: &'r [bool],
}

/// The walks of one core: a row is too little work to distribute.
pub(super) struct Part {
    pub(super) walks: Vec<usize>,
    pub(super) simulator: RefinedSimulator,
}

impl Part {
    /// Linearises its walks.
    pub(super) fn linearise(
        &mut self,
        c: &Common<'_>,
        request: Request<'_>,
    ) -> Result<Vec<LinearEpisode>> {
        let Request {
            want, variations, ..
        } = request;
        let nv = c.layout.nv;
        let nx = 2 * nv;
        let mut in_state = Vec::new();
        if want.state {
            in_state = Role::in_state((c.islands.slots(), nv), c.remembers_readings);
        }
        let others = Role::others(c.islands.slots(), want, variations.len());
        let (ns, m) = (c.logs.entries.len(), variations.len());
        let mut episodes: Vec<LinearEpisode> = self
            .walks
            .iter()
            .map(|&w| LinearEpisode::empty(c.walks[w].len(), (nv, ns, m), want, c.rolls(w, want)))
            .collect();
        let late = usize::from(want.state && c.remembers_readings);
        let mut ramps: Vec<Vec<f64>> = episodes
            .iter()
            .map(|e| vec![0.0; late * e.rows * ns * nv])
            .collect();
        for (class, which) in self.classes(c, request) {
            let wanted = |role: &Role| match role {
                Role::Varied(i) => request.wants(*i, class.columns),
                Role::State(i) => class.state && !class.blind.get(*i).is_some_and(|blind| *blind),
                Role::Reading(_) | Role::Ramp(_) => !class.replayed,
                _ => true,
            };
            let states = in_state.iter().filter(|_| class.state);
            let roles: Vec<Role> = states.chain(&others).copied().filter(wanted).collect();
            if class.replayed {
                self.replay(c, request, (&roles, &which), (&mut episodes, &mut ramps))?;
                continue;
            }
            for chunk in chunks(&roles, c.capacity - 1) {
                self.pass(c, request, (chunk, &which), &mut episodes, &mut ramps)?;
            }
        }
        if late == 1 {
            for ((episode, ramps), &w) in episodes.iter_mut().zip(&ramps).zip(&self.walks) {
                if c.rolls(w, want) {
                    continue;
                }
                retime(episode, &c.walks[w].time, (ramps, &c.late), (nx, m));
            }
        }
        Ok(episodes)
    }

    /// Linearises some of its segments in some roles.
    fn replay(
        &mut self,
        c: &Common<'_>,
        request: Request<'_>,
        (roles, which): (&[Role], &[bool]),
        (out, ramps): (&mut [LinearEpisode], &mut [Vec<f64>]),
    ) -> Result<()> {
        let (read, stepped): (Vec<Role>, Vec<Role>) =
            roles.iter().partition(|role| request.is_read_alone(**role));
        for chunk in read.chunks(c.capacity - 1) {
            self.pass(c, request, (chunk, which), out, ramps)?;
        }
        for chunk in chunks(&stepped, c.capacity - 1) {
            self.replay_stepped(c, request, (chunk, which), out)?;
        }
        Ok(())
    }

    /// Groups its walks by what is wanted of them, one flag per walk.
    fn classes<'r>(&self, c: &Common<'_>, request: Request<'r>) -> BTreeMap<Class<'r>, Vec<bool>> {
        let mut classes = BTreeMap::new();
        for (e, &w) in self.walks.iter().enumerate() {
            let state = request.want.state && request.due(w);
            let replayed = c.rolls(w, request.want);
            let class = Class {
                replayed,
                state,
                columns: request.anew.columns.get(w).is_some_and(|due| *due),
                blind: if state && replayed {
                    request.blind(w)
                } else {
                    &[]
                },
            };
            let which = classes.entry(class);
            which.or_insert_with(|| vec![false; self.walks.len()])[e] = true;
        }
        classes
    }

    /// Runs one pass along some of the episodes, for some roles in addition to the nominal one.
    fn pass(
        &mut self,
        c: &Common<'_>,
        request: Request<'_>,
        (extra, which): (&[Role], &[bool]),
        out: &mut [LinearEpisode],
        ramps: &mut [Vec<f64>],
    ) -> Result<()> {
        let mut row = RowBuffers::default();
        let (roles, some) = self.begin(c, request, (extra, which), &mut row)?;
        let walks: Vec<&Walk> = self.walks.iter().map(|&w| &c.walks[w]).collect();
        let longest = walks.iter().map(|w| w.len()).max().unwrap_or(0);
        let replayed = some.iter().any(|&e| c.rolls(self.walks[e], request.want));
        for k in 0..longest {
            let reach = |e: &usize| walks[*e].len() > k;
            let here: Vec<usize> = some.iter().copied().filter(reach).collect();
            if k > 0 && !replayed {
                self.place(c, &roles, (&here, k), request, &mut row)?;
            }
            self.read_row(c, &roles, (&here, k), request, (out, ramps), &mut row)?;
            for (substeps, now) in by_substeps(&walks, here, k) {
                let stepped = Stepped {
                    roles: &roles,
                    now: &now,
                    k,
                    substeps,
                };
                self.step_row(c, stepped, request, out, &mut row)?;
            }
        }
        Ok(())
    }

    /// Resets some walks' simulations, for the unperturbed model and some roles, with their values
    /// and at their first rows.
    ///
    /// Returns the roles, the unperturbed one first, and the walks' places.
    pub(super) fn begin(
        &mut self,
        c: &Common<'_>,
        request: Request<'_>,
        (extra, which): (&[Role], &[bool]),
        row: &mut RowBuffers,
    ) -> Result<(Vec<Role>, Vec<usize>)> {
        let roles: Vec<Role> = std::iter::once(Role::Nominal)
            .chain(extra.iter().copied())
            .collect();
        let n = self.walks.len();
        let some: Vec<usize> = (0..n).filter(|&e| which[e]).collect();
        let of_role = |v: usize| some.iter().map(move |e| v * n + e);
        let all: Vec<usize> = (0..roles.len()).flat_map(of_role).collect();
        let mut columns = Vec::new();
        for role in &roles {
            let theta = match role {
                Role::Varied(i) => &request.variations[*i].theta,
                _ => request.theta,
            };
            for &e in &some {
                c.columns
                    .push(theta, c.episode(self.walks[e]), &mut columns);
            }
        }
        self.reset_at(c, &all, 0)?;
        self.simulator.set_parameters(&all, &columns)?;
        self.place(c, &roles, (&some, 0), request, row)?;
        Ok((roles, some))
    }

    /// Places all simulations of some episodes at row `k`.
    fn place(
        &mut self,
        c: &Common<'_>,
        roles: &[Role],
        (here, k): (&[usize], usize),
        request: Request<'_>,
        row: &mut RowBuffers,
    ) -> Result<()> {
        let (n, nq, nv) = (self.walks.len(), c.layout.nq, c.layout.nv);
        if c.depends_on_past && k > 0 {
            let (mut from, mut to) = (Vec::new(), Vec::new());
            for (v, role) in roles.iter().enumerate() {
                let follows = match role {
                    Role::State(_) | Role::Force(_) | Role::Jolt(_) => true,
                    Role::Varied(i) => request.at_once[*i] && !request.alone[*i] && c.one_step,
                    Role::Nominal | Role::Reading(_) | Role::Ramp(_) => false,
                };
                if follows {
                    from.extend(here);
                    to.extend(here.iter().map(|e| v * n + e));
                }
            }
            self.simulator.copy_state(&from, &to)?;
        }
        row.sims.clear();
        row.qpos.clear();
        row.qvel.clear();
        let mut change = vec![0.0; 2 * nv];
        for (v, role) in roles.iter().enumerate() {
            for &e in here {
                let width = nq + nv;
                let segment = c.rolls(self.walks[e], request.want);
                let states = &request.trajectory[self.walks[e]];
                let mut state = states[k * width..(k + 1) * width].to_vec();
                if let Role::Ramp(i) = *role {
                    change[nv + i] = STATE_STEP * c.walks[self.walks[e]].time[k];
                    retract(&c.layout, &mut state, &change);
                    change.fill(0.0);
                }
                if let Role::State(slot) = *role {
                    for i in c.islands.moved(slot) {
                        change[i] = if segment { request.push[i] } else { STATE_STEP };
                    }
                    retract(&c.layout, &mut state, &change);
                    change.fill(0.0);
                } else if let Role::Reading(i) = *role {
                    change[i] = STATE_STEP;
                    if let Some(place) = i.checked_sub(nv) {
                        change[place] = STATE_STEP * c.walks[self.walks[e]].time[k];
                    }
                    retract(&c.layout, &mut state, &change);
                    change.fill(0.0);
                }
                row.sims.push(v * n + e);
                row.qpos.extend_from_slice(&state[..nq]);
                row.qvel.extend_from_slice(&state[nq..]);
            }
        }
        // A simulation that failed at the row before is reset.
        self.begin_anew(c, &row.sims, k)?;
        self.simulator.displace(&row.sims, &row.qpos, &row.qvel)
    }
}

/// Some roles in groups that a batch holds; without roles, one empty group for the unperturbed
/// model.
fn chunks(roles: &[Role], most: usize) -> impl Iterator<Item = &[Role]> {
    let none = roles.is_empty().then_some(&[][..]);
    none.into_iter().chain(roles.chunks(most))
}
