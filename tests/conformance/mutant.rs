//! An engine with one fault: a wrapper around another engine that corrupts inputs and outputs.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use asid::core::layout::Channel;
use asid::core::nalgebra::Vector3;
use asid::core::simulator::{ExternalForce, StepHook};
use asid::core::{
    Backend, BatchConfig, Capabilities, Control, Layout, Model, Recording, Result, Rollout, Scene,
    Simulator, Snapshot, Status, Target,
};

use crate::fault::{Fault, SpoiltHook};

/// The shared random state of [`Fault::SharedNoise`].
static NOISE: AtomicU64 = AtomicU64::new(1);

/// An engine with a fault.
pub struct Mutant<'a> {
    inner: &'a dyn Backend,
    fault: Fault,
}

impl<'a> Mutant<'a> {
    /// Adds a fault to an engine.
    pub fn new(inner: &'a dyn Backend, fault: Fault) -> Self {
        Self { inner, fault }
    }
}

impl Backend for Mutant<'_> {
    fn name(&self) -> &str {
        "mutant"
    }

    fn version(&self) -> String {
        self.inner.version()
    }

    fn capabilities(&self) -> Capabilities {
        match self.fault {
            Fault::RangesLeftOut => self.inner.capabilities() - Capabilities::JOINT_LIMITS,
            _ => self.inner.capabilities(),
        }
    }

    fn load(&self, scene: &Scene) -> Result<Arc<dyn Model>> {
        let xml = match self.fault {
            Fault::FrictionHalved => rewritten(scene.xml(), "friction", |value| {
                let mut numbers = value.split(' ');
                let first: f64 = numbers.next().unwrap().parse().unwrap();
                let rest: Vec<&str> = numbers.collect();
                format!("{} {}", first / 2.0, rest.join(" "))
            }),
            Fault::PriorityIgnored => rewritten(scene.xml(), "priority", |_| "0".into()),
            Fault::PairsIgnored => match scene.xml().split_once("<pair") {
                Some((before, pair)) => {
                    let after = pair.split_once("/>").unwrap().1;
                    format!("{before}{after}")
                }
                None => scene.xml().to_owned(),
            },
            // So far away that nothing reaches it.
            Fault::RangesLeftOut => rewritten(scene.xml(), "range", |_| "-1e5 1e5".into()),
            Fault::DegreesIgnored => {
                scene
                    .xml()
                    .replacen("<mujoco>", "<mujoco><compiler angle=\"radian\"/>", 1)
            }
            Fault::DampingIgnored => rewritten(scene.xml(), "damping", |_| "0".into()),
            Fault::LimitsIgnored => {
                let xml = rewritten(scene.xml(), "ctrlrange", |_| "-1e6 1e6".into());
                rewritten(&xml, "forcerange", |_| "-1e6 1e6".into())
            }
            Fault::FourthOrder => {
                let first = r#"<mujoco><option integrator="RK4"/>"#;
                scene.xml().replacen("<mujoco>", first, 1)
            }
            Fault::InertiaTurnIgnored => upright(scene.xml(), "<inertial"),
            Fault::SiteTurnIgnored => upright(scene.xml(), "<site"),
            Fault::RateInOwnFrame => scene.xml().replace(
                r#"<frameangvel name="r" objtype="site" objname="s"/>"#,
                r#"<gyro name="r" site="s"/>"#,
            ),
            Fault::GyroInWorld => scene.xml().replace(
                r#"<gyro name="r" site="s"/>"#,
                r#"<frameangvel name="r" objtype="site" objname="s"/>"#,
            ),
            Fault::VelocimeterInWorld => scene.xml().replace(
                r#"<velocimeter name="r" site="s"/>"#,
                r#"<framelinvel name="r" objtype="site" objname="s"/>"#,
            ),
            Fault::EqualitiesLeftOut => match scene.xml().split_once("<equality>") {
                Some((before, rest)) => {
                    let after = rest.split_once("</equality>").unwrap().1;
                    format!("{before}{after}")
                }
                None => scene.xml().to_owned(),
            },
            Fault::AirLeftOut => ["density", "viscosity", "wind"].iter().fold(
                scene.xml().to_owned(),
                |xml, attribute| {
                    // The attributes of the air, not those of a geom.
                    xml.replace(&format!("<option {attribute}="), "<option iterations=")
                },
            ),
            _ => scene.xml().to_owned(),
        };
        Ok(Arc::new(MutantModel {
            inner: self
                .inner
                .load(&Scene::from_xml(scene.name(), &xml, &[])?)?,
            fault: self.fault,
            center: center(&xml),
        }))
    }
}

