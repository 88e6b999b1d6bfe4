//! Effects on the way from the command to the drive.

use asid_core::effect::{Acting, Acts, Effect, EffectParameter, Site};
use asid_core::simulator::StepView;
use asid_core::{Plant, Result};

asid_core::register!(EffectEntry {
    name: "actuator-gain",
    about: "the command is scaled",
    make: || Box::new(Affine {
        parameters: const { &[EffectParameter::new("gain", "", [0.2, 2.0], 1.0)] },
    }),
});

asid_core::register!(EffectEntry {
    name: "actuator-bias",
    about: "the command is shifted",
    make: || Box::new(Affine {
        parameters: const {
            &[EffectParameter::new(
                "bias",
                "unit of the command",
                [-10.0, 10.0],
                0.0,
            )]
        },
    }),
});

/// `gain * command + bias`, with one of the two as its parameter.
struct Affine {
    parameters: &'static [EffectParameter],
}

struct AffineAt {
    actuator: usize,
    gain: f64,
    bias: f64,
}

impl Acting for AffineAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
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

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let actuators = plant.layout.actuators.iter();
        actuators.map(|a| a.name.clone()).collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let scaled = self.parameters[0].name == "gain";
        let value = site.values[0];
        Ok(Box::new(AffineAt {
            actuator: site.plant.layout.actuator(site.name)?,
            gain: if scaled { value } else { 1.0 },
            bias: if scaled { 0.0 } else { value },
        }))
    }
}
