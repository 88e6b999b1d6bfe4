//! Friction of hinges and slides.
//!
//! Viscous friction is the engine's own damping; dry friction is `dry.rs`. The laws follow
//! B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, "A survey
//! of models, analysis tools and compensation methods for the control of machines with friction",
//! Automatica 30 (1994), and for friction that grows with the load M. Duclusaud et al., "Extended
//! friction models for the physics simulation of servo actuators", ICRA 2025.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Native, Reference, Site, Start};
use asid_core::simulator::StepView;
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::native::NativeModel;
use asid_mjcf::plant::{Drive, PlantJoint};

use super::drive::{DriveAt, gains};
use super::dry::{CREEP, DryFriction};
use super::{at_least, scalar_joints, target, values};

/// Name of the effect of dry friction at a joint.
pub const COULOMB: &str = "coulomb-friction";

crate::register!(EffectEntry {
    name: "viscous-friction",
    about: "friction of a joint in proportion to its speed",
    make: || Box::new(Viscous),
});

crate::register!(EffectEntry {
    name: COULOMB,
    about: "dry friction of a joint",
    make: || Box::new(Coulomb),
});

crate::register!(EffectEntry {
    name: "stribeck-friction",
    about: "dry friction that falls from its breakaway value as the joint speeds up",
    make: || Box::new(Stribeck),
});

crate::register!(EffectEntry {
    name: "load-friction",
    about: "dry friction that grows with the force of the drive",
    make: || Box::new(Load),
});

/// Speed below which a joint counts as standing.
///
/// By default a small share of its largest speed in the logs.
const CREEP_PARAMETER: EffectParameter =
    EffectParameter::new("creep", "rad/s or m/s", [1e-5, 0.1], CREEP)
        .starting(Start::Set(Reference::Speed, CREEP_SHARE));
/// Default of `creep`, as a share of the joint's largest speed.
const CREEP_SHARE: f64 = 3e-3;

/// Large values of dry friction to try, as shares of the drive's largest force.
///
/// At these the joint stands for much of the time. A fit converges from half or twice its value, so
/// that two values cover a decade.
const LARGE: &[f64] = &[0.1, 0.3];
/// Large values of friction that grows with the drive's force.
///
/// The share left for the motion is `1 - coefficient`; two values cover a decade of it.
const LARGE_BY_LOAD: &[f64] = &[0.3, 0.8];

/// Three standard deviations of a joint's friction from its model, as a share of it.
///
/// Seals, grease and preload differ between machines and with temperature, by a tenth and more
/// (Bittencourt and Gunnarsson 2012 report far more over temperature).
const FRICTION_TOLERANCE: f64 = 0.3;

/// A joint of the document, by name.
fn joint_of<'p>(plant: &'p Plant, name: &str) -> Option<&'p PlantJoint> {
    let index = plant.layout.joints.iter().position(|j| j.name == name);
    index.and_then(|i| plant.joints.get(i))
}

/// Force `-damping v`: `damping` adds to the joint's own.
struct Viscous;

struct ViscousAt {
    column: usize,
    damping: f64,
}

impl Acting for ViscousAt {
    fn set(&self, columns: &mut [f64]) {
        let value = &mut columns[self.column];
        *value = (*value + self.damping).max(0.0);
    }
}

impl Effect for Viscous {
    /// Bearings and seals have dry and viscous friction at once (Armstrong-Hélouvry and others
    /// 1994).
    fn goes_with(&self) -> &'static [&'static str] {
        &["coulomb-friction"]
    }

    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["linear-drag", "actuator-gain"],
            told_apart_by: "let it coast with the drive off",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[EffectParameter::new(
                "damping",
                "N m s/rad or N s/m",
                [0.0, 1000.0],
                0.0,
            )]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        scalar_joints(plant)
    }

    fn targets(&self, _plant: &Plant, site: &str) -> Vec<Target> {
        vec![target("joint", site, "damping", 0)]
    }

    fn tolerance(&self, plant: &Plant, site: &str, _: &dyn Fn(Reference) -> f64) -> Vec<[f64; 2]> {
        let off = FRICTION_TOLERANCE * joint_of(plant, site).map_or(0.0, |j| j.damping);
        vec![[-off, off]]
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [damping] = values(site)?;
        Ok(Box::new(ViscousAt {
            column: site.columns[0],
            damping,
        }))
    }
}

