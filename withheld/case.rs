//! One case: a world, its logs and its label.

mod rules;
mod sizing;
mod study;

use std::collections::BTreeMap;

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use crate::anatomy::Anatomy;
use crate::dirt;
use crate::engine::{RAPIER, Sim};
use crate::error::{Error, Result};
use crate::faults::LogFault;
use crate::gap::Bench;
use crate::label::Label;
use crate::log;
use crate::motion::{self, Motion};
use crate::plan::{Plan, Slot};
use crate::random::{digest, stream};
use crate::regime::{Watch, places};
use crate::seal::hex;
use crate::simulate::watched;
use rules::LeftOut;
use sizing::Background;

/// Number of training logs.
const TRAIN: usize = 6;
/// Number of held-out logs.
const TEST: usize = 3;
/// Draws of a case before the generator gives it up.
const ATTEMPTS: u32 = 12;
/// Draws after which a case gets another machine of the half.
const PATIENCE: u32 = 4;
/// Amplitude of a machine that hardly moves, as a share of its usual amplitude.
const LITTLE: f64 = 0.04;
/// Factors of a machine's usual row rate.
const RATES: [f64; 5] = [0.5, 1.0, 1.0, 2.0, 2.5];
/// Range of the factor of a machine's usual episode length.
const LENGTHS: [f64; 2] = [0.7, 1.3];
/// Excess gap above which the label lists signals and places, in noise floors.
const SPEAKS: f64 = 0.05;
/// Share of the worlds of a body in free flight that rapier moves: one half, so that both engines
/// are equally common.
const BY_RAPIER: f64 = 0.5;
/// Share of an episode that a machine rests before it moves, in a log with an encoder at rest.
const REST: f64 = 0.3;
/// Rows per second of a fast log.
const FAST: f64 = 1000.0;
/// Rows of all logs of a case with long logs.
const LONG: f64 = 100_000.0;

/// A case, ready to be written.
pub struct Case {
    /// Files of the study by name.
    pub study: BTreeMap<String, String>,
    /// Label of the case.
    pub label: Label,
}

/// Makes a case of a plan.
///
/// # Errors
/// If a model is wrong, or if no draw is usable.
pub fn make(plan: &Plan, seed: u64, number: usize) -> Result<Case> {
    let mut left_out: Vec<String> = Vec::new();
    for attempt in 0..ATTEMPTS {
        let names = [
            "case",
            plan.half.name(),
            &number.to_string(),
            &attempt.to_string(),
        ];
        // After `PATIENCE` draws the case gets another machine of the half, so that the set has as
        // many cases as were asked for.
        let slot = &plan.slots[number];
        let other = attempt.saturating_sub(PATIENCE) as usize;
        let machine = (slot.machine + other) % plan.machines.len();
        let mut random = stream(seed, &names);
        let pace = [
            RATES[random.random_range(0..RATES.len())],
            motion::round(random.random_range(LENGTHS[0]..LENGTHS[1]), 1),
        ];
        let mut draw = Draw {
            pace,
            anatomy: &plan.machines[machine],
            slot: slot.clone(),
            random,
            lower: 0,
        };
        if other > 0 {
            draw.other_causes();
        }
        // A machine that falls, flies or slides away does so within its usual time, so its log
        // cannot be long.
        if draw.slot.fault == Some(LogFault::Long) && !draw.anatomy.is_tireless() {
            draw.slot.fault = Some(LogFault::Fast);
        }
        match draw.case(&mut left_out) {
            Ok(mut case) => {
                case.label.left_out = left_out;
                case.label.salt = hex(&digest(seed, &["salt", plan.half.name(), names[2]]));
                return Ok(case);
            }
            Err(LeftOut::Rule(reason)) => left_out.push(reason),
            Err(LeftOut::Fault(error)) => return Err(error),
        }
    }
    Err(Error::Exhausted {
        case: number,
        attempts: ATTEMPTS,
        reason: left_out.pop().unwrap_or_default(),
    })
}

/// One draw of a case.
struct Draw<'a> {
    anatomy: &'a Anatomy,
    slot: Slot,
    random: ChaCha8Rng,
    /// Number of levels below the planned one.
    lower: usize,
    /// Factors of the machine's row rate and of its episode length.
    pace: [f64; 2],
}

