//! A magnetic catch: a magnet that pulls a joint to one place, as on a cupboard door or a laptop
//! lid.
//!
//! Its potential energy is a well `U(q) = -depth exp(-(q - place)^2 / (2 width^2))`, so the force
//! on the joint is
//!
//! `F(q) = -depth (q - place) / width^2 exp(-(q - place)^2 / (2 width^2))`.
//!
//! It is largest at one width from the place, where it is `0.61 depth / width`. It takes no energy
//! from the motion. The force is explicit in time: it is accurate if the joint takes several steps
//! to cross a width.

use asid_core::simulator::StepView;
use asid_core::{Error, Result};
use asid_effects::{Acting, Acts, Effect, EffectParameter, Site, Start};
use asid_mjcf::Plant;

asid_effects::register!(EffectEntry {
    name: "magnetic-catch",
    about: "a magnet draws a joint to one place",
    make: || Box::new(MagneticCatch),
});

asid_plugin::export_plugin!();

/// The effect.
struct MagneticCatch;

impl Effect for MagneticCatch {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("depth", "J", [0.0, 1.0], 0.0),
                EffectParameter::new("place", "rad or m", [-1.0, 1.0], 0.0)
                    .starting(Start::Values(&[-0.6, 0.0, 0.6])),
                EffectParameter::new("width", "rad or m", [0.01, 0.5], 0.1)
                    .starting(Start::Values(&[0.1])),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let joints = plant.scalar_joints();
        joints
            .map(|j| plant.layout.joints[j].name.clone())
            .collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [depth, place, width] = site.values else {
            return Err(Error::Shape("magnetic-catch has three values".into()));
        };
        if *width <= 0.0 {
            return Err(Error::Config {
                key: "magnetic-catch width".into(),
                message: format!("{width} is not above 0"),
            });
        }
        let joint = site.plant.layout.joint(site.name)?;
        Ok(Box::new(Catch {
            qpos: joint.qpos,
            dof: joint.qvel,
            depth: *depth,
            place: *place,
            width: *width,
        }))
    }
}

/// The magnet at one joint.
struct Catch {
    qpos: usize,
    dof: usize,
    depth: f64,
    place: f64,
    width: f64,
}

impl Acting for Catch {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let x = (view.qpos[self.qpos] - self.place) / self.width;
        view.force[self.dof] -= self.depth / self.width * x * (-0.5 * x * x).exp();
    }
}
