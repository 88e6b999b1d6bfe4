//! One simulation: its state, its parameters, and how it runs a row of a rollout.

use asid_core::layout::{Channel, Recording};
use asid_core::nalgebra::Vector3;
use asid_core::simulator::StepView;
use asid_core::{Rollout, Status};

use crate::flight::{Body, Load, Motion, step};
use crate::model::{Column, Compiled};

/// Largest magnitude of a valid state.
const HUGE: f64 = 1e10;

/// One simulation: its state, and the world with its parameters.
#[derive(Clone)]
pub struct Simulation {
    /// State.
    pub state: State,
    bodies: Vec<Body>,
    gravity: Vector3<f64>,
}

/// The content of a snapshot.
#[derive(Clone)]
pub struct State {
    /// Simulated time, s.
    pub time: f64,
    /// Positions.
    pub qpos: Vec<f64>,
    /// Velocities.
    pub qvel: Vec<f64>,
    /// Whether it runs or has diverged.
    pub status: Status,
}

impl Simulation {
    /// A simulation at the scene's initial state with nominal parameters.
    pub fn new(compiled: &Compiled) -> Self {
        Self {
            state: State {
                time: 0.0,
                qpos: compiled.start.clone(),
                qvel: vec![0.0; compiled.layout.nv],
                status: Status::Running,
            },
            bodies: compiled.bodies.clone(),
            gravity: compiled.gravity,
        }
    }

    /// Sets a parameter to a valid value.
    pub fn set(&mut self, compiled: &Compiled, column: Column, value: f64) {
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

    /// Writes the readings of the present state.
    pub fn record(&self, compiled: &Compiled, record: &Recording, out: &mut [f64]) {
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
    pub fn run(
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