/// A document with every value of an attribute replaced.
fn rewritten(xml: &str, attribute: &str, change: impl Fn(&str) -> String) -> String {
    let mark = format!(" {attribute}=\"");
    let mut parts = xml.split(&mark);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (value, rest) = part.split_once('"').unwrap();
        out += &format!("{mark}{}\"{rest}", change(value));
    }
    out
}

/// A document whose elements of a kind have no rotation by a quaternion.
fn upright(xml: &str, element: &str) -> String {
    let mut parts = xml.split(element);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (own, rest) = part.split_once('>').unwrap();
        let own = rewritten(own, "quat", |_| "1 0 0 0".into());
        out += &format!("{element}{own}>{rest}");
    }
    out
}

/// Centre of mass of the first body that states one, in the body's frame, m.
fn center(xml: &str) -> Vector3<f64> {
    let place = xml.split_once("<inertial pos=\"").unwrap_or_default().1;
    let place = place.split('"').next().unwrap_or_default();
    let numbers: Vec<f64> = (place.split_whitespace().map(|x| x.parse().unwrap())).collect();
    match numbers[..] {
        [x, y, z] => Vector3::new(x, y, z),
        _ => Vector3::zeros(),
    }
}

struct MutantModel {
    inner: Arc<dyn Model>,
    fault: Fault,
    center: Vector3<f64>,
}

impl Model for MutantModel {
    fn layout(&self) -> &Layout {
        self.inner.layout()
    }

    fn nominal(&self, target: &Target) -> Result<f64> {
        self.inner.nominal(target)
    }

    fn simulator(&self, config: &BatchConfig) -> Result<Box<dyn Simulator>> {
        let mass = |target: &Target| target.element == "body" && target.attribute == "mass";
        let masses: Vec<Option<f64>> = (config.targets.iter())
            .map(|target| mass(target).then(|| self.inner.nominal(target)).transpose())
            .collect::<Result<_>>()?;
        let mut config = config.clone();
        let mut more = Vec::new();
        if self.fault == Fault::MassWithoutInertia {
            // The inertia becomes a parameter that keeps its value.
            for target in config.targets.clone().into_iter().filter(mass) {
                for index in 0..3 {
                    let target: Target = format!("body/{}/inertia/{index}", target.name).parse()?;
                    more.push(self.inner.nominal(&target)?);
                    config.targets.push(target);
                }
            }
        }
        let config = &config;
        Ok(Box::new(MutantSimulator {
            inner: self.inner.simulator(config)?,
            center: self.center,
            masses,
            more,
            fault: self.fault,
            threads: config.threads,
            running: vec![Status::Running; config.size],
        }))
    }
}

struct MutantSimulator {
    inner: Box<dyn Simulator>,
    fault: Fault,
    threads: usize,
    running: Vec<Status>,
    /// Centre of mass of the first body, in the body's frame, m.
    center: Vector3<f64>,
    /// Nominal value of each parameter that is a mass, kg.
    masses: Vec<Option<f64>>,
    /// Values of parameters that the caller does not know of.
    more: Vec<f64>,
}

