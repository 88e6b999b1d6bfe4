//! Losses of a drive at speed and from its supply.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Reference, Site, Start};
use asid_core::simulator::StepView;
use asid_core::{Capabilities, Result, Target};
use asid_mjcf::Plant;
use asid_mjcf::plant::ForceLimit;

use super::command::{UNLIMITED, limit_targets};
use super::drive::LimitedAt;
use super::{actuators, at_least, drives, values};

crate::register!(EffectEntry {
    name: "torque-speed-limit",
    about: "the largest force of a drive falls with its speed",
    make: || Box::new(SpeedLimit),
});

crate::register!(EffectEntry {
    name: "supply-drift",
    about: "the gain of a drive changes over time",
    make: || Box::new(Supply::Drift),
});

crate::register!(EffectEntry {
    name: "supply-trend",
    about: "the gain of a drive changes from episode to episode",
    make: || Box::new(Supply::Trend),
});

/// Largest speed limit of the search (rad/s or m/s): at this value the limit is off.
const FAST: f64 = 1000.0;

/// Holds the force on the joint, gear included, within `±force (1 - |v| / speed)`.
///
/// The limit is `force` at rest and zero at `speed`, where a motor's own voltage has reached its
/// supply's (A. Hughes, B. Drury, "Electric Motors and Drives", ch. 3). As for a saturation, the
/// force that the drive asks for at the start of a step decides ([`LimitedAt`]). Where the drive
/// accelerates the joint, the fall with speed acts as damping, which engines integrate implicitly.
struct SpeedLimit;

impl Effect for SpeedLimit {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["viscous-friction", "actuator-gain", "actuator-saturation"],
            told_apart_by: "coast down with the drive off; move as fast with a smaller force",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const {
            &[
                EffectParameter::new("force", "N or N m", [0.0, UNLIMITED], UNLIMITED)
                    .starting(Start::Multiples(Reference::Force, &[1.0, 0.7])),
                EffectParameter::new("speed", "rad/s or m/s", [0.01, FAST], FAST)
                    .starting(Start::Multiples(Reference::Speed, &[0.5, 1.0, 2.0])),
            ]
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        drives(plant)
    }

    fn targets(&self, plant: &Plant, site: &str) -> Vec<Target> {
        limit_targets(plant, site)
    }

    fn needs(&self) -> Capabilities {
        Capabilities::JOINT_IMPEDANCE | Capabilities::LIVE_PARAMETERS
    }

    fn force_limit(&self, values: &[f64]) -> Option<ForceLimit> {
        let [force, speed] = *values else {
            return None;
        };
        Some(ForceLimit { force, speed })
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [force, speed] = values(site)?;
        let own = ForceLimit {
            force: at_least(site, "force", force, 0.0)?,
            speed: at_least(site, "speed", speed, 1e-9)?,
        };
        Ok(Box::new(LimitedAt::of_site(site, own)?))
    }
}

/// A gain of the command that changes over time, at least 0.
///
/// An emptying battery has a negative rate; a drive that warms up has either sign.
///
/// - `Drift`: `(1 + rate t) u`, `t` restarts with each episode.
/// - `Trend`: `(1 + rate n) u`, `n` the number of the episode among all logs.
#[derive(Clone, Copy)]
enum Supply {
    Drift,
    Trend,
}

struct SupplyAt {
    actuator: usize,
    /// Gain at the beginning of the episode.
    first: f64,
    /// Growth per second.
    rate: f64,
}

impl Acting for SupplyAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let gain = (self.first + self.rate * view.time).max(0.0);
        view.ctrl[self.actuator] *= gain;
    }
}

impl Effect for Supply {
    fn mistaken_for(&self) -> &'static [Confusion] {
        match self {
            Self::Drift => &[Confusion {
                with: &["actuator-gain", "friction-drift", "sensor-drift"],
                told_apart_by: "repeat a motion after a rest, and with a fresh supply",
            }],
            Self::Trend => &[Confusion {
                with: &["actuator-gain", "friction-trend", "supply-drift"],
                told_apart_by: "repeat the first episode after the last, and with a fresh supply",
            }],
        }
    }

    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn counts_episodes(&self) -> bool {
        matches!(self, Self::Trend)
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        match self {
            Self::Drift => const { &[EffectParameter::new("rate", "1/s", [-1.0, 1.0], 0.0)] },
            Self::Trend => const { &[EffectParameter::new("rate", "1/episode", [-0.5, 0.5], 0.0)] },
        }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        actuators(plant)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [rate] = values(site)?;
        let (first, rate) = match self {
            Self::Drift => (1.0, rate),
            Self::Trend => (1.0 + rate * site.episode as f64, 0.0),
        };
        Ok(Box::new(SupplyAt {
            actuator: site.plant.layout.actuator(site.name)?,
            first,
            rate,
        }))
    }
}
