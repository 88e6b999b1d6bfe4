//! The plan of a set: what each case is to be, with quotas, drawn by the seed.
//!
//! Cases come in wheels of forty. In each wheel half of the worlds are dirty, eleven are clean and
//! without a cause, and five have a cause of no catalogue. Seven logs have a fault, three are wired
//! wrongly, and in two the machine hardly moves. Of the causes that a machine can have, the least
//! used one comes next. A set of 600 thus has each cause, at each gap, about as often as its
//! machines allow.

mod kind;
mod wanted;

use std::collections::BTreeMap;

use rand::Rng;
use rand::seq::{IndexedRandom, SliceRandom};
use rand_chacha::ChaCha8Rng;

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Standing, is_transmission};
use crate::causes;
use crate::error::{Error, Result};
use crate::faults::{LogFault, WiringKind};
use crate::machine::{Half, Machine};
use crate::machines;
use crate::random::{digest, stream};

pub use kind::Kind;
pub use wanted::Wanted;

/// Excess gaps of causes in clean worlds, in noise floors.
pub const GAPS: [f64; 4] = [1.5, 3.0, 10.0, 100.0];
/// Factors of the gap of the dirt that causes reach in dirty worlds.
pub const FACTORS: [f64; 3] = [2.0, 5.0, 20.0];

/// Cases of a wheel: kind, whether dirty, and how many.
const WHEEL: [(Kind, bool, usize); 10] = [
    (Kind::None, false, 11),
    (Kind::Single, false, 5),
    (Kind::Several, false, 1),
    (Kind::Group, false, 1),
    (Kind::Unknown, false, 2),
    (Kind::None, true, 4),
    (Kind::Single, true, 8),
    (Kind::Several, true, 3),
    (Kind::Group, true, 2),
    (Kind::Unknown, true, 3),
];
/// Number of logs of a wheel with a fault.
const FAULTS: usize = 7;
/// Number of logs of a wheel with wrong wiring.
const WIRINGS: usize = 3;
/// Number of logs of a wheel with too little excitation.
const LITTLE: usize = 2;
/// Share of pairs and triples that have viscous and dry friction of one joint.
const COMMONEST: f64 = 0.5;
/// Share of pairs and triples that are triples.
const TRIPLES: f64 = 0.3;
/// Consecutive wheels without a wanted case after which the search stops.
///
/// The rarest kind has one case per wheel, and a half has about twenty machines. Within so many
/// wheels each machine has had that kind several times.
const BARREN: usize = 100;

/// Describes what a case is to be.
#[derive(Clone)]
pub struct Slot {
    /// Machine, as an index of [`Plan::machines`].
    pub machine: usize,
    /// Kind of its causes.
    pub kind: Kind,
    /// Its causes.
    pub causes: Vec<&'static dyn Cause>,
    /// Whether all causes act at the same joint.
    pub same_joint: bool,
    /// Whether the world is dirty: everything deviates a little.
    pub dirty: bool,
    /// Index into [`GAPS`] or [`FACTORS`].
    pub level: usize,
    /// A fault of the log.
    pub fault: Option<LogFault>,
    /// A fault of wiring.
    pub wiring: Option<WiringKind>,
    /// Whether the machine hardly moves.
    pub little: bool,
}

/// All cases of a set.
pub struct Plan {
    /// Half.
    pub half: Half,
    /// Machines, with the parts of their models.
    pub machines: Vec<Anatomy>,
    /// Cases.
    pub slots: Vec<Slot>,
}