impl MutantSimulator {
    /// Corrupts rows of readings, `frames` per simulation.
    fn spoil(&self, record: &Recording, frames: usize, out: &mut [f64]) {
        let width = record.width();
        if width == 0 || frames == 0 {
            return;
        }
        let layout = self.inner.layout();
        match self.fault {
            Fault::SharedNoise => {
                for value in out {
                    let noise = NOISE
                        .fetch_add(1, Ordering::Relaxed)
                        .wrapping_mul(0x9e37_79b9);
                    *value *= 1.0 + 1e-14 * (noise % 1000) as f64;
                }
            }
            Fault::ThreadDependent if self.threads > 1 => {
                for value in out {
                    *value *= 1.0 + f64::EPSILON;
                }
            }
            Fault::DegreesRead => {
                for row in out.chunks_mut(width) {
                    for (i, channel) in record.channels().iter().enumerate() {
                        if let Channel::Sensor { index } = channel
                            && layout.sensors[*index].kind == "jointpos"
                        {
                            row[record.range(i).start] *= 180.0 / std::f64::consts::PI;
                        }
                    }
                }
            }
            Fault::QuaternionSwapped => {
                for row in out.chunks_mut(width) {
                    for (i, channel) in record.channels().iter().enumerate() {
                        let at = record.range(i).start;
                        match channel {
                            Channel::Sensor { index }
                                if layout.sensors[*index].kind == "framequat" =>
                            {
                                row[at..at + 4].rotate_left(1);
                            }
                            Channel::Position { len: 7, .. } => {
                                row[at + 3..at + 7].rotate_left(1);
                            }
                            _ => {}
                        }
                    }
                }
            }
            Fault::StaleSensor => {
                for rows in out.chunks_mut(width * frames) {
                    for (i, channel) in record.channels().iter().enumerate() {
                        if matches!(channel, Channel::Sensor { .. }) {
                            for frame in (1..frames).rev() {
                                let range = record.range(i);
                                let before = (frame - 1) * width + range.start
                                    ..(frame - 1) * width + range.end;
                                rows.copy_within(before, frame * width + range.start);
                            }
                        }
                    }
                }
            }
            _ => {}
        }
    }

    /// Commands with zero for the last of several actuators, or with zero in place of NaN.
    fn commands(&self, values: &[f64]) -> Vec<f64> {
        let nu = self.inner.layout().nu().max(1);
        let mut values = values.to_vec();
        if self.fault == Fault::TorqueIgnored && nu > 1 {
            values
                .iter_mut()
                .skip(nu - 1)
                .step_by(nu)
                .for_each(|c| *c = 0.0);
        }
        if self.fault == Fault::NanAccepted {
            values
                .iter_mut()
                .filter(|c| !c.is_finite())
                .for_each(|c| *c = 0.0);
        }
        values
    }

    /// Simulations in the order in which they are taken.
    fn order(&self, sims: &[usize]) -> Vec<usize> {
        let mut sims = sims.to_vec();
        if self.fault == Fault::OrderIgnored {
            sims.sort_unstable();
        }
        sims
    }

    /// Positions of some simulations.
    fn positions(&mut self, sims: &[usize]) -> Result<Vec<f64>> {
        let layout = self.inner.layout();
        let names: Vec<String> = (layout.joints.iter())
            .map(|j| format!("qpos.{}", j.name))
            .collect();
        let record = layout.recording(&names)?;
        let mut qpos = vec![0.0; sims.len() * record.width()];
        self.inner.read(sims, &record, &mut qpos)?;
        Ok(qpos)
    }

    fn wrench(&self, wrench: &[f64]) -> Vec<f64> {
        let factors = match self.fault {
            Fault::WrenchTorqueLost => [1.0, 0.0],
            Fault::ForceReversed => [-1.0, 1.0],
            _ => [1.0, 1.0],
        };
        let factor = |i: usize| factors[i % 6 / 3];
        wrench
            .iter()
            .enumerate()
            .map(|(i, w)| w * factor(i))
            .collect()
    }
}

impl Simulator for MutantSimulator {
    fn layout(&self) -> &Layout {
        self.inner.layout()
    }

    fn batch_size(&self) -> usize {
        self.inner.batch_size()
    }

    fn set_parameters(&mut self, sims: &[usize], values: &[f64]) -> Result<()> {
        let mut row_after_row = Vec::with_capacity(values.len());
        for row in values.chunks(self.masses.len().max(1)) {
            for (value, mass) in row.iter().zip(&self.masses) {
                row_after_row.push(match (mass, self.fault) {
                    (Some(nominal), Fault::MassUnused) => *nominal,
                    (Some(_), Fault::NegativeMass) => value.abs(),
                    _ => *value,
                });
            }
            row_after_row.extend(&self.more);
        }
        let values = match self.fault {
            Fault::MassUnused | Fault::NegativeMass | Fault::MassWithoutInertia => &row_after_row,
            _ => values,
        };
        self.inner.set_parameters(sims, values)?;
        if self.fault == Fault::SharedParameters && !sims.is_empty() {
            let columns = values.len() / sims.len();
            let all: Vec<usize> = (0..self.batch_size()).collect();
            let last = &values[values.len() - columns..];
            self.inner.set_parameters(&all, &last.repeat(all.len()))?;
        }
        Ok(())
    }