/// Friction `force + offset` against motion in the positive direction, `force - offset` otherwise.
///
/// This is dry friction `force` with a constant force `-offset`. Below the speed `creep` the
/// friction is viscous, since machines and simulators differ in how firmly they stick.
struct Coulomb;

struct CoulombAt {
    dry: DryFriction,
    dof: usize,
    force: f64,
    offset: f64,
}

impl Acting for CoulombAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        self.dry.resist(view, self.force);
        view.force[self.dof] -= self.offset;
    }

    fn restart(&mut self) {
        self.dry.before = None;
    }

    fn save(&self, memory: &mut Vec<f64>) {
        memory.extend(self.dry.before);
    }

    fn load(&mut self, memory: &[f64]) {
        self.dry.before = memory.first().copied();
    }
}

impl Effect for Coulomb {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["actuator-deadband"],
            told_apart_by: "reversals under way tell more: friction turns with the speed, a dead band does not",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("force", "N m or N", [0.0, 50.0], 0.0)
                    .large_at(Start::Multiples(Reference::Force, LARGE)),
                EffectParameter::new("offset", "N m or N", [-50.0, 50.0], 0.0)
                    .starting(Start::Given),
                CREEP_PARAMETER,
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        scalar_joints(plant)
    }

    fn targets(&self, _plant: &Plant, site: &str) -> Vec<Target> {
        vec![target("joint", site, "damping", 0)]
    }

    fn tolerance(
        &self,
        plant: &Plant,
        site: &str,
        shown: &dyn Fn(Reference) -> f64,
    ) -> Vec<[f64; 2]> {
        let Some(joint) = joint_of(plant, site) else {
            return Vec::new();
        };
        let friction = joint.damping * shown(Reference::Speed) + joint.frictionloss;
        let creep = shown(Reference::Speed) * CREEP_SHARE;
        vec![[0.0, FRICTION_TOLERANCE * friction], [0.0; 2], [creep; 2]]
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE | Capabilities::LIVE_PARAMETERS
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [force, offset, _] = values(site)?;
        document.joint(site.name)?.friction += force;
        Ok(if offset == 0.0 {
            Native::Nearly(
                "is MuJoCo's frictionloss, which lets a joint at rest creep in its own way".into(),
            )
        } else {
            Native::Nearly(format!(
                "is MuJoCo's frictionloss; its constant part of {offset} has no counterpart at a joint"
            ))
        })
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [force, offset, creep] = values(site)?;
        Ok(Box::new(CoulombAt {
            dry: DryFriction::new(site, creep)?,
            dof: site.plant.layout.joint(site.name)?.qvel,
            force,
            offset,
        }))
    }
}

/// Friction `coulomb + breakaway exp(-(v / speed)²)`.
///
/// `breakaway` is how much the friction at rest exceeds sliding friction; near `speed` most of it
/// is gone.
struct Stribeck;

struct StribeckAt {
    dry: DryFriction,
    dof: usize,
    breakaway: f64,
    coulomb: f64,
    speed: f64,
}

impl Acting for StribeckAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let x = view.qvel[self.dof] / self.speed;
        let friction = self.coulomb + self.breakaway * (-x * x).exp();
        self.dry.resist(view, friction);
    }

    fn restart(&mut self) {
        self.dry.before = None;
    }

    fn save(&self, memory: &mut Vec<f64>) {
        memory.extend(self.dry.before);
    }

    fn load(&mut self, memory: &[f64]) {
        self.dry.before = memory.first().copied();
    }
}

