//! A batch: whole-batch calls, each simulation on its own, on several threads.

use std::sync::Arc;

use asid_core::layout::{Channel, Layout, Recording};
use asid_core::nalgebra::Vector3;
use asid_core::simulator::{StepView, check_sims};
use asid_core::{BatchConfig, Control, Error, Result, Rollout, Simulator, Snapshot, Status};

use crate::flight::{Body, Load, Motion, step};
use crate::model::{Column, Compiled};

/// Largest number that counts as a state.
const HUGE: f64 = 1e10;

/// One simulation: its state, and the world as its parameters make it.
#[derive(Clone)]
struct Sim {
    state: State,
    bodies: Vec<Body>,
    gravity: Vector3<f64>,
}

/// What a snapshot keeps.
#[derive(Clone)]
struct State {
    time: f64,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
    status: Status,
}

/// A batch of simulations.
pub struct FlightSimulator {
    compiled: Arc<Compiled>,
    columns: Vec<Column>,
    sims: Vec<Sim>,
    status: Vec<Status>,
    threads: usize,
    steps: u64,
}

/// States with the scene that they are of.
struct Saved {
    compiled: Arc<Compiled>,
    states: Vec<State>,
}

impl FlightSimulator {
    /// Makes a batch.
    ///
    /// # Errors
    /// [`Error::Config`] for no simulations, [`Error::Parameter`] for a target that
    /// this engine does not know.
    pub fn new(compiled: Arc<Compiled>, config: &BatchConfig) -> Result<Self> {
        if config.size == 0 {
            return Err(Error::Config {
                key: "size".into(),
                message: "a batch needs at least one simulation".into(),
            });
        }
        let columns = config.targets.iter().map(|t| Ok(compiled.resolve(t)?.0));
        let columns = columns.collect::<Result<Vec<_>>>()?;
        let sim = Sim {
            state: State {
                time: 0.0,
                qpos: compiled.start.clone(),
                qvel: vec![0.0; compiled.layout.nv],
                status: Status::Running,
            },
            bodies: compiled.bodies.clone(),
            gravity: compiled.gravity,
        };
        let threads = match config.threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n => n,
        };
        let mut batch = Self {
            sims: vec![sim; config.size],
            status: vec![Status::Running; config.size],
            threads: threads.min(config.size),
            steps: 0,
            columns,
            compiled,
        };
        let all: Vec<usize> = (0..config.size).collect();
        batch.reset(&all)?;
        Ok(batch)
    }

    /// The public copy of the statuses, after states have changed.
    fn publish(&mut self, sims: &[usize]) {
        for &sim in sims {
            self.status[sim].clone_from(&self.sims[sim].state.status);
        }
    }
}

fn expect(what: &str, have: usize, want: usize) -> Result<()> {
    if have == want {
        return Ok(());
    }
    Err(Error::Shape(format!(
        "{what} has {have} values where {want} are needed"
    )))
}

/// A value that a parameter can take.
fn check_value(column: Column, value: f64) -> Result<()> {
    let (parameter, fits) = match column {
        Column::Gravity(_) => ("option/gravity", value.is_finite()),
        Column::Mass(_) => ("body/mass", value.is_finite() && value > 0.0),
    };
    if fits {
        return Ok(());
    }
    Err(Error::Parameter {
        parameter: parameter.into(),
        message: format!("{value} is not physical"),
    })
}

impl Sim {
    fn set(&mut self, compiled: &Compiled, column: Column, value: f64) {
        match column {
            Column::Gravity(i) => self.gravity[i] = value,
            Column::Mass(i) => {
                let nominal = &compiled.bodies[i];
                let ratio = value / nominal.mass;
                self.bodies[i].mass = value;
                self.bodies[i].inertia = nominal.inertia * ratio;
                self.bodies[i].inverse = nominal.inverse / ratio;
            }
        }
    }

    /// Readings of the present state.
    fn record(&self, compiled: &Compiled, record: &Recording, out: &mut [f64]) {
        for (i, channel) in record.channels().iter().enumerate() {
            let out = &mut out[record.range(i)];
            match *channel {
                Channel::Position { start, len } => {
                    out.copy_from_slice(&self.state.qpos[start..start + len]);
                }
                Channel::Velocity { start, len } => {
                    out.copy_from_slice(&self.state.qvel[start..start + len]);
                }
                Channel::ContactForce { .. } => out.fill(f64::NAN), // refused before
                Channel::Sensor { index } => self.sense(compiled, index, out),
            }
        }
    }

