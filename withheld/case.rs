//! One case: a world, its logs and its label.

use std::collections::BTreeMap;

use rand::Rng;
use rand::seq::IndexedRandom;
use rand_chacha::ChaCha8Rng;

use crate::anatomy::Anatomy;
use crate::cause::{Place, Standing};
use crate::dirt::{self, Item};
use crate::error::{Error, Result};
use crate::faults::{LogFault, Wiring};
use crate::gap::Bench;
use crate::label::{Dirt, Label, WiringLabel};
use crate::log;
use crate::motion::{self, Motion};
use crate::plan::{Kind, Plan, Slot, possible};
use crate::random::{digest, stream};
use crate::seal::hex;
use crate::simulate::simulate;
use crate::size::solve;
use crate::world::World;

/// Logs to fit to and logs held out.
const TRAIN: usize = 6;
const TEST: usize = 3;
/// Draws of a case before it is given up, and causes that are tried in one.
const ATTEMPTS: u32 = 12;
const TRIES: u32 = 10;
/// A case is left out where the study's time step alone makes a gap of more than this, in noise floors:
/// its motion is chaotic, or its model too coarse.
const INTEGRATION: f64 = 0.5;
/// A case is left out where half the world's time step changes its readings by more than this, in noise floors,
/// or by more than this share of its excess gap: nobody could repeat it.
const REPEATABLE: [f64; 2] = [0.5, 0.05];
/// Amplitudes of a machine that hardly moves, as a share of the usual.
const LITTLE: f64 = 0.04;
/// Gap of dirt below which causes stand out of this instead, in noise floors: the least factor then gives the
/// least gap of clean worlds.
const LEAST_DIRT: f64 = 0.75;
/// Share of cases whose study gives the noise, and of those whose logs do not give their start.
const NOISE_GIVEN: f64 = 0.25;
const NO_START: f64 = 0.2;
/// Rest before the motion of a log whose encoder rests.
const REST: f64 = 0.3;
/// Episodes in which an item of dirt is measured, and those in which a world is run again at half its time step.
const SAMPLE: usize = 2;
const CHECKED: usize = 3;
/// Rows a second of a fast log, and rows of a long one.
const FAST: f64 = 1000.0;
const LONG: f64 = 100_000.0;

/// A case, ready to be written.
pub struct Case {
    /// Files of the study by name.
    pub study: BTreeMap<String, String>,
    /// Its label.
    pub label: Label,
}

/// Why a draw was left out.
enum LeftOut {
    /// By a stated rule.
    Rule(String),
    /// The generator is wrong.
    Fault(Error),
}

impl From<Error> for LeftOut {
    fn from(error: Error) -> Self {
        match error {
            Error::Diverged { .. } => Self::Rule(error.to_string()),
            other => Self::Fault(other),
        }
    }
}

