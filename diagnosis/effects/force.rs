//! Effects that are forces during the step.

use asid_core::effect::{Acting, Acts, Effect, EffectParameter, Site};
use asid_core::simulator::StepView;
use asid_core::{Plant, Result};

asid_core::register!(EffectEntry {
    name: "viscous-friction",
    about: "force against the speed of a joint",
    make: || Box::new(ViscousFriction),
});

/// Force `-damping * speed` on a hinge or slide.
///
/// It is explicit in time: stable while `damping` is below the joint's inertia over the time step.
struct ViscousFriction;

struct ViscousAt {
    dof: usize,
    damping: f64,
}

impl Acting for ViscousAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        view.force[self.dof] -= self.damping * view.qvel[self.dof];
    }
}

impl Effect for ViscousFriction {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[EffectParameter::new(
                "damping",
                "N m s/rad or N s/m",
                [0.0, 100.0],
                0.0,
            )]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let joints = plant.scalar_joints();
        joints
            .map(|j| plant.layout.joints[j].name.clone())
            .collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        Ok(Box::new(ViscousAt {
            dof: site.plant.layout.joint(site.name)?.qvel,
            damping: site.values[0],
        }))
    }
}
