//! One walk along the rows: every simulation is set to the trajectory at each row, read, and stepped to the next.

use asid_core::{Result, Simulator};

use crate::latent_force::tangent::retract;
use crate::latent_force::walk::{Walk, by_substeps};
use crate::predict::columns_of;

use super::late::retime;
use super::step::{RowBuffers, Stepped};
use super::{Common, LinearEpisode, Request};

/// Change of a coordinate of the state that derivatives are taken over, rad, m, rad/s or m/s: forward
/// differences of smooth dynamics in double precision are right to about six digits.
pub(super) const STATE_STEP: f64 = 1e-6;

/// What one simulation an episode is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    /// The model as it is.
    Nominal,
    /// A coordinate of the state is moved, for `f` and `h`.
    State(usize),
    /// A coordinate of the state is moved all along, for `h` alone: a position by a constant, a speed by a constant and its
    /// position by a ramp. A reading that remembers (a delay, a filter) sees the past of a speed as its position; what the
    /// ramp has reached now is taken off again.
    Reading(usize),
    /// A speed is moved by a ramp, for how late a sensor of speeds is.
    Ramp(usize),
    /// A generalized force acts all along the row.
    Force(usize),
    /// It acts in the first physics step of the row.
    Jolt(usize),
    /// A variation of the parameters.
    Varied(usize),
}

impl Role {
    /// The coordinate of the state that it moves for `f`.
    pub(super) fn coordinate(self) -> Option<usize> {
        match self {
            Self::State(i) => Some(i),
            _ => None,
        }
    }
}

