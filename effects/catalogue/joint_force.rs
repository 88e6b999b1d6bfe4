//! Forces that depend on a joint's position: a parallel spring, and cogging.

use crate::{Acting, Acts, Effect, EffectParameter, Native, Site, Start};
use asid_core::Result;
use asid_core::layout::JointKind;
use asid_core::simulator::StepView;
use asid_mjcf::Plant;
use asid_mjcf::native::{NativeModel, Spring};

use super::{scalar_joints, values};

crate::register!(EffectEntry {
    name: "joint-stiffness",
    about: "a spring, cable or hose in parallel with a joint",
    make: || Box::new(Stiffness),
});

crate::register!(EffectEntry {
    name: "torque-ripple",
    about: "cogging: a torque that is periodic in the angle of a joint",
    make: || Box::new(Ripple),
});

/// Force `-(stiffness d + cubic d³)` with `d = q - rest`.
///
/// These are the first terms of any spring that is symmetric about its rest. With `cubic` it
/// stiffens, as cables, hoses and rubber do (G. Duffing, "Erzwungene Schwingungen bei
/// veränderlicher Eigenfrequenz", 1918). It is explicit in time: stable while the period is above
/// `pi` time steps.
struct Stiffness;

struct StiffnessAt {
    qpos: usize,
    dof: usize,
    stiffness: f64,
    rest: f64,
    cubic: f64,
}

impl Acting for StiffnessAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let d = view.qpos[self.qpos] - self.rest;
        view.force[self.dof] -= (self.stiffness + self.cubic * d * d) * d;
    }
}

impl Effect for Stiffness {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("stiffness", "N m/rad or N/m", [0.0, 200.0], 0.0),
                EffectParameter::new("rest", "rad or m", [-3.2, 3.2], 0.0)
                    .starting(Start::Values(&[0.0, -0.1, 0.1, -0.3, 0.3, -1.0, 1.0])),
                EffectParameter::new("cubic", "N m/rad³ or N/m³", [0.0, 1000.0], 0.0)
                    .starting(Start::Given),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        scalar_joints(plant)
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [stiffness, rest, cubic] = values(site)?;
        document.joint(site.name)?.springs.push(Spring {
            stiffness,
            rest,
            cubic,
        });
        if cubic != 0.0 {
            return Ok(Native::Nearly(
                "has a cubic part, written as the polynomial that MuJoCo's `stiffness` takes in its newer versions".into(),
            ));
        }
        Ok(Native::Whole)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [stiffness, rest, cubic] = values(site)?;
        let joint = site.plant.layout.joint(site.name)?;
        Ok(Box::new(StiffnessAt {
            qpos: joint.qpos,
            dof: joint.qvel,
            stiffness,
            rest,
            cubic,
        }))
    }
}

/// Torque `amplitude_sin sin(n q) + amplitude_cos cos(n q)` on a hinge, `n = teeth` a turn.
struct Ripple;

struct RippleAt {
    qpos: usize,
    dof: usize,
    amplitudes: [f64; 2],
    teeth: f64,
}

impl Acting for RippleAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let (sin, cos) = (self.teeth * view.qpos[self.qpos]).sin_cos();
        view.force[self.dof] += self.amplitudes[0] * sin + self.amplitudes[1] * cos;
    }
}

impl Effect for Ripple {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("amplitude_sin", "N m", [-5.0, 5.0], 0.0),
                EffectParameter::new("amplitude_cos", "N m", [-5.0, 5.0], 0.0),
                EffectParameter::new("teeth", "1/turn", [1.0, 64.0], 6.0).starting(Start::Choice(
                    &[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 16.0, 24.0],
                )),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let joints = plant.scalar_joints();
        joints
            .filter(|&j| plant.joint_kind(j) == JointKind::Hinge)
            .map(|j| plant.layout.joints[j].name.clone())
            .collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [sin, cos, teeth] = values(site)?;
        let joint = site.plant.layout.joint(site.name)?;
        Ok(Box::new(RippleAt {
            qpos: joint.qpos,
            dof: joint.qvel,
            amplitudes: [sin, cos],
            teeth,
        }))
    }
}
