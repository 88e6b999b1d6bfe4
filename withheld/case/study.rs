//! Writes a draw: the style of its logs, its study file and its label.

use std::collections::BTreeMap;

use rand::Rng;

use super::Draw;
use super::rules::LeftOut;
use super::sizing::Causes;
use crate::cause::Standing;
use crate::dirt::Item;
use crate::engine::RAPIER;
use crate::faults::{LogFault, Wiring, WiringKind};
use crate::gap::Bench;
use crate::label::{Label, WiringLabel};
use crate::log;
use crate::plan::Kind;
use crate::world::World;

/// Range of the noise correlation from row to row in dirty worlds.
const COLOUR: [f64; 2] = [0.1, 0.5];
/// Correlation of the noise from row to row in logs with filtered noise.
const FILTERED: f64 = 0.95;
/// Standard deviation of the reading times about their stamps in dirty worlds, as a share of the
/// time between rows.
const JITTER: [f64; 2] = [0.01, 0.04];
/// The same deviation in logs with jittered stamps.
const JITTERED: f64 = 0.15;
/// Share of cases whose study gives the noise.
const NOISE_GIVEN: f64 = 0.25;
/// Share of cases whose logs do not give the initial state.
const NO_START: f64 = 0.2;

impl Draw<'_> {
    pub(super) fn log_style(&mut self, bench: &Bench<'_>) -> Result<log::Style, LeftOut> {
        let wiring = match self.slot.wiring {
            None => None,
            Some(kind) => {
                let spread = &bench.typical.spread;
                let drawn = Wiring::draw(kind, self.anatomy, spread, &mut self.random);
                if drawn.is_none() {
                    // A wrong sign replaces a fault for which the machine has no columns.
                    self.slot.wiring = Some(WiringKind::Sign);
                }
                drawn.or_else(|| {
                    let sign = WiringKind::Sign;
                    Wiring::draw(sign, self.anatomy, spread, &mut self.random)
                })
            }
        };
        let (random, fault) = (&mut self.random, self.slot.fault);
        let mut within = |[low, high]: [f64; 2]| random.random_range(low..high);
        let (mut colour, mut jitter) = (0.0, 0.0);
        if self.slot.dirty {
            (colour, jitter) = (within(COLOUR), within(JITTER));
        }
        match fault {
            Some(LogFault::FilteredNoise) => colour = FILTERED,
            Some(LogFault::Jitter) => jitter = JITTERED,
            _ => {}
        }
        let starts = random.random::<f64>() >= NO_START;
        Ok(log::Style {
            colour,
            jitter,
            starts: starts && self.slot.fault != Some(LogFault::NoStart),
            fault,
            wiring,
        })
    }

    pub(super) fn study_file(&mut self) -> String {
        let mut text = String::from(
            "model = \"nominal.xml\"\ntrain = [\"train_*.csv\"]\ntest = [\"test_*.csv\"]\n",
        );
        for p in self.anatomy.machine.parameters {
            text += &format!(
                "\n[[parameter]]\nname = \"{}\"\ntarget = \"{}\"\nrange = [{}, {}]\n",
                p.name, p.target, p.range[0], p.range[1]
            );
        }
        if self.random.random::<f64>() < NOISE_GIVEN {
            text += "\n[noise]\n";
            for (name, noise) in self.anatomy.machine.noise {
                // A name may contain characters that a bare key of TOML must not have.
                text += &format!("\"{name}\" = {noise}\n");
            }
        }
        text
    }

    pub(super) fn label(
        &self,
        bench: &Bench<'_>,
        truth: &[f64],
        causes: &Causes,
        style: &log::Style,
    ) -> Label {
        let machine = &self.anatomy.machine;
        let (engine, integrator) = match bench.integrator {
            RAPIER => (RAPIER, "semi-implicit Euler"),
            other => ("mujoco", other),
        };
        let mut label = Label {
            world: machine.name.to_owned(),
            half: machine.half.name().to_owned(),
            kind: match (self.slot.kind, causes.own.len()) {
                (Kind::None, _) => "none",
                (Kind::Group, _) => "group",
                (Kind::Unknown, _) => "unknown",
                (_, 3..) => "triple",
                (_, 2) => "pair",
                _ => "single",
            }
            .to_owned(),
            effects: causes.items.iter().map(Item::label).collect(),
            effect_parameters: BTreeMap::new(),
            agreed_only: Vec::new(),
            parameters: machine
                .parameters
                .iter()
                .zip(truth)
                .map(|(p, v)| (p.name.to_owned(), *v))
                .collect(),
            acceptable: Vec::new(),
            dirty: self.slot.dirty,
            dirt: Vec::new(),
            dirt_gap: 0.0,
            target_gap: 0.0,
            factor: if self.slot.dirty && !causes.items.is_empty() {
                self.slot.aim(self.lower)
            } else {
                0.0
            },
            own_gaps: causes.own.clone(),
            excess_gap: 0.0,
            signals: BTreeMap::new(),
            places: Vec::new(),
            wiring: style
                .wiring
                .iter()
                .map(|w| WiringLabel {
                    fault: w.fault.to_owned(),
                    columns: w.columns.clone(),
                    value: w.value,
                })
                .collect(),
            noise_correlation: style.colour,
            jitter: style.jitter,
            log_faults: self
                .slot
                .fault
                .iter()
                .map(|f| f.name().to_owned())
                .collect(),
            little_excitation: self.slot.little,
            starts: style.starts,
            timestep: bench.timestep,
            engine: engine.to_owned(),
            integrator: integrator.to_owned(),
            integration_gap: 0.0,
            noise: machine
                .noise
                .iter()
                .map(|(n, s)| ((*n).to_owned(), *s))
                .collect(),
            left_out: Vec::new(),
            salt: String::new(),
        };
        if self.slot.little && !causes.items.is_empty() {
            // If the machine hardly moves, its readings may not show the cause.
            label.acceptable.push(vec!["none".to_owned()]);
        }
        let mut nowhere = World::new(self.anatomy, truth, bench.timestep, bench.integrator).ok();
        for item in &causes.items {
            let Some(world) = &mut nowhere else { break };
            for (name, value) in item.act(self.anatomy, &bench.typical, world) {
                let key = format!("{}.{name}", item.label());
                label.effect_parameters.insert(key, value);
            }
            if item.cause.standing() == Standing::Agreed {
                label.agreed_only.push(item.label());
            }
        }
        label
    }
}