/// Makes a case of a plan.
///
/// # Errors
/// Where a model is wrong, or no draw was usable.
pub fn make(plan: &Plan, seed: u64, number: usize) -> Result<Case> {
    let mut left_out: Vec<String> = Vec::new();
    for attempt in 0..ATTEMPTS {
        let names = [
            "case",
            plan.half.name(),
            &number.to_string(),
            &attempt.to_string(),
        ];
        let mut draw = Draw {
            anatomy: &plan.machines[plan.slots[number].machine],
            slot: plan.slots[number].clone(),
            random: stream(seed, &names),
            lower: 0,
        };
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
    /// Levels below the planned one.
    lower: usize,
}

/// The causes of a case, sized.
#[derive(Default)]
struct Causes {
    items: Vec<Item>,
    own: BTreeMap<String, f64>,
}

impl Draw<'_> {
    /// Draws other causes of the same kind.
    fn other_causes(&mut self) {
        let unknown = self.slot.kind == Kind::Unknown;
        let all = possible(self.anatomy, |s| (s == Standing::Unknown) == unknown);
        let count = self.slot.causes.len().min(2);
        let group = self.slot.kind == Kind::Group;
        let usable: Vec<_> = all
            .into_iter()
            .filter(|c| !group || c.sites(self.anatomy).len() > 1)
            .collect();
        self.slot.same_joint = false;
        self.slot.causes = usable
            .choose_multiple(&mut self.random, count)
            .copied()
            .collect();
    }

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
        // The cheap rule first.
        let mut integration_gap = self.integration_gap(&bench)?;
        let dirt = if self.slot.dirty {
            dirt::draw(anatomy, &bench.typical, &mut self.random)
        } else {
            Vec::new()
        };
        let dirt_gap = self.gap_of(&bench, &dirt)?;
        let (causes, target) = self.sized_causes(&bench, dirt_gap, left_out)?;
        // The motions of the logs are other ones where the case is to have few, many or fast rows.
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
            integration_gap = self.integration_gap(&bench)?;
        }
        let mut world = self.world(&bench, &truth, &dirt, &causes, timestep)?;
        let record = simulate(anatomy, &mut world, bench.motions)?;
        let steps = world.steps.clone();
        let readings = bench.rows(&record, &steps);
        let excess_gap = bench.refit(&readings)?.excess;
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
        label.integration_gap = integration_gap;
        Ok(Case { study, label })
    }

    /// Time step and integrator of the world: never those of the study together.
    fn world_step(&mut self) -> (f64, &'static str) {
        let finer = [2.0, 2.0, 4.0][self.random.random_range(0..3)];
        let integrators = ["implicitfast", "implicit", "Euler"];
        (
            self.anatomy.timestep / finer,
            integrators[self.random.random_range(0..3)],
        )
    }

    fn usual(&self) -> motion::Style {
        motion::Style {
            seconds: self.anatomy.machine.seconds,
            rate: self.anatomy.machine.rate,
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
                let most = LONG / FAST / (TRAIN + TEST) as f64;
                // A machine that falls off its table after its usual time would do so here.
                style.seconds = if self.anatomy.machine.contacts.is_empty() {
                    most
                } else {
                    style.seconds
                };
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

    /// A world with some items.
    fn with(&self, bench: &Bench<'_>, items: &[Item]) -> Result<World> {
        let mut world = bench.world(&bench.truth)?;
        for item in items {
            item.act(self.anatomy, &bench.typical, &mut world);
        }
        Ok(world)
    }

    fn gap_of(&self, bench: &Bench<'_>, items: &[Item]) -> Result<f64> {
        if items.is_empty() {
            return Ok(0.0);
        }
        let readings = bench.run(&mut self.with(bench, items)?)?;
        Ok(bench.refit(&readings)?.excess)
    }

    /// Causes of the planned size; else at another site, of a smaller size, or other causes.
    fn sized_causes(
        &mut self,
        bench: &Bench<'_>,
        dirt_gap: f64,
        left_out: &mut Vec<String>,
    ) -> Result<(Causes, f64), LeftOut> {
        let mut last = String::new();
        for attempt in 0..TRIES {
            match attempt {
                0 | 1 => {}
                2 | 3 => self.lower += 1,
                _ => {
                    self.lower = 0;
                    self.other_causes();
                }
            }
            let aim = self.slot.aim(self.lower);
            let target = if self.slot.dirty {
                aim * dirt_gap.max(LEAST_DIRT)
            } else {
                aim
            };
            match self.size(bench, target) {
                Err(LeftOut::Rule(reason)) => last = reason,
                other => return other.map(|causes| (causes, target)),
            }
            left_out.push(last.clone());
        }
        Err(LeftOut::Rule(last))
    }

    /// Draws sites and finds the sizes that give each cause alone its share of the target.
    fn size(&mut self, bench: &Bench<'_>, target: f64) -> Result<Causes, LeftOut> {
        let mut found = Causes::default();
        let slot = self.slot.clone();
        let share = target / (slot.causes.len().max(1) as f64).sqrt();
        let joints = crate::cause::scalar_joints(self.anatomy);
        let joint = joints.choose(&mut self.random).cloned();
        for cause in slot.causes {
            let all = cause.sites(self.anatomy);
            let mut sites: Vec<String> = match slot.kind {
                Kind::Group => all,
                _ => all.choose(&mut self.random).cloned().into_iter().collect(),
            };
            if let Some(joint) = joint
                .clone()
                .filter(|j| slot.same_joint && cause.sites(self.anatomy).contains(j))
            {
                sites = vec![joint];
            }
            let draw: [f64; 4] = std::array::from_fn(|_| self.random.random());
            let items = |fraction: f64| -> Vec<Item> {
                let item = |site: &String| {
                    let place = Place {
                        machine: self.anatomy,
                        typical: &bench.typical,
                        site,
                        draw,
                    };
                    Item {
                        cause,
                        site: site.clone(),
                        size: fraction * cause.largest(&place),
                        draw,
                    }
                };
                sites.iter().map(item).collect()
            };
            let make = |fraction: f64| self.with(bench, &items(fraction));
            let name = dirt::label(cause, sites.first().map_or("", |s| s));
            let Some(sized) = solve(bench, share, &make)? else {
                let reason = format!("{name} cannot give an excess gap of {share:.3}");
                return Err(LeftOut::Rule(reason));
            };
            found.own.insert(name, sized.excess);
            found.items.extend(items(sized.share));
        }
        Ok(found)
    }

    /// The world with everything in it. Causes come after dirt.
    fn world(
        &self,
        bench: &Bench<'_>,
        truth: &[f64],
        dirt: &[Item],
        causes: &Causes,
        timestep: f64,
    ) -> Result<World> {
        let mut world = World::new(self.anatomy, truth, timestep, bench.integrator)?;
        let (between, others): (Vec<&Item>, Vec<&Item>) = dirt
            .iter()
            .chain(&causes.items)
            .partition(|i| matches!(i.cause.name(), "backlash" | "joint-compliance"));
        // One transmission a joint: a cause's rather than dirt's.
        let mut joints: Vec<&str> = Vec::new();
        for item in others.into_iter().chain(between.into_iter().rev()) {
            if matches!(item.cause.name(), "backlash" | "joint-compliance") {
                if joints.contains(&item.site.as_str()) {
                    continue;
                }
                joints.push(&item.site);
            }
            item.act(self.anatomy, &bench.typical, &mut world);
        }
        Ok(world)
    }

    /// Gap that the study's own time step and integrator make, without a cause.
    fn integration_gap(&self, bench: &Bench<'_>) -> Result<f64, LeftOut> {
        let option = self.anatomy.document.find("option", None);
        let integrator = option.and_then(|o| o.get("integrator")).unwrap_or("Euler");
        let step = self.anatomy.timestep;
        let mut study = World::new(self.anatomy, &bench.truth, step, integrator)?;
        let gap = bench.distance(&bench.run(&mut study)?, &bench.clean);
        if gap > INTEGRATION {
            return Err(LeftOut::Rule(format!(
                "the study's time step alone makes a gap of {gap:.2}"
            )));
        }
        Ok(gap)
    }

    /// Leaves out what half the time step changes.
    fn repeatable(
        &self,
        bench: &Bench<'_>,
        truth: &[f64],
        dirt: &[Item],
        causes: &Causes,
        readings: &[f64],
        excess: f64,
    ) -> Result<(), LeftOut> {
        let mut finer = self.world(bench, truth, dirt, causes, bench.timestep / 2.0)?;
        let some = &bench.motions[..CHECKED];
        let record = simulate(self.anatomy, &mut finer, some)?;
        let changed = bench.rows(&record, &finer.steps);
        let change = bench.distance(&changed, &readings[..changed.len()]);
        if change > REPEATABLE[0].max(REPEATABLE[1] * excess) {
            return Err(LeftOut::Rule(format!(
                "half the time step changes the readings by {change:.2}"
            )));
        }
        Ok(())
    }

    /// Each item of dirt with its own excess gap, measured in the first episodes.
    fn measure_dirt(&self, bench: &Bench<'_>, truth: &[f64], dirt: &[Item]) -> Result<Vec<Dirt>> {
        if dirt.is_empty() {
            return Ok(Vec::new());
        }
        let some = &bench.motions[..SAMPLE];
        let small = Bench::new(self.anatomy, truth, some, bench.timestep, bench.integrator)?;
        dirt.iter()
            .map(|item| {
                let mut world = small.world(truth)?;
                let values = item.act(self.anatomy, &bench.typical, &mut world);
                Ok(Dirt {
                    effect: item.cause.name().to_owned(),
                    site: item.site.clone(),
                    parameters: values.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect(),
                    excess_gap: small.excess(&small.run(&mut world)?),
                })
            })
            .collect()
    }

    fn log_style(&mut self, bench: &Bench<'_>) -> Result<log::Style, LeftOut> {
        let wiring = match self.slot.wiring {
            None => None,
            Some(kind) => {
                let spread = &bench.typical.spread;
                let drawn = Wiring::draw(kind, self.anatomy, spread, &mut self.random);
                if drawn.is_none() {
                    // Another fault of wiring, where the machine has columns for one.
                    self.slot.wiring = Some(crate::faults::WiringKind::Sign);
                }
                drawn.or_else(|| {
                    let sign = crate::faults::WiringKind::Sign;
                    Wiring::draw(sign, self.anatomy, spread, &mut self.random)
                })
            }
        };
        let random = &mut self.random;
        let dirty = self.slot.dirty;
        let colour = if dirty {
            random.random_range(0.3..0.8)
        } else {
            0.0
        };
        let jitter = if dirty {
            random.random_range(0.01..0.04)
        } else {
            0.0
        };
        let starts = random.random::<f64>() >= NO_START;
        Ok(log::Style {
            colour,
            jitter,
            starts: starts && self.slot.fault != Some(LogFault::NoStart),
            fault: self.slot.fault,
            wiring,
        })
    }

    fn study_file(&mut self) -> String {
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
                text += &format!("{name} = {noise}\n");
            }
        }
        text
    }

    fn label(
        &self,
        bench: &Bench<'_>,
        truth: &[f64],
        causes: &Causes,
        style: &log::Style,
    ) -> Label {
        let machine = &self.anatomy.machine;
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
            wiring: style
                .wiring
                .iter()
                .map(|w| WiringLabel {
                    fault: w.fault.to_owned(),
                    columns: w.columns.clone(),
                    value: w.value,
                })
                .collect(),
            log_faults: self
                .slot
                .fault
                .iter()
                .map(|f| f.name().to_owned())
                .collect(),
            little_excitation: self.slot.little,
            starts: style.starts,
            timestep: bench.timestep,
            integrator: bench.integrator.to_owned(),
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
            // Where the machine hardly moves, nothing may be there to be seen.
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