    fn reset(&mut self, sims: &[usize]) -> Result<()> {
        self.inner.reset(&self.order(sims))?;
        if self.fault == Fault::ResetRemembers && !sims.is_empty() {
            let nv = self.layout().nv;
            let qpos = self.positions(sims)?;
            let qvel = vec![1e-9; sims.len() * nv];
            self.inner.set_state(sims, &qpos, &qvel)?;
        }
        Ok(())
    }

    fn set_state(&mut self, sims: &[usize], qpos: &[f64], qvel: &[f64]) -> Result<()> {
        self.inner.set_state(sims, qpos, qvel)
    }

    fn rollout(&mut self, rollout: &Rollout<'_>, out: &mut [f64]) -> Result<()> {
        let (Control::Shared(values) | Control::PerSimulation(values)) = rollout.control;
        let values = self.commands(values);
        let control = match rollout.control {
            Control::Shared(_) => Control::Shared(&values),
            Control::PerSimulation(_) => Control::PerSimulation(&values),
        };
        let wrenches: Vec<Vec<f64>> = rollout
            .forces
            .iter()
            .map(|f| self.wrench(f.wrench))
            .collect();
        let forces: Vec<ExternalForce<'_>> = rollout
            .forces
            .iter()
            .zip(&wrenches)
            .map(|(force, wrench)| ExternalForce {
                body: force.body,
                wrench,
            })
            .collect();
        let hook = rollout.hook.map(|inner| SpoiltHook {
            inner,
            fault: self.fault,
            sims: rollout.sims,
            timestep: self.layout().timestep,
            center: self.center,
            before: Mutex::default(),
        });
        let sims = self.order(rollout.sims);
        let spoilt = Rollout {
            sims: &sims,
            hook: hook.as_ref().map(|hook| hook as &dyn StepHook),
            control,
            forces: &forces,
            changes: match self.fault {
                Fault::ChangesIgnored => &[],
                _ => rollout.changes,
            },
            ..*rollout
        };
        self.inner.rollout(&spoilt, out)?;
        if self.fault == Fault::OthersMove {
            let others: Vec<usize> = (0..self.batch_size())
                .filter(|s| !rollout.sims.contains(s))
                .collect();
            let nothing = Recording::default();
            let still = vec![0.0; self.layout().nu()];
            let control = Control::Shared(&still);
            let more = Rollout::new(&others, 1, 1, control, &nothing);
            self.inner.rollout(&more, &mut [])?;
        }
        self.spoil(rollout.record, rollout.frames, out);
        let rows = rollout.frames * rollout.record.width();
        match self.fault {
            Fault::HookDisturbs if rollout.hook.is_some() => {
                out.iter_mut().for_each(|x| *x *= 1.0 + f64::EPSILON);
            }
            Fault::LargeBatchCut if rollout.sims.len() > 1024 => out[1024 * rows..].fill(0.0),
            _ => {}
        }
        Ok(())
    }

    fn read(&mut self, sims: &[usize], record: &Recording, out: &mut [f64]) -> Result<()> {
        self.inner.read(sims, record, out)?;
        self.spoil(record, 1, out);
        Ok(())
    }

    fn save(&mut self, sims: &[usize]) -> Result<Snapshot> {
        self.inner.save(sims)
    }

    fn load(&mut self, snapshot: &Snapshot, rows: &[usize], sims: &[usize]) -> Result<()> {
        match self.inner.load(snapshot, rows, sims) {
            Err(_) if self.fault == Fault::AnySnapshot => return Ok(()),
            done => done?,
        }
        if self.fault == Fault::ForgetsVelocity {
            let nv = self.layout().nv;
            let qpos = self.positions(sims)?;
            self.inner
                .set_state(sims, &qpos, &vec![0.0; sims.len() * nv])?;
        }
        Ok(())
    }

    fn copy_state(&mut self, from: &[usize], to: &[usize]) -> Result<()> {
        self.inner.copy_state(from, to)
    }

    fn status(&self) -> &[Status] {
        match self.fault {
            Fault::DivergenceHidden => &self.running,
            _ => self.inner.status(),
        }
    }

    fn steps_taken(&self) -> u64 {
        self.inner.steps_taken()
    }
}