    fn sense(&self, compiled: &Compiled, sensor: usize, out: &mut [f64]) {
        let Some(frame) = &compiled.frames[sensor] else {
            return out.fill(f64::NAN); // refused before
        };
        let motion = self.motion(frame.body);
        match compiled.layout.sensors[sensor].kind.as_str() {
            "framepos" => {
                let position = motion.position + motion.rotation * frame.position;
                out.copy_from_slice(position.as_slice());
            }
            "framelinvel" => out.copy_from_slice(motion.velocity_of(&frame.position).as_slice()),
            "frameangvel" => out.copy_from_slice((motion.rotation * motion.spin).as_slice()),
            _ => {
                let q = motion.rotation * frame.rotation;
                out.copy_from_slice(&[q.w, q.i, q.j, q.k]);
            }
        }
    }

    fn motion(&self, body: usize) -> Motion {
        Motion::read(&self.state.qpos[7 * body..], &self.state.qvel[6 * body..])
    }

    /// Runs row `row` of a rollout and writes its readings.
    fn run(
        &mut self,
        compiled: &Compiled,
        columns: &[Column],
        rollout: &Rollout<'_>,
        row: usize,
        out: &mut [f64],
    ) -> u64 {
        let width = rollout.record.width();
        let mut steps = 0;
        let mut generalised = vec![0.0; compiled.layout.nv];
        for frame in 0..rollout.frames {
            for change in rollout.changes.iter().filter(|c| c.frame == frame) {
                self.set(compiled, columns[change.column], change.values[row]);
            }
            for substep in 0..rollout.substeps {
                if !self.state.status.is_running() {
                    break;
                }
                generalised.fill(0.0);
                if let Some(hook) = rollout.hook {
                    let mut view = StepView {
                        time: self.state.time,
                        qpos: &self.state.qpos,
                        qvel: &self.state.qvel,
                        ctrl: &mut [],
                        force: &mut generalised,
                        parameters: &mut [],
                    };
                    hook.before_step(row, frame * rollout.substeps + substep, &mut view);
                }
                self.step(compiled, rollout, row, frame, &generalised);
                steps += 1;
            }
            let out = &mut out[frame * width..(frame + 1) * width];
            if self.state.status.is_running() {
                self.record(compiled, rollout.record, out);
            } else {
                out.fill(f64::NAN);
            }
        }
        steps
    }

    fn step(
        &mut self,
        compiled: &Compiled,
        rollout: &Rollout<'_>,
        row: usize,
        frame: usize,
        generalised: &[f64],
    ) {
        let dt = compiled.layout.timestep;
        for (i, body) in self.bodies.iter().enumerate() {
            let mut load = Load {
                force: Vector3::zeros(),
                torque: Vector3::zeros(),
                joint: [0.0; 6],
            };
            load.joint.copy_from_slice(&generalised[6 * i..6 * i + 6]);
            let pushes = rollout.forces.iter();
            for push in pushes.filter(|f| f.body == compiled.places[i]) {
                let at = (row * rollout.frames + frame) * 6;
                load.force += Vector3::from_column_slice(&push.wrench[at..at + 3]);
                load.torque += Vector3::from_column_slice(&push.wrench[at + 3..at + 6]);
            }
            let (qpos, qvel) = (&mut self.state.qpos[7 * i..], &mut self.state.qvel[6 * i..]);
            let mut motion = Motion::read(qpos, qvel);
            step(body, &mut motion, &load, &self.gravity, dt);
            motion.write(qpos, qvel);
        }
        self.state.time += dt;
        let numbers = self.state.qpos.iter().chain(&self.state.qvel);
        if numbers.clone().any(|x| x.is_nan() || x.abs() > HUGE) {
            let time = self.state.time;
            self.state.status = Status::Diverged {
                time,
                message: format!(
                    "a position or velocity is not finite or beyond {HUGE:e} at {time} s"
                ),
            };
        }
    }
}

impl Simulator for FlightSimulator {
    fn layout(&self) -> &Layout {
        &self.compiled.layout
    }

