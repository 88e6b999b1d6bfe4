//! Faults of a log and of the wiring of its columns.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::anatomy::Anatomy;

/// A fault of the log itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogFault {
    /// Two of three readings are missing.
    Missing,
    /// The first sensor reads in quantisation steps without noise, and the machine rests at first.
    Encoder,
    /// The noise is strongly correlated from row to row.
    FilteredNoise,
    /// Rows are read at times that differ from their stamps.
    Jitter,
    /// A few readings are far off.
    Spikes,
    /// No row holds the initial state.
    NoStart,
    /// The log has 1000 rows per second.
    Fast,
    /// The log is long: all logs of the case have 100,000 rows together.
    Long,
}

impl LogFault {
    /// All faults of a log.
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
    /// A column is in degrees or in millimetres.
    Unit,
    /// A column is shifted by a constant.
    Offset,
    /// Readings lag behind commands.
    Clock,
}

impl WiringKind {
    /// All kinds of wiring faults.
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

/// The fault of all logs of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Fault {
    /// Nothing.
    Nothing,
    /// A fault of the logs themselves.
    Log(LogFault),
    /// A fault of their wiring.
    Wiring(WiringKind),
}

impl Fault {
    /// All faults, and `Nothing`.
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

    /// The fault of that name.
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

/// A wiring fault and its columns.
#[derive(Clone, Debug)]
pub struct Wiring {
    /// Name of the fault, for example `wiring-swapped`.
    pub fault: &'static str,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Factor, shift or delay in SI units; 0 if the fault has none.
    pub value: f64,
    /// Indices of the columns in a row of readings.
    at: Vec<usize>,
}

/// Range of the shift of a column, in standard deviations of its reading.
const SHIFT: [f64; 2] = [0.5, 1.5];
/// Range of the delay of readings against commands, s.
const CLOCK: [f64; 2] = [0.03, 0.12];

impl Wiring {
    /// Draws a fault of a kind; `None` if the machine has no columns for it.
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

    /// Delay of the readings, s.
    #[must_use]
    pub fn clock(&self) -> f64 {
        if self.fault == WiringKind::Clock.name() {
            self.value
        } else {
            0.0
        }
    }

    /// Applies the fault to the columns' names and readings.
    pub fn apply(&self, _commands: &mut [String], sensors: &mut [String], rows: &mut [Vec<f64>]) {
        match (self.fault, &self.at[..]) {
            ("wiring-swapped", &[a, b]) => sensors.swap(a, b),
            ("wiring-offset", &[at]) => rows.iter_mut().for_each(|r| r[at] += self.value),
            (_, &[at]) => rows.iter_mut().for_each(|r| r[at] *= self.value),
            _ => {}
        }
    }
}
