//! An effect on commands with memory: a drive gets its command some physics steps late.
//!
//! The test compares it with a drive that is commanded later.

#![allow(clippy::unwrap_used)]

use std::collections::VecDeque;

use asid_core::simulator::StepView;
use asid_core::{BatchConfig, Control, Error, Model as _, Result, Rollout, Scene};
use asid_effects::refined::Refined;
use asid_effects::{Acting, Acts, Effect, EffectParameter, EffectSpec, Site, Start};
use asid_mjcf::Plant;

asid_effects::register!(EffectEntry {
    name: "late-command",
    about: "a command arrives some physics steps late",
    make: || Box::new(LateCommand),
});

/// Largest number of physics steps in the search.
const MOST: f64 = 50.0;

/// The effect.
struct LateCommand;

impl Effect for LateCommand {
    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            // Whole steps have no slope, so a search begins at several values.
            &[EffectParameter::new("steps", "1", [0.0, MOST], 0.0)
                .starting(Start::Values(&[2.0, 5.0, 10.0]))]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let actuators = plant.layout.actuators.iter();
        actuators.map(|a| a.name.clone()).collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [steps] = site.values else {
            return Err(Error::Shape("late-command has one value".into()));
        };
        Ok(Box::new(Late {
            actuator: site.plant.layout.actuator(site.name)?,
            steps: steps.clamp(0.0, MOST).round() as usize,
            // Sized for any value, so that a step allocates nothing.
            past: VecDeque::with_capacity(MOST as usize + 1),
        }))
    }
}

/// Delayed commands of one drive.
struct Late {
    actuator: usize,
    steps: usize,
    /// Commands of the last steps, the latest first.
    past: VecDeque<f64>,
}

impl Acting for Late {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let command = &mut view.ctrl[self.actuator];
        self.past.truncate(MOST as usize);
        self.past.push_front(*command);
        // Before the first step the command was that of the first step.
        *command = self.past[self.steps.min(self.past.len() - 1)];
    }

    fn restart(&mut self) {
        self.past.clear();
    }

    fn save(&self, memory: &mut Vec<f64>) {
        memory.extend(&self.past);
    }

    fn load(&mut self, memory: &[f64]) {
        self.past.clear();
        self.past.extend(memory);
    }
}

/// A rotor driven by a motor.
const ROTOR: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
  <worldbody><body name="rotor"><joint name="spin" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.5 0.5 0.5"/></body></worldbody>
  <actuator><motor name="drive" joint="spin"/></actuator>
  <sensor><jointpos name="angle" joint="spin"/></sensor></mujoco>"#;

/// Angles after each step under commands, in two consecutive rollouts.
fn angles(effect: Option<&str>, commands: &[f64]) -> Vec<f64> {
    let scene = Scene::from_xml("rotor", ROTOR, &[]).unwrap();
    let specs: Vec<EffectSpec> = effect.iter().map(|e| e.parse().unwrap()).collect();
    let model = Refined::load(&asid_rapier::Rapier, &scene, &specs).unwrap();
    let config = BatchConfig {
        size: 1,
        threads: 1,
        targets: Vec::new(),
    };
    let mut simulator = model.simulator(&config).unwrap();
    let recording = model.layout().recording(&["angle"]).unwrap();
    let mut all = Vec::new();
    for half in commands.chunks(commands.len() / 2) {
        let control = Control::Shared(half);
        let rollout = Rollout::new(&[0], half.len(), 1, control, &recording);
        let mut out = vec![0.0; half.len()];
        simulator.rollout(&rollout, &mut out).unwrap();
        all.extend(out);
    }
    all
}

#[test]
fn a_late_command_is_one_that_is_given_later() {
    let commands: Vec<f64> = (0..100).map(|k| (0.1 * f64::from(k)).cos()).collect();
    let late = 7;
    let given_later: Vec<f64> = (0..commands.len())
        .map(|k| commands[k.saturating_sub(late)])
        .collect();
    assert_eq!(
        angles(Some("late-command@drive:steps=7"), &commands),
        angles(None, &given_later)
    );
}

#[test]
fn off_at_its_null_value_to_the_bit() {
    let commands = [0.3, -0.2, 0.1, 0.5];
    let effect = Some("late-command@drive");
    assert_eq!(angles(effect, &commands), angles(None, &commands));
}
