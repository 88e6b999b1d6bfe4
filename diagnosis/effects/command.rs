//! Effects on the way from the command to the drive.

use asid_core::effect::{Acts, Effect, EffectParameter};
use asid_core::simulator::{StepHook, StepView};
use asid_core::{Layout, Result};

asid_core::register!(EffectEntry {
    name: "actuator-gain",
    about: "the command is scaled",
    make: || Box::new(Affine {
        parameters: &[EffectParameter {
            name: "gain",
            unit: "",
            range: [0.5, 1.5],
            null: 1.0
        }],
    }),
});

asid_core::register!(EffectEntry {
    name: "actuator-bias",
    about: "the command is shifted",
    make: || Box::new(Affine {
        parameters: &[EffectParameter {
            name: "bias",
            unit: "",
            range: [-0.1, 0.1],
            null: 0.0
        }],
    }),
});

/// `gain * command + bias`, with one of the two as its parameter.
struct Affine {
    parameters: &'static [EffectParameter],
}

struct AffineHook {
    actuator: usize,
    gain: f64,
    bias: f64,
}

impl StepHook for AffineHook {
    fn before_step(&self, _row: usize, _step: usize, view: &mut StepView<'_>) {
        let command = &mut view.ctrl[self.actuator];
        *command = self.gain * *command + self.bias;
    }
}

impl Effect for Affine {
    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        self.parameters
    }

    fn sites(&self, layout: &Layout) -> Vec<String> {
        layout.actuators.iter().map(|a| a.name.clone()).collect()
    }

    fn attach(
        &self,
        layout: &Layout,
        site: &str,
        values: &[f64],
    ) -> Result<Box<dyn StepHook + Send>> {
        let scaled = self.parameters[0].name == "gain";
        Ok(Box::new(AffineHook {
            actuator: layout.actuator(site)?,
            gain: if scaled { values[0] } else { 1.0 },
            bias: if scaled { 0.0 } else { values[0] },
        }))
    }
}