    fn batch_size(&self) -> usize {
        self.sims.len()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        expect("parameters", values.len(), sims.len() * self.columns.len())?;
        let columns = self.columns.iter().cycle();
        for (&column, &value) in columns.zip(values) {
            check_value(column, value)?;
        }
        for (&sim, row) in sims.iter().zip(values.chunks(self.columns.len().max(1))) {
            for (&column, &value) in self.columns.iter().zip(row) {
                self.sims[sim].set(&self.compiled, column, value);
            }
        }
        Ok(())
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let key = self.compiled.layout.keyframes.first();
        for &sim in sims {
            let state = &mut self.sims[sim].state;
            state.time = 0.0;
            state.qpos.copy_from_slice(&self.compiled.start);
            match key {
                Some(key) => state.qvel.copy_from_slice(&key.qvel),
                None => state.qvel.fill(0.0),
            }
            state.status = Status::Running;
        }
        self.publish(sims);
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let (nq, nv) = (self.compiled.layout.nq, self.compiled.layout.nv);
        expect("qpos", qpos.len(), sims.len() * nq)?;
        expect("qvel", qvel.len(), sims.len() * nv)?;
        if qpos.iter().chain(qvel).any(|x| !x.is_finite()) {
            return Err(Error::Shape(
                "the state holds a value that is not finite".into(),
            ));
        }
        let length = |q: &[f64]| q[3..7].iter().map(|x| x * x).sum::<f64>().sqrt();
        if qpos.chunks(7).any(|q| length(q) < 1e-9) {
            return Err(Error::Shape("a quaternion of the state is zero".into()));
        }
        for (i, &sim) in sims.iter().enumerate() {
            let state = &mut self.sims[sim].state;
            state.qpos.copy_from_slice(&qpos[i * nq..(i + 1) * nq]);
            state.qvel.copy_from_slice(&qvel[i * nv..(i + 1) * nv]);
            for q in state.qpos.chunks_mut(7) {
                let length = length(q);
                q[3..7].iter_mut().for_each(|x| *x /= length);
            }
        }
        Ok(())
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        rollout.check(self.layout(), self.batch_size(), self.columns.len(), out)?;
        if rollout.substeps == 0 {
            return Err(Error::Shape(
                "a frame needs at least one physics step".into(),
            ));
        }
        self.compiled.check_readings(rollout.record)?;
        for change in rollout.changes {
            for &value in change.values {
                check_value(self.columns[change.column], value)?;
            }
        }
        // Free bodies have no drives, so there are no commands to follow.
        let (Control::Shared(_) | Control::PerSimulation(_)) = rollout.control;
        let length = rollout.frames * rollout.record.width();
        let mut wanted = rollout.sims.iter().peekable();
        let mut rest = out;
        let mut jobs = Vec::with_capacity(rollout.sims.len());
        for (number, sim) in self.sims.iter_mut().enumerate() {
            if wanted.next_if_eq(&&number).is_some() {
                let (mine, others) = rest.split_at_mut(length);
                rest = others;
                jobs.push((jobs.len(), sim, mine));
            }
        }
        let share = jobs.len().div_ceil(self.threads).max(1);
        let (compiled, columns) = (&*self.compiled, &self.columns[..]);
        let run = |jobs: &mut [(usize, &mut Sim, &mut [f64])]| -> u64 {
            jobs.iter_mut()
                .map(|(row, sim, out)| sim.run(compiled, columns, rollout, *row, out))
                .sum()
        };
        self.steps += if self.threads == 1 {
            run(&mut jobs)
        } else {
            std::thread::scope(|scope| {
                let threads: Vec<_> = jobs
                    .chunks_mut(share)
                    .map(|chunk| scope.spawn(|| run(chunk)))
                    .collect();
                let join = |t: std::thread::ScopedJoinHandle<'_, u64>| {
                    t.join()
                        .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
                };
                threads.into_iter().map(join).sum::<u64>()
            })
        };
        self.publish(rollout.sims);
        Ok(())
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        let width = record.width();
        expect("output", out.len(), sims.len() * width)?;
        self.compiled.check_readings(record)?;
        for (&sim, row) in sims.iter().zip(out.chunks_mut(width.max(1))) {
            if self.status[sim].is_running() {
                self.sims[sim].record(&self.compiled, record, row);
            } else {
                row.fill(f64::NAN);
            }
        }
        Ok(())
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        check_sims(sims, self.batch_size())?;
        let saved = Saved {
            compiled: self.compiled.clone(),
            states: sims.iter().map(|&s| self.sims[s].state.clone()).collect(),
        };
        Ok(Snapshot::new(saved, sims.len()))
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        check_sims(sims, self.batch_size())?;
        expect("rows", rows.len(), sims.len())?;
        let saved = snapshot
            .data::<Saved>()
            .filter(|s| Arc::ptr_eq(&s.compiled, &self.compiled))
            .ok_or_else(|| Error::Shape("the snapshot is of another scene".into()))?;
        if let Some(row) = rows.iter().find(|&&r| r >= snapshot.rows()) {
            return Err(Error::Shape(format!(
                "row {row} of a snapshot with {} rows",
                snapshot.rows()
            )));
        }
        for (&row, &sim) in rows.iter().zip(sims) {
            self.sims[sim].state.clone_from(&saved.states[row]);
        }
        self.publish(sims);
        Ok(())
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        check_sims(to, self.batch_size())?;
        expect("from", from.len(), to.len())?;
        if let Some(&sim) = from
            .iter()
            .find(|s| **s >= self.sims.len() || to.contains(s))
        {
            return Err(Error::Shape(format!(
                "simulation {sim} is not there, or is copied from and to"
            )));
        }
        for (&source, &sim) in from.iter().zip(to) {
            let state = self.sims[source].state.clone();
            self.sims[sim].state = state;
        }
        self.publish(to);
        Ok(())
    }

    fn status(&self) -> &[Status] {
        &self.status
    }

    fn steps_taken(&self) -> u64 {
        self.steps
    }
}