impl Effect for Stribeck {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn refines(&self) -> &'static [&'static str] {
        &["coulomb-friction"]
    }

    fn takes_over(&self) -> &'static [(&'static str, &'static str)] {
        &[("coulomb", "force")]
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("breakaway", "N m or N", [0.0, 50.0], 0.0),
                EffectParameter::new("coulomb", "N m or N", [0.0, 50.0], 0.0),
                EffectParameter::new("speed", "rad/s or m/s", [0.001, 10.0], 0.1)
                    .starting(Start::Multiples(Reference::Speed, &[0.03, 0.1, 0.3])),
                CREEP_PARAMETER,
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        scalar_joints(plant)
    }

    fn targets(&self, _plant: &Plant, site: &str) -> Vec<Target> {
        vec![target("joint", site, "damping", 0)]
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE | Capabilities::LIVE_PARAMETERS
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [breakaway, coulomb, _, _] = values(site)?;
        document.joint(site.name)?.friction += coulomb;
        Ok(Native::Nearly(format!(
            "is written as dry friction of {coulomb}: MJCF's does not fall with speed, and the {breakaway} more that hold \
             at rest are left out"
        )))
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [breakaway, coulomb, speed, creep] = values(site)?;
        Ok(Box::new(StribeckAt {
            dry: DryFriction::new(site, creep)?,
            dof: site.plant.layout.joint(site.name)?.qvel,
            breakaway,
            coulomb,
            speed: at_least(site, "speed", speed, 1e-9)?,
        }))
    }
}

/// Friction `coefficient |F|`, `F` the force of the joint's drives at the start of the step.
///
/// Gears behave so: the load that they transmit presses them together.
struct Load;

struct LoadAt {
    dry: DryFriction,
    drives: Vec<DriveAt>,
    coefficient: f64,
}

impl Acting for LoadAt {
    fn set(&self, columns: &mut [f64]) {
        self.drives.iter().for_each(|d| d.set(columns));
    }

    fn before_step(&mut self, view: &mut StepView<'_>) {
        let force: f64 = self.drives.iter().map(|d| d.force(view)).sum();
        self.dry.resist(view, self.coefficient * force.abs());
    }

    fn restart(&mut self) {
        self.dry.before = None;
    }

    fn save(&self, memory: &mut Vec<f64>) {
        memory.extend(self.dry.before);
    }

    fn load(&mut self, memory: &[f64]) {
        self.dry.before = memory.first().copied();
    }
}

/// The drives of a joint with the indices of their actuators.
fn drives_of(plant: &Plant, joint: &str) -> Vec<(usize, Drive)> {
    let joints = &plant.layout.joints;
    let index = joints.iter().position(|j| j.name == joint);
    index.map_or_else(Vec::new, |j| {
        plant.drives_of(j).map(|(i, d)| (i, *d)).collect()
    })
}

impl Effect for Load {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                // At 1 the drive could not move its joint.
                EffectParameter::new("coefficient", "1", [0.0, 0.99], 0.0)
                    .large_at(Start::Values(LARGE_BY_LOAD)),
                CREEP_PARAMETER,
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let joints = plant.scalar_joints();
        joints
            .filter(|&j| {
                let mut drives = plant.drives_of(j).peekable();
                drives.peek().is_some() && drives.all(|(_, drive)| drive.is_memoryless())
            })
            .map(|j| plant.layout.joints[j].name.clone())
            .collect()
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        let mut targets = vec![target("joint", site, "damping", 0)];
        let drives = drives_of(plant, site);
        targets.extend(drives.iter().flat_map(|(i, _)| gains(plant, *i)));
        targets
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE | Capabilities::LIVE_PARAMETERS
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [coefficient, creep] = values(site)?;
        let mut columns = site.columns[1..].iter().copied();
        let drives = drives_of(site.plant, site.name).into_iter();
        Ok(Box::new(LoadAt {
            dry: DryFriction::new(site, creep)?,
            drives: drives
                .map(|(i, drive)| DriveAt::new(site.plant, i, drive, &mut columns))
                .collect(),
            coefficient: at_least(site, "coefficient", coefficient, 0.0)?,
        }))
    }
}
