//! The model over one row of a log, and its derivatives, along a trajectory.
//!
//! `f` carries a state from a row of the log to the next under the row's command; `h` reads the sensors. Both
//! come from a batch of any engine: a pass walks all episodes side by side, sets every simulation to the
//! trajectory's state at each row, and steps it to the next. Derivatives are forward differences: one
//! simulation an episode for the model as it is, one for each coordinate of the state, each force and each value
//! that is varied. Effects that remember (a delay, a rotor behind its play) walk along with their
//! own simulation, so that their memory at a row is that of the trajectory before it.

use asid_core::layout::{Layout, Recording};
use asid_core::simulator::{StepHook, StepView};
use asid_core::{BatchConfig, Control, Parameter, Result, Rollout, Simulator};
use asid_effects::{Acts, EffectSpec};

use crate::data::Logs;
use crate::machine::Machine;
use crate::predict::columns_of;

use super::tangent::{difference, retract};
use super::walk::Walk;

/// Change of a coordinate of the state that derivatives are taken over, rad, m, rad/s or m/s: forward
/// differences of smooth dynamics in double precision are right to about six digits.
const STATE_STEP: f64 = 1e-6;

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
    /// `y_k - h(x_k)`, `rows x ns`; NaN where a reading is missing.
    pub residual: Vec<f64>,
    /// Slope of `h` in the state, `rows x ns x nx`.
    pub h: Vec<f64>,
    /// Change of `f` by each variation, `(rows - 1) x nx x m`.
    pub state_columns: Vec<f64>,
    /// Change of `h` by each variation, `rows x ns x m`.
    pub reading_columns: Vec<f64>,
}

/// A generalized force on some rows of a rollout.
struct Push<'a> {
    /// For each row of the rollout, the degree of freedom and the force.
    rows: &'a [Option<(usize, f64)>],
}

impl StepHook for Push<'_> {
    fn before_step(&self, row: usize, _step: usize, view: &mut StepView<'_>) {
        if let Some((dof, force)) = self.rows[row] {
            view.force[dof] += force;
        }
    }
}

/// What one simulation an episode is for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Role {
    /// The model as it is.
    Nominal,
    /// A coordinate of the state is moved, for `f` and `h`.
    State(usize),
    /// A coordinate of the state is moved all along, for `h` alone.
    Reading(usize),
    /// A generalized force acts.
    Force(usize),
    /// A variation of the parameters.
    Varied(usize),
}

