//! Forces on moving bodies: a constant force, and forces of the air.

use crate::{Acting, Acts, Effect, EffectParameter, Native, Reach, Site};
use asid_core::Result;
use asid_core::nalgebra::Vector3;
use asid_core::simulator::StepView;
use asid_mjcf::Plant;
use asid_mjcf::native::NativeModel;

use super::point::{BodyPoint, Motion};
use super::{at_least, values};

crate::register!(EffectEntry {
    name: "constant-force",
    about: "a force on a body that never changes",
    make: || Box::new(BodyForce {
        law: |[x, y, z]| Law::Constant(Vector3::new(x, y, z)),
        parameters: const {
            &[
                EffectParameter::new("x", "N", [-50.0, 50.0], 0.0),
                EffectParameter::new("y", "N", [-50.0, 50.0], 0.0),
                EffectParameter::new("z", "N", [-50.0, 50.0], 0.0),
            ]
        },
        free: false,
    }),
});

crate::register!(EffectEntry {
    name: "linear-drag",
    about: "force against the velocity of a body",
    make: || Box::new(BodyForce {
        law: |[coefficient, ..]| Law::Linear(coefficient),
        parameters: const {
            &[EffectParameter::new(
                "coefficient",
                "N s/m",
                [0.0, 20.0],
                0.0,
            )]
        },
        free: false,
    }),
});

crate::register!(EffectEntry {
    name: "quadratic-drag",
    about: "air drag of a body: it grows with the square of the speed",
    make: || Box::new(BodyForce {
        law: |[coefficient, ..]| Law::Quadratic(coefficient),
        parameters: const {
            &[EffectParameter::new(
                "coefficient",
                "N s²/m²",
                [0.0, 5.0],
                0.0,
            )]
        },
        free: false,
    }),
});

crate::register!(EffectEntry {
    name: "magnus",
    about: "force across the velocity of a spinning body",
    make: || Box::new(BodyForce {
        law: |[coefficient, ..]| Law::Magnus(coefficient),
        parameters: const {
            &[EffectParameter::new(
                "coefficient",
                "N s²/(m rad)",
                [-0.1, 0.1],
                0.0,
            )]
        },
        free: true,
    }),
});

/// A force at the centre of mass, in the world's frame.
///
/// The drags are `-c v` and `-c |v| v`. The coefficient is reduced to `c (1 - e^-x) / x` with
/// `x = c dt / m`, and to `c / (1 + x)` with `x = c |v| dt / m`. A step of a free body of mass `m`
/// is then exact and stable. The Magnus force is `c ω x v` (R. D. Mehta, "Aerodynamics of sports
/// balls", Annu. Rev. Fluid Mech. 17, 1985).
#[derive(Clone, Copy)]
enum Law {
    Constant(Vector3<f64>),
    Linear(f64),
    Quadratic(f64),
    Magnus(f64),
}

impl Law {
    /// The force; `share` is the time step over the mass.
    fn force(self, motion: &Motion, share: f64) -> Vector3<f64> {
        let v = motion.velocity;
        match self {
            Self::Constant(force) => force,
            Self::Linear(c) => {
                let x = c * share;
                let factor = if x > 0.0 { -(-x).exp_m1() / x } else { 1.0 };
                -v * (c * factor)
            }
            Self::Quadratic(c) => {
                let c = c * v.norm();
                -v * (c / (1.0 + c * share))
            }
            Self::Magnus(c) => motion.turning.cross(&v) * c,
        }
    }
}

/// Sine of the angle up to which a force counts as parallel to gravity.
///
/// It allows for the rounding of numbers in a file.
const PARALLEL: f64 = 1e-9;

/// One of the laws, at bodies that can move.
struct BodyForce {
    parameters: &'static [EffectParameter],
    law: fn([f64; 3]) -> Law,
    /// Whether only bodies with a free joint are sites.
    free: bool,
}

struct BodyForceAt {
    point: BodyPoint,
    law: Law,
    share: f64,
}

impl Acting for BodyForceAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let motion = self.point.motion(view.qpos, view.qvel);
        let force = self.law.force(&motion, self.share);
        self.point.push(view, &force);
    }
}

impl Effect for BodyForce {
    fn unusual_at(&self, plant: &Plant, site: &str) -> bool {
        let body = plant.layout.body(site);
        body.is_ok_and(|b| plant.free_joint(b).is_none())
    }

    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn reach(&self, plant: &Plant, site: &str) -> Reach {
        Reach::of_body(plant, site)
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        self.parameters
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        moving_bodies(plant)
            .filter(|&b| !self.free || plant.free_joint(b).is_some())
            .map(|b| plant.layout.bodies[b].clone())
            .collect()
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let (&[x, y, z], gravity) = (site.values, Vector3::from(site.plant.gravity)) else {
            return Ok(Native::LeftOut(
                "has no counterpart at one body: MJCF's fluid acts on all bodies".into(),
            ));
        };
        let force = Vector3::new(x, y, z);
        let across = force.cross(&gravity).norm();
        if gravity.norm() == 0.0 || across > PARALLEL * force.norm() * gravity.norm() {
            return Ok(Native::LeftOut(
                "is not along gravity: MJCF has no constant force but the share of a weight that is carried".into(),
            ));
        }
        let body = site.plant.layout.body(site.name)?;
        let weight = gravity * site.plant.bodies[body].mass;
        document.carry(site.name, -force.dot(&weight) / weight.norm_squared())?;
        Ok(Native::Whole)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let given = match *site.values {
            [x, y, z] => [x, y, z],
            _ => {
                let [x] = values(site)?;
                [x, 0.0, 0.0]
            }
        };
        let law = (self.law)(given);
        if let Law::Linear(c) | Law::Quadratic(c) = law {
            at_least(site, "coefficient", c, 0.0)?;
        }
        let body = site.plant.layout.body(site.name)?;
        Ok(Box::new(BodyForceAt {
            point: BodyPoint::center(site.plant, body),
            law,
            share: site.plant.layout.timestep / site.plant.bodies[body].mass,
        }))
    }
}

/// Bodies with mass and joints of their own.
fn moving_bodies(plant: &Plant) -> impl Iterator<Item = usize> {
    let bodies = plant.bodies.iter().enumerate();
    bodies
        .filter(|(_, b)| b.mass > 0.0 && !b.joints.is_empty())
        .map(|(i, _)| i)
}
