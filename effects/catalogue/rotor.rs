//! Rotor inertia at a joint, seen through the gear.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Site};
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;

use super::{scalar_joints, target, values};

crate::register!(EffectEntry {
    name: "armature",
    about: "inertia of the drive's rotor at a joint",
    make: || Box::new(Armature),
});

/// Adds `inertia` (the rotor's times the square of the gear ratio) to the joint's `armature`.
struct Armature;

struct ArmatureAt {
    column: usize,
    inertia: f64,
}

impl Acting for ArmatureAt {
    fn set(&self, columns: &mut [f64]) {
        let value = &mut columns[self.column];
        *value = (*value + self.inertia).max(0.0);
    }
}

impl Effect for Armature {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["inertia", "mass", "payload"],
            told_apart_by: "take other poses, or add a known payload",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Model
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[EffectParameter::new(
                "inertia",
                "kg m² or kg",
                [0.0, 5.0],
                0.0,
            )]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        scalar_joints(plant)
    }

    fn targets(&self, _plant: &Plant, site: &str) -> Vec<Target> {
        vec![target("joint", site, "armature", 0)]
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [inertia] = values(site)?;
        Ok(Box::new(ArmatureAt {
            column: site.columns[0],
            inertia,
        }))
    }
}