/// The model with some effects on some logs.
pub struct StepMap<'a> {
    logs: &'a Logs,
    walks: &'a [Walk],
    layout: Layout,
    parameters: Vec<Parameter>,
    simulator: Box<dyn Simulator>,
    states: Recording,
    readings: Recording,
    /// Most roles in one pass.
    capacity: usize,
    /// Whether effects on the drive side remember, and whether some act on readings.
    remembers: bool,
    reads: bool,
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
        let episodes = walks.len().max(1);
        let capacity = roles.clamp(2, (MOST_SIMULATIONS / episodes).max(2));
        let simulator = model.simulator(&BatchConfig {
            size: capacity * episodes,
            threads: machine.threads,
            targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
        })?;
        let joints = || layout.joints.iter();
        let names = joints().map(|j| format!("qpos.{}", j.name));
        let names: Vec<String> = names
            .chain(joints().map(|j| format!("qvel.{}", j.name)))
            .collect();
        let (mut remembers, mut reads) = (false, false);
        for spec in machine.given_effects().iter().chain(specs) {
            match spec.find(&machine.plant)?.acts() {
                Acts::Measurement => reads = true,
                Acts::Command | Acts::Force => remembers = true,
                Acts::Model => {}
            }
        }
        Ok(Self {
            states: layout.recording(&names)?,
            readings: layout.recording(&logs.channels())?,
            logs,
            walks,
            layout,
            parameters: parameters.to_vec(),
            simulator,
            capacity,
            remembers,
            reads,
        })
    }

    /// Physics steps so far.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.simulator.steps_taken()
    }

    /// Linearises about a trajectory (`rows x (nq + nv)`, one an episode) at some parameters; `push` is the
    /// force that slopes in each generalized force are taken over.
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
        let nx = 2 * self.layout.nv;
        let mut roles = Vec::new();
        if want.state {
            roles.extend((0..nx).map(Role::State));
            if self.reads {
                roles.extend((0..nx).map(Role::Reading));
            }
        }
        if want.force {
            roles.extend((0..self.layout.nv).map(Role::Force));
        }
        roles.extend((0..variations.len()).map(Role::Varied));
        let ns = self.logs.entries.len();
        let m = variations.len();
        let mut episodes: Vec<LinearEpisode> = self
            .walks
            .iter()
            .map(|w| {
                let (n, steps) = (w.len(), w.len() - 1);
                let state = usize::from(want.state);
                LinearEpisode {
                    rows: n,
                    defect: vec![0.0; steps * nx],
                    a: vec![0.0; state * steps * nx * nx],
                    b: vec![0.0; usize::from(want.force) * steps * nx * self.layout.nv],
                    residual: vec![f64::NAN; n * ns],
                    h: vec![0.0; state * n * ns * nx],
                    state_columns: vec![0.0; steps * nx * m],
                    reading_columns: vec![0.0; n * ns * m],
                }
            })
            .collect();
        if roles.is_empty() {
            self.pass(theta, trajectory, push, variations, &[], &mut episodes)?;
        }
        for chunk in roles.chunks(self.capacity - 1) {
            self.pass(theta, trajectory, push, variations, chunk, &mut episodes)?;
        }
        Ok(episodes)
    }

    /// One walk along all episodes with some roles beside the nominal one.
    fn pass(
        &mut self,
        theta: &[f64],
        trajectory: &[Vec<f64>],
        push: &[f64],
        variations: &[Variation],
        extra: &[Role],
        out: &mut [LinearEpisode],
    ) -> Result<()> {
        let roles: Vec<Role> = std::iter::once(Role::Nominal)
            .chain(extra.iter().copied())
            .collect();
        let n = self.walks.len();
        let all: Vec<usize> = (0..roles.len() * n).collect();
        let mut columns = Vec::new();
        for role in &roles {
            let theta = match role {
                Role::Varied(i) => &variations[*i].theta,
                _ => theta,
            };
            let row = columns_of(&self.parameters, theta);
            (0..n).for_each(|_| columns.extend_from_slice(&row));
        }
        self.simulator.reset(&all)?;
        self.simulator.set_parameters(&all, &columns)?;
        let longest = self.walks.iter().map(Walk::len).max().unwrap_or(0);
        let mut row = RowBuffers::default();
        for k in 0..longest {
            let here: Vec<usize> = (0..n).filter(|&e| self.walks[e].len() > k).collect();
            self.place(&roles, &here, k, trajectory, &mut row)?;
            self.read_row(&roles, &here, k, variations, out, &mut row)?;
            let mut ahead: Vec<usize> = here
                .into_iter()
                .filter(|&e| self.walks[e].len() > k + 1)
                .collect();
            while let Some(&first) = ahead.first() {
                let substeps = self.walks[first].substeps[k];
                let (now, later): (Vec<usize>, Vec<usize>) = ahead
                    .iter()
                    .partition(|&&e| self.walks[e].substeps[k] == substeps);
                self.step_row(
                    (&roles, &now, k, substeps),
                    (trajectory, push, variations),
                    out,
                    &mut row,
                )?;
                ahead = later;
            }
        }
        Ok(())
    }

    /// Puts all simulations of some episodes at row `k`.
    fn place(
        &mut self,
        roles: &[Role],
        here: &[usize],
        k: usize,
        trajectory: &[Vec<f64>],
        row: &mut RowBuffers,
    ) -> Result<()> {
        let (n, nq, nv) = (self.walks.len(), self.layout.nq, self.layout.nv);
        if self.remembers && k > 0 {
            let (mut from, mut to) = (Vec::new(), Vec::new());
            for (v, role) in roles.iter().enumerate() {
                if matches!(role, Role::State(_) | Role::Force(_)) {
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
                let mut state = trajectory[e][k * width..(k + 1) * width].to_vec();
                if let Role::State(i) | Role::Reading(i) = *role {
                    change[i] = STATE_STEP;
                    retract(&self.layout, &mut state, &change);
                    change[i] = 0.0;
                }
                row.sims.push(v * n + e);
                row.qpos.extend_from_slice(&state[..nq]);
                row.qvel.extend_from_slice(&state[nq..]);
            }
        }
        // A simulation that failed at the row before begins anew.
        let status = self.simulator.status();
        let failed: Vec<usize> = row
            .sims
            .iter()
            .copied()
            .filter(|&s| !status[s].is_running())
            .collect();
        if !failed.is_empty() {
            self.simulator.reset(&failed)?;
        }
        self.simulator.set_state(&row.sims, &row.qpos, &row.qvel)
    }

    /// Reads the sensors at row `k`.
    fn read_row(
        &mut self,
        roles: &[Role],
        here: &[usize],
        k: usize,
        variations: &[Variation],
        out: &mut [LinearEpisode],
        row: &mut RowBuffers,
    ) -> Result<()> {
        let (ns, nx) = (self.logs.entries.len(), 2 * self.layout.nv);
        let width = self.readings.width();
        row.read.resize(row.sims.len() * width, 0.0);
        self.simulator
            .read(&row.sims, &self.readings, &mut row.read)?;
        let m = variations.len();
        let mut differ = vec![0.0; ns];
        for (i, &e) in here.iter().enumerate() {
            let nominal = &row.read[i * width..(i + 1) * width];
            let log_row = self.walks[e].rows[k];
            let readings = &self.logs.episodes[self.walks[e].episode].readings;
            let logged = &readings[log_row * width..(log_row + 1) * width];
            let residual = &mut out[e].residual[k * ns..(k + 1) * ns];
            self.logs.reading_difference(logged, nominal, residual);
            for (v, role) in roles.iter().enumerate().skip(1) {
                let place = v * here.len() + i;
                let other = &row.read[place * width..(place + 1) * width];
                self.logs.reading_difference(other, nominal, &mut differ);
                match *role {
                    Role::State(c) if !self.reads => {
                        for (s, d) in differ.iter().enumerate() {
                            out[e].h[(k * ns + s) * nx + c] = d / STATE_STEP;
                        }
                    }
                    Role::Reading(c) => {
                        for (s, d) in differ.iter().enumerate() {
                            out[e].h[(k * ns + s) * nx + c] = d / STATE_STEP;
                        }
                    }
                    Role::Varied(c) => {
                        for (s, d) in differ.iter().enumerate() {
                            let value = d / variations[c].scale;
                            out[e].reading_columns[(k * ns + s) * m + c] =
                                if value.is_finite() { value } else { 0.0 };
                        }
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Steps some episodes from row `k` to the next.
    fn step_row(
        &mut self,
        (roles, now, k, substeps): (&[Role], &[usize], usize, usize),
        (trajectory, push, variations): (&[Vec<f64>], &[f64], &[Variation]),
        out: &mut [LinearEpisode],
        row: &mut RowBuffers,
    ) -> Result<()> {
        let (n, nv, nu) = (self.walks.len(), self.layout.nv, self.layout.nu());
        let (nx, width) = (2 * nv, self.layout.nq + nv);
        row.sims.clear();
        row.ctrl.clear();
        row.pushes.clear();
        for (v, role) in roles.iter().enumerate() {
            for &e in now {
                row.sims.push(v * n + e);
                let ctrl = &self.walks[e].ctrl[k * nu..(k + 1) * nu];
                row.ctrl.extend_from_slice(ctrl);
                row.pushes.push(match *role {
                    Role::Force(d) => Some((d, push[d])),
                    _ => None,
                });
            }
        }
        let hook = Push { rows: &row.pushes };
        let mut rollout = Rollout::new(
            &row.sims,
            1,
            substeps,
            Control::PerSimulation(&row.ctrl),
            &self.states,
        );
        if row.pushes.iter().any(Option::is_some) {
            rollout.hook = Some(&hook);
        }
        row.next.resize(row.sims.len() * width, 0.0);
        self.simulator.rollout(&rollout, &mut row.next)?;
        let m = variations.len();
        let mut differ = vec![0.0; nx];
        for (i, &e) in now.iter().enumerate() {
            let nominal = &row.next[i * width..(i + 1) * width];
            let ahead = &trajectory[e][(k + 1) * width..(k + 2) * width];
            let defect = &mut out[e].defect[k * nx..(k + 1) * nx];
            difference(&self.layout, nominal, ahead, defect);
            for (v, role) in roles.iter().enumerate().skip(1) {
                let place = v * now.len() + i;
                let other = &row.next[place * width..(place + 1) * width];
                difference(&self.layout, other, nominal, &mut differ);
                let (matrix, columns, c, scale) = match *role {
                    Role::State(c) => (&mut out[e].a, nx, c, STATE_STEP),
                    Role::Force(c) => (&mut out[e].b, nv, c, push[c]),
                    Role::Varied(c) => (&mut out[e].state_columns, m, c, variations[c].scale),
                    Role::Nominal | Role::Reading(_) => continue,
                };
                for (s, d) in differ.iter().enumerate() {
                    let value = d / scale;
                    matrix[(k * nx + s) * columns + c] =
                        if value.is_finite() { value } else { 0.0 };
                }
            }
        }
        Ok(())
    }
}

/// Arrays of one row, kept between rows.
#[derive(Default)]
struct RowBuffers {
    sims: Vec<usize>,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    ctrl: Vec<f64>,
    pushes: Vec<Option<(usize, f64)>>,
    read: Vec<f64>,
    next: Vec<f64>,
}