impl Draw<'_> {
    fn case(&mut self, left_out: &mut Vec<String>) -> Result<Case, LeftOut> {
        let anatomy = self.anatomy;
        let truth: Vec<f64> = anatomy
            .machine
            .parameters
            .iter()
            .map(|p| {
                let share = self.random.random_range(0.1..0.9);
                motion::round(p.range[0] + share * (p.range[1] - p.range[0]), 6)
            })
            .collect();
        let (timestep, integrator) = self.world_step();
        let motions = self.motions(self.usual());
        let bench = Bench::new(anatomy, &truth, &motions, timestep, integrator)?;
        // The rule that costs least to check comes first.
        let mut integration_gap = self.integration_gap(&bench)?;
        let dirt = if self.slot.dirty {
            dirt::draw(anatomy, &bench.typical, &mut self.random)
        } else {
            Vec::new()
        };
        let mut dirt = Background {
            gap: self.gap_of(&bench, &dirt)?,
            items: dirt,
        };
        let (mut causes, target) = self.sized_causes(&bench, &mut dirt, left_out)?;
        let (dirt, mut dirt_gap) = (dirt.items, dirt.gap);
        // If the case is to have little motion or many or fast rows, its logs have motions of their
        // own.
        let style = self.style();
        let usual = style == self.usual();
        let own = if usual {
            Vec::new()
        } else {
            self.motions(style)
        };
        let bench = if usual {
            bench
        } else {
            Bench::new(anatomy, &truth, &own, timestep, integrator)?
        };
        if !usual {
            // What the label says is measured on the motions of the logs.
            integration_gap = self.integration_gap(&bench)?;
            dirt_gap = self.gap_of(&bench, &dirt)?;
            for (name, items) in causes.by_name() {
                causes.own.insert(name, self.gap_of(&bench, &items)?);
            }
        }
        let mut world = self.world(&bench, &truth, &dirt, &causes, timestep)?;
        let mut watch = Watch::new(anatomy, bench.motions);
        let look = &mut |sim: &Sim, step| watch.look(sim, step);
        let record = watched(anatomy, &mut world, bench.motions, look)?;
        let steps = world.steps.clone();
        let readings = bench.rows(&record, &steps);
        let whole = bench.refit(&readings)?;
        let excess_gap = whole.excess;
        self.repeatable(&bench, &truth, &dirt, &causes, &readings, excess_gap)?;
        let dirt_labels = self.measure_dirt(&bench, &truth, &dirt)?;
        let log_style = self.log_style(&bench)?;
        let mut study = BTreeMap::new();
        study.insert("nominal.xml".to_owned(), anatomy.machine.model.to_owned());
        study.insert("study.toml".to_owned(), self.study_file());
        for (episode, motion) in bench.motions.iter().enumerate() {
            let name = match episode {
                e if e < TRAIN => format!("train_{e}.csv"),
                e => format!("test_{}.csv", e - TRAIN),
            };
            let random = &mut self.random;
            let text = log::text(
                anatomy,
                &record,
                &steps,
                (episode, motion),
                &log_style,
                random,
            );
            study.insert(name, text);
        }
        let mut label = self.label(&bench, &truth, &causes, &log_style);
        label.dirt = dirt_labels;
        label.dirt_gap = dirt_gap;
        label.target_gap = if causes.items.is_empty() { 0.0 } else { target };
        label.excess_gap = excess_gap;
        if excess_gap > SPEAKS {
            label.signals = whole.shares(anatomy).into_iter().collect();
            label.places = places(anatomy, &whole, &watch.regimes());
        }
        label.integration_gap = integration_gap;
        Ok(Case { study, label })
    }

    /// Time step and integrator of the world. The time step is always finer than the study's.
    ///
    /// rapier may move a body in free flight.
    fn world_step(&mut self) -> (f64, &'static str) {
        let finer = [2.0, 2.0, 4.0][self.random.random_range(0..3)];
        let integrators = ["implicitfast", "implicit", "Euler"];
        let mut integrator = integrators[self.random.random_range(0..3)];
        if self.anatomy.is_free_flight() && self.random.random::<f64>() < BY_RAPIER {
            integrator = RAPIER;
        }
        (self.anatomy.timestep / finer, integrator)
    }

    fn usual(&self) -> motion::Style {
        motion::Style {
            seconds: self.anatomy.machine.seconds * self.pace[1],
            rate: self.anatomy.machine.rate * self.pace[0],
            vigour: 1.0,
            rest: 0.0,
        }
    }

    fn style(&self) -> motion::Style {
        let mut style = self.usual();
        match self.slot.fault {
            Some(LogFault::Fast) => style.rate = FAST,
            Some(LogFault::Long) => {
                style.rate = FAST;
                style.seconds = LONG / FAST / (TRAIN + TEST) as f64;
            }
            Some(LogFault::Encoder) => style.rest = REST,
            _ => {}
        }
        if self.slot.little {
            style.vigour = LITTLE;
        }
        style
    }

    fn motions(&mut self, style: motion::Style) -> Vec<Motion> {
        (0..TRAIN + TEST)
            .map(|_| Motion::draw(self.anatomy, style, &mut self.random))
            .collect()
    }
}
