//! Play on the command's side, as of a lever or an encoder that the command moves.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Site};
use asid_core::Result;
use asid_core::simulator::StepView;
use asid_mjcf::Plant;

use super::command::WIDTH;
use super::{actuators, at_least, values};

crate::register!(EffectEntry {
    name: "actuator-hysteresis",
    about: "the command is followed with play",
    make: || Box::new(Hysteresis),
});

/// The output stays while the command is within `width / 2` of it, and is moved along beyond.
///
/// This is the play operator (M. Krasnosel'skii, A. Pokrovskii, "Systems with Hysteresis", 1989),
/// and Simulink's Backlash block. It begins in the middle of the play, with the first command as
/// its output. Play between a drive and its load is another effect, `backlash`.
struct Hysteresis;

struct HysteresisAt {
    actuator: usize,
    half: f64,
    /// The last output.
    level: Option<f64>,
}

impl Acting for HysteresisAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let command = &mut view.ctrl[self.actuator];
        let u = *command;
        let level = self.level.unwrap_or(u);
        *command = level.clamp(u - self.half, u + self.half);
        self.level = Some(*command);
    }

    fn restart(&mut self) {
        self.level = None;
    }

    fn save(&self, memory: &mut Vec<f64>) {
        memory.extend(self.level);
    }

    fn load(&mut self, memory: &[f64]) {
        self.level = memory.first().copied();
    }
}

impl Effect for Hysteresis {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["backlash", "actuator-deadband", "actuator-delay"],
            told_apart_by: "reverse slowly and fast, under a load: this play loses the same width each time, whatever pushes",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const { &[WIDTH] }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        actuators(plant)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [width] = values(site)?;
        Ok(Box::new(HysteresisAt {
            actuator: site.plant.layout.actuator(site.name)?,
            half: at_least(site, "width", width, 0.0)? / 2.0,
            level: None,
        }))
    }
}