/// How often each cause was used.
#[derive(Default)]
struct Used(BTreeMap<&'static str, usize>);

impl Used {
    /// The least used cause, with its number of uses; drawn at random among equals.
    fn next(
        &mut self,
        of: &[&'static dyn Cause],
        random: &mut ChaCha8Rng,
    ) -> Option<(&'static dyn Cause, usize)> {
        let count = |c: &&'static dyn Cause| self.0.get(c.name()).copied().unwrap_or(0);
        let least = of.iter().map(count).min()?;
        let rare: Vec<_> = of.iter().filter(|c| count(c) == least).collect();
        let one = **rare.choose(random)?;
        *self.0.entry(one.name()).or_default() += 1;
        Some((one, least))
    }
}

/// Causes that act on a machine.
#[must_use]
pub fn possible(machine: &Anatomy, standing: impl Fn(Standing) -> bool) -> Vec<&'static dyn Cause> {
    let all = causes::ALL.iter().copied();
    all.filter(|c| standing(c.standing()) && !c.sites(machine).is_empty())
        .collect()
}

impl Plan {
    /// Draws a plan for the machines of a half and the machines `outside`.
    ///
    /// # Errors
    /// If a machine's model is wrong.
    pub fn draw(half: Half, seed: u64, count: usize, outside: &[&'static Machine]) -> Result<Self> {
        Self::draw_wanted(half, (seed, count), outside, &Wanted::default())
    }

    /// Draws a plan of the wanted cases only.
    ///
    /// # Errors
    /// If a machine's model is wrong, or if no machine of the half has such a case.
    pub fn draw_wanted(
        half: Half,
        (seed, count): (u64, usize),
        outside: &[&'static Machine],
        wanted: &Wanted,
    ) -> Result<Self> {
        wanted.check()?;
        let all = machines::of(half).chain(outside.iter().copied());
        let machines: Vec<Anatomy> = all.map(Anatomy::of).collect::<Result<_>>()?;
        let mut dealer = Dealer::new(half, seed, &machines, wanted);
        let mut slots = Vec::with_capacity(count);
        let mut barren = 0;
        while slots.len() < count {
            let before = slots.len();
            let wheel = dealer.wheel();
            slots.extend(wheel.into_iter().filter(|s| wanted.takes(s)));
            barren = if slots.len() > before { 0 } else { barren + 1 };
            if barren == BARREN {
                let message = format!("no machine of the {} half has such a case", half.name());
                return Err(Error::Wanted { message });
            }
        }
        slots.truncate(count);
        slots.iter_mut().for_each(|slot| wanted.spoil(slot));
        Ok(Self {
            half,
            machines,
            slots,
        })
    }
}

/// Deals wheels of cases one after the other.
struct Dealer<'a> {
    machines: &'a [Anatomy],
    wanted: &'a Wanted,
    random: ChaCha8Rng,
    used: Used,
    order: Vec<usize>,
    faults: Vec<LogFault>,
    wirings: Vec<WiringKind>,
}

impl<'a> Dealer<'a> {
    fn new(half: Half, seed: u64, machines: &'a [Anatomy], wanted: &'a Wanted) -> Self {
        Self {
            machines,
            wanted,
            random: stream(seed, &["plan", half.name()]),
            used: Used::default(),
            order: Vec::new(),
            faults: Vec::new(),
            wirings: Vec::new(),
        }
    }

    /// The cases of a wheel.
    fn wheel(&mut self) -> Vec<Slot> {
        let random = &mut self.random;
        let mut wheel: Vec<(Kind, bool)> = WHEEL
            .iter()
            .flat_map(|&(kind, dirty, n)| std::iter::repeat_n((kind, dirty), n))
            .collect();
        wheel.shuffle(random);
        let mut odd: Vec<usize> = (0..wheel.len()).collect();
        odd.shuffle(random);
        let machines: Vec<usize> = (0..self.machines.len()).collect();
        let mut slots = Vec::with_capacity(wheel.len());
        for (i, (kind, dirty)) in wheel.into_iter().enumerate() {
            let machine = deal(&mut self.order, &machines, random);
            let place = odd.iter().position(|&o| o == i).unwrap_or(0);
            let within = |from: usize, n: usize| (from..from + n).contains(&place);
            let fault = within(0, FAULTS);
            let wiring = within(FAULTS, WIRINGS);
            let mut slot = Slot {
                machine,
                kind,
                causes: Vec::new(),
                same_joint: false,
                dirty,
                level: random.random_range(0..12),
                fault: fault.then(|| deal(&mut self.faults, &LogFault::ALL, random)),
                wiring: wiring.then(|| deal(&mut self.wirings, &WiringKind::ALL, random)),
                little: within(FAULTS + WIRINGS, LITTLE),
            };
            slot.choose(
                &self.machines[machine],
                (&mut self.used, self.wanted),
                random,
            );
            slots.push(slot);
        }
        slots
    }
}

/// Deals the next item of a random order; draws a new order after all items were dealt.
fn deal<T: Copy>(left: &mut Vec<T>, all: &[T], random: &mut ChaCha8Rng) -> T {
    if left.is_empty() {
        left.extend_from_slice(all);
        left.shuffle(random);
    }
    left.pop().unwrap_or(all[0])
}

impl Slot {
    fn choose(
        &mut self,
        machine: &Anatomy,
        (used, wanted): (&mut Used, &Wanted),
        random: &mut ChaCha8Rng,
    ) {
        let mut known = possible(machine, |s| s != Standing::Unknown);
        if self.kind != Kind::Several {
            known.retain(|c| wanted.takes_cause(c.name()));
        }
        match self.kind {
            Kind::None => {}
            Kind::Single => {
                if let Some((cause, times)) = used.next(&known, random) {
                    self.causes.push(cause);
                    // Successive uses of a cause go through the levels. Each cause begins at a
                    // level of its own.
                    self.level = times + usize::from(digest(0, &[cause.name()])[0]);
                }
            }
            Kind::Unknown => {
                let mut unknown = possible(machine, |s| s == Standing::Unknown);
                unknown.retain(|c| wanted.takes_cause(c.name()));
                let next = used.next(&unknown, random);
                self.causes.extend(next.map(|(c, _)| c));
            }
            Kind::Group => {
                let several = known.iter().filter(|c| c.sites(machine).len() > 1);
                let several: Vec<_> = several.copied().collect();
                match several.choose(random) {
                    Some(cause) => self.causes.push(*cause),
                    None => self.kind = Kind::Single,
                }
                if self.kind == Kind::Single {
                    self.causes.extend(known.choose(random));
                }
            }
            Kind::Several => self.choose_several(machine, &known, random),
        }
        if self.causes.is_empty() && self.kind != Kind::None {
            self.kind = Kind::None;
        }
    }

    fn choose_several(
        &mut self,
        machine: &Anatomy,
        known: &[&'static dyn Cause],
        random: &mut ChaCha8Rng,
    ) {
        let count = if random.random::<f64>() < TRIPLES {
            3
        } else {
            2
        };
        let friction = ["viscous-friction", "coulomb-friction"];
        let has_joints = !crate::cause::scalar_joints(machine).is_empty();
        if has_joints && random.random::<f64>() < COMMONEST {
            let frictions = known.iter().filter(|c| friction.contains(&c.name()));
            self.causes.extend(frictions);
            self.same_joint = true;
        }
        let mut others: Vec<_> = known
            .iter()
            .filter(|c| !self.causes.iter().any(|d| d.name() == c.name()))
            .copied()
            .collect();
        others.shuffle(random);
        for cause in others {
            // Two transmissions exclude each other.
            let clash = is_transmission(cause) && self.causes.iter().copied().any(is_transmission);
            if self.causes.len() < count && !clash {
                self.causes.push(cause);
            }
        }
    }

    /// Excess gap or factor for which the causes are sized, `lower` levels below the planned one.
    #[must_use]
    pub fn aim(&self, lower: usize) -> f64 {
        let levels: &[f64] = if self.dirty { &FACTORS } else { &GAPS };
        levels[(self.level % levels.len()).saturating_sub(lower)]
    }
}