/// Some of the walks on a core of their own: a row is too little work to share out.
pub(super) struct Part {
    pub(super) walks: Vec<usize>,
    pub(super) simulator: Box<dyn Simulator>,
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
        let all = vec![true; self.walks.len()];
        let due: Vec<bool> = self.walks.iter().map(|&w| request.due(w)).collect();
        let mut in_state = Vec::new();
        if want.state {
            in_state.extend((0..nx).map(Role::State));
            if c.reads && !self.walks.iter().all(|&w| c.rolls(w, want)) {
                in_state.extend((0..nx).map(Role::Reading));
                in_state.extend((0..nv).map(Role::Ramp));
            }
        }
        let mut others = Vec::new();
        if want.force {
            others.extend((0..nv).map(Role::Force));
        }
        if want.jolt {
            others.extend((0..nv).map(Role::Jolt));
        }
        others.extend((0..variations.len()).map(Role::Varied));
        if due == all {
            in_state.append(&mut others);
        }
        let (ns, m) = (c.logs.entries.len(), variations.len());
        let mut episodes: Vec<LinearEpisode> = self
            .walks
            .iter()
            .map(|&w| {
                let n = c.walks[w].len();
                let segment = c.rolls(w, want);
                let (steps, state) = (n - 1, usize::from(want.state && !segment));
                LinearEpisode {
                    rows: n,
                    defect: vec![0.0; steps * nx],
                    a: vec![0.0; state * steps * nx * nx],
                    b: vec![0.0; usize::from(want.force) * steps * nx * nv],
                    jolt: vec![0.0; usize::from(want.jolt) * steps * nx * nv],
                    residual: vec![f64::NAN; n * ns],
                    h: vec![0.0; usize::from(want.state) * n * ns * nx],
                    early: Vec::new(),
                    late: Vec::new(),
                    state_columns: vec![0.0; usize::from(!segment) * steps * nx * m],
                    reading_columns: vec![0.0; n * ns * m],
                }
            })
            .collect();
        let late = usize::from(want.state && c.reads);
        let mut ramps: Vec<Vec<f64>> = episodes
            .iter()
            .map(|e| vec![0.0; late * e.rows * ns * nv])
            .collect();
        for (roles, which) in [(&in_state, &due), (&others, &all)] {
            let roles = if which.contains(&true) {
                &roles[..]
            } else {
                &[]
            };
            for chunk in roles.chunks(c.capacity - 1) {
                self.pass(c, request, (chunk, which), &mut episodes, &mut ramps)?;
            }
        }
        if others.is_empty() && (due != all || in_state.is_empty()) {
            self.pass(c, request, (&[], &all), &mut episodes, &mut ramps)?;
        }
        if late == 1 {
            for ((episode, ramps), &w) in episodes.iter_mut().zip(&ramps).zip(&self.walks) {
                if c.rolls(w, want) {
                    continue;
                }
                retime(episode, &c.walks[w].time, ramps, (ns, nx, m));
            }
        }
        Ok(episodes)
    }

    /// One walk along some of the episodes with some roles beside the nominal one.
    fn pass(
        &mut self,
        c: &Common<'_>,
        request: Request<'_>,
        (extra, which): (&[Role], &[bool]),
        out: &mut [LinearEpisode],
        ramps: &mut [Vec<f64>],
    ) -> Result<()> {
        let roles: Vec<Role> = std::iter::once(Role::Nominal)
            .chain(extra.iter().copied())
            .collect();
        let n = self.walks.len();
        let all: Vec<usize> = (0..roles.len() * n).collect();
        let mut columns = Vec::new();
        for role in &roles {
            let theta = match role {
                Role::Varied(i) => &request.variations[*i].theta,
                _ => request.theta,
            };
            let row = columns_of(&c.parameters, theta);
            (0..n).for_each(|_| columns.extend_from_slice(&row));
        }
        self.simulator.reset(&all)?;
        self.simulator.set_parameters(&all, &columns)?;
        let walks: Vec<&Walk> = self.walks.iter().map(|&w| &c.walks[w]).collect();
        let longest = walks.iter().map(|w| w.len()).max().unwrap_or(0);
        let mut row = RowBuffers::default();
        for k in 0..longest {
            let reach = |&e: &usize| which[e] && walks[e].len() > k;
            let here: Vec<usize> = (0..n).filter(reach).collect();
            self.place(c, &roles, (&here, k), request, &mut row)?;
            self.read_row(c, &roles, (&here, k), request, (out, ramps), &mut row)?;
            for (substeps, now) in by_substeps(&walks, here, k) {
                let (rolled, placed): (Vec<usize>, Vec<usize>) = now
                    .into_iter()
                    .partition(|&e| c.rolls(self.walks[e], request.want));
                for now in [rolled, placed].iter().filter(|now| !now.is_empty()) {
                    let stepped = Stepped {
                        roles: &roles,
                        now,
                        k,
                        substeps,
                    };
                    self.step_row(c, stepped, request, out, &mut row)?;
                }
            }
        }
        Ok(())
    }

    /// Puts all simulations of some episodes at row `k`; those of segments go on by themselves from the first row on.
    fn place(
        &mut self,
        c: &Common<'_>,
        roles: &[Role],
        (here, k): (&[usize], usize),
        request: Request<'_>,
        row: &mut RowBuffers,
    ) -> Result<()> {
        let (n, nq, nv) = (self.walks.len(), c.layout.nq, c.layout.nv);
        let placed: Vec<usize> = here
            .iter()
            .copied()
            .filter(|&e| k == 0 || !c.rolls(self.walks[e], request.want))
            .collect();
        let here = &placed[..];
        if c.remembers && k > 0 {
            let (mut from, mut to) = (Vec::new(), Vec::new());
            for (v, role) in roles.iter().enumerate() {
                if matches!(role, Role::State(_) | Role::Force(_) | Role::Jolt(_)) {
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
                if let (Role::State(i), true) = (*role, segment) {
                    change[i] = request.push[i];
                    retract(&c.layout, &mut state, &change);
                    change.fill(0.0);
                } else if let Role::State(i) | Role::Reading(i) = *role {
                    change[i] = STATE_STEP;
                    if let (Role::Reading(_), Some(place)) = (role, i.checked_sub(nv)) {
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
        // A simulation that failed at the row before begins anew.
        self.begin_anew(&row.sims)?;
        self.simulator.set_state(&row.sims, &row.qpos, &row.qvel)
    }

    /// Reads the sensors at row `k`.
    fn read_row(
        &mut self,
        c: &Common<'_>,
        roles: &[Role],
        (here, k): (&[usize], usize),
        request: Request<'_>,
        (out, ramps): (&mut [LinearEpisode], &mut [Vec<f64>]),
        row: &mut RowBuffers,
    ) -> Result<()> {
        let variations = request.variations;
        let (n, ns, nx) = (self.walks.len(), c.logs.entries.len(), 2 * c.layout.nv);
        row.sims.clear();
        for v in 0..roles.len() {
            row.sims.extend(here.iter().map(|e| v * n + e));
        }
        let width = c.readings.width();
        row.read.resize(row.sims.len() * width, 0.0);
        self.simulator.read(&row.sims, &c.readings, &mut row.read)?;
        let m = variations.len();
        let mut differ = vec![0.0; ns];
        for (i, &e) in here.iter().enumerate() {
            let nominal = &row.read[i * width..(i + 1) * width];
            let walk = &c.walks[self.walks[e]];
            let log_row = walk.rows[k];
            let readings = &c.logs.episodes[walk.episode].readings;
            let logged = &readings[log_row * width..(log_row + 1) * width];
            let residual = &mut out[e].residual[k * ns..(k + 1) * ns];
            c.logs.reading_difference(logged, nominal, residual);
            if walk.segment.is_some_and(|lead| k < lead) {
                residual.fill(f64::NAN);
            }
            for (v, role) in roles.iter().enumerate().skip(1) {
                let place = v * here.len() + i;
                let other = &row.read[place * width..(place + 1) * width];
                c.logs.reading_difference(other, nominal, &mut differ);
                let segment = c.rolls(self.walks[e], request.want);
                match *role {
                    Role::State(i) if segment => {
                        for (s, d) in differ.iter().enumerate() {
                            let value = d / request.push[i];
                            out[e].h[(k * ns + s) * nx + i] =
                                if value.is_finite() { value } else { 0.0 };
                        }
                    }
                    Role::Reading(_) | Role::Ramp(_) if segment => {}
                    Role::State(i) if !c.reads => {
                        for (s, d) in differ.iter().enumerate() {
                            out[e].h[(k * ns + s) * nx + i] = d / STATE_STEP;
                        }
                    }
                    Role::Reading(i) => {
                        let time = walk.time[k];
                        for (s, d) in differ.iter().enumerate() {
                            let row = &mut out[e].h[(k * ns + s) * nx..(k * ns + s + 1) * nx];
                            let place = i.checked_sub(nx / 2).map_or(0.0, |place| row[place]);
                            row[i] = d / STATE_STEP - time * place;
                        }
                    }
                    Role::Ramp(i) => {
                        for (s, d) in differ.iter().enumerate() {
                            ramps[e][(k * ns + s) * (nx / 2) + i] = d / STATE_STEP;
                        }
                    }
                    Role::Varied(i) => {
                        for (s, d) in differ.iter().enumerate() {
                            let value = d / variations[i].scale;
                            out[e].reading_columns[(k * ns + s) * m + i] =
                                if value.is_finite() { value } else { 0.0 };
                        }
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }
}
