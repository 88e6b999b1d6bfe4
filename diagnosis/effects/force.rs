//! Effects that are forces during the step.

use asid_core::effect::{Acts, Effect, EffectParameter};
use asid_core::layout::JointKind;
use asid_core::simulator::{StepHook, StepView};
use asid_core::{Layout, Result};

asid_core::register!(EffectEntry {
    name: "viscous-friction",
    about: "force against the speed of a joint",
    make: || Box::new(ViscousFriction),
});

/// Force `-damping * speed` on a hinge or slide.
///
/// It is explicit in time: stable while `damping` is below the joint's inertia over the time step.
struct ViscousFriction;

struct ViscousHook {
    dof: usize,
    damping: f64,
}

impl StepHook for ViscousHook {
    fn before_step(&self, _row: usize, _step: usize, view: &mut StepView<'_>) {
        view.force[self.dof] -= self.damping * view.qvel[self.dof];
    }
}

impl Effect for ViscousFriction {
    fn acts(&self) -> Acts {
        Acts::Force
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        &[EffectParameter {
            name: "damping",
            unit: "N m s/rad",
            range: [0.0, 10.0],
            null: 0.0,
        }]
    }

    fn sites(&self, layout: &Layout) -> Vec<String> {
        layout
            .joints
            .iter()
            .filter(|j| matches!(j.kind, JointKind::Hinge | JointKind::Slide))
            .map(|j| j.name.clone())
            .collect()
    }

    fn attach(
        &self,
        layout: &Layout,
        site: &str,
        values: &[f64],
    ) -> Result<Box<dyn StepHook + Send>> {
        Ok(Box::new(ViscousHook {
            dof: layout.joint(site)?.qvel,
            damping: values[0],
        }))
    }
}
