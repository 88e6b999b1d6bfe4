//! Faults of a log, and of the wiring of its columns.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::anatomy::Anatomy;

/// A fault of the log itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogFault {
    /// Two of three readings are missing.
    Missing,
    /// The first sensor reads in steps and without noise, and the machine rests at first.
    Encoder,
    /// The noise is strongly correlated from row to row.
    FilteredNoise,
    /// Rows are read at other times than their stamps say.
    Jitter,
    /// A few readings are far off.
    Spikes,
    /// No row holds the state.
    NoStart,
    /// A thousand rows a second.
    Fast,
    /// A hundred thousand rows.
    Long,
}

impl LogFault {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Missing,
        Self::Encoder,
        Self::FilteredNoise,
        Self::Jitter,
        Self::Spikes,
        Self::NoStart,
        Self::Fast,
        Self::Long,
    ];

    /// Name in the label.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing-readings",
            Self::Encoder => "encoder-at-rest",
            Self::FilteredNoise => "filtered-noise",
            Self::Jitter => "jittered-stamps",
            Self::Spikes => "spikes",
            Self::NoStart => "no-start",
            Self::Fast => "fast-rows",
            Self::Long => "many-rows",
        }
    }
}

/// Kinds of wiring faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WiringKind {
    /// Two columns are swapped.
    Swapped,
    /// A column has the wrong sign.
    Sign,
    /// A column is in degrees, or in millimetres.
    Unit,
    /// A column is shifted.
    Offset,
    /// Readings are late against commands.
    Clock,
}

impl WiringKind {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Swapped,
        Self::Sign,
        Self::Unit,
        Self::Offset,
        Self::Clock,
    ];

    /// Name in the label.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Swapped => "wiring-swapped",
            Self::Sign => "wiring-sign",
            Self::Unit => "wiring-unit",
            Self::Offset => "wiring-offset",
            Self::Clock => "wiring-clock",
        }
    }
}

/// What is wrong with the logs of a whole set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Fault {
    /// Nothing.
    Nothing,
    /// The logs themselves.
    Log(LogFault),
    /// Their wiring.
    Wiring(WiringKind),
}

impl Fault {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        let logs = LogFault::ALL.into_iter().map(Self::Log);
        let wiring = WiringKind::ALL.into_iter().map(Self::Wiring);
        std::iter::once(Self::Nothing).chain(logs).chain(wiring)
    }

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "none",
            Self::Log(fault) => fault.name(),
            Self::Wiring(kind) => kind.name(),
        }
    }

    /// The fault of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|fault| fault.name() == name)
    }
}

impl TryFrom<String> for Fault {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::named(&name).ok_or_else(|| format!("there is no fault `{name}`"))
    }
}

impl From<Fault> for String {
    fn from(fault: Fault) -> Self {
        fault.name().to_owned()
    }
}

/// A wiring fault at its columns.
#[derive(Clone, Debug)]
pub struct Wiring {
    /// `wiring-swapped` and so on.
    pub fault: &'static str,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Factor, shift or delay in SI units; 0 where there is none.
    pub value: f64,
    /// Places of the columns in a row of readings.
    at: Vec<usize>,
}

/// Shift of a column, in spreads of its reading.
const SHIFT: [f64; 2] = [0.5, 1.5];
/// Delay of readings against commands, s.
const CLOCK: [f64; 2] = [0.03, 0.12];

impl Wiring {
    /// Draws a fault of a kind; `None` where the machine has no columns for it.
    pub fn draw(
        kind: WiringKind,
        anatomy: &Anatomy,
        spread: &[f64],
        random: &mut impl Rng,
    ) -> Option<Self> {
        let all = anatomy.sensors.iter();
        let scalars: Vec<_> = all.filter(|s| s.len == 1).collect();
        let pick = |random: &mut _| {
            let n = scalars.len();
            (n > 0).then(|| scalars[Rng::random_range(random, 0..n)])
        };
        let fault = kind.name();
        let one = |sensor: &crate::anatomy::Sensor, value| Self {
            fault,
            columns: vec![sensor.name.clone()],
            value,
            at: vec![sensor.address],
        };
        Some(match kind {
            WiringKind::Sign => one(pick(random)?, -1.0),
            WiringKind::Unit => {
                let sensor = pick(random)?;
                let slide = anatomy.document.find(&sensor.kind, Some(&sensor.name));
                let slide = slide.and_then(|e| e.get("joint")).is_some_and(|joint| {
                    let mut joints = anatomy.joints.iter();
                    joints.any(|j| j.name == joint && j.kind == crate::anatomy::JointKind::Slide)
                });
                let factor = if slide {
                    1000.0
                } else {
                    180.0 / std::f64::consts::PI
                };
                one(sensor, factor)
            }
            WiringKind::Offset => {
                let sensor = pick(random)?;
                let shift = random.random_range(SHIFT[0]..SHIFT[1]) * spread[sensor.address];
                one(sensor, shift)
            }
            WiringKind::Swapped => {
                let a = pick(random)?;
                let others: Vec<_> = scalars
                    .iter()
                    .filter(|s| s.name != a.name && s.kind == a.kind)
                    .collect();
                let b = others.get(random.random_range(0..others.len().max(1)))?;
                Self {
                    fault,
                    columns: vec![a.name.clone(), b.name.clone()],
                    value: 0.0,
                    at: vec![a.address, b.address],
                }
            }
            WiringKind::Clock => {
                if anatomy.drives.is_empty() {
                    return None;
                }
                Self {
                    fault,
                    columns: anatomy.sensors.iter().map(|s| s.name.clone()).collect(),
                    value: random.random_range(CLOCK[0]..CLOCK[1]),
                    at: Vec::new(),
                }
            }
        })
    }

    /// How late readings are, s.
    #[must_use]
    pub fn clock(&self) -> f64 {
        if self.fault == WiringKind::Clock.name() {
            self.value
        } else {
            0.0
        }
    }

    /// Does to the readings what the fault does.
    pub fn apply(&self, _commands: &mut [String], sensors: &mut [String], rows: &mut [Vec<f64>]) {
        match (self.fault, &self.at[..]) {
            ("wiring-swapped", &[a, b]) => sensors.swap(a, b),
            ("wiring-offset", &[at]) => rows.iter_mut().for_each(|r| r[at] += self.value),
            (_, &[at]) => rows.iter_mut().for_each(|r| r[at] *= self.value),
            _ => {}
        }
    }
}
