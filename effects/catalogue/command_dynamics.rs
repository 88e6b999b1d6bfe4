//! Commands that arrive late: a pure delay, and a first-order lag.
//!
//! Commands are constant between the steps, and a drive answers to their mean over a step. Both
//! effects therefore act continuously in time, not in whole steps. Before the first step the
//! command is taken as constant.

use std::collections::VecDeque;

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Native, Reference, Site};
use asid_core::Result;
use asid_core::simulator::StepView;
use asid_mjcf::Plant;
use asid_mjcf::native::NativeModel;

use super::{actuators, at_least, values};

crate::register!(EffectEntry {
    name: "actuator-delay",
    about: "the command arrives later",
    make: || Box::new(Delay),
});

crate::register!(EffectEntry {
    name: LAG,
    about: "the drive follows its command with a first-order lag",
    make: || Box::new(Lag),
});

/// Name of the effect of a drive's lag.
pub const LAG: &str = "actuator-lag";

/// Three standard deviations of the delay of an ordinary machine, s.
///
/// No model has this delay, but every bus and controller does: a few cycles of a loop of 1 kHz.
const DELAY_TOLERANCE: f64 = 4.5e-3;

/// Longest delay of the search, s.
const LONGEST: f64 = 0.5;

/// `c(t) = u(t - delay)`.
///
/// With a delay of `n + f` steps the mean over a step is `(1 - f) u[n] + f u[n + 1]`, where `u[n]`
/// is the command `n` steps ago.
struct Delay;

struct DelayAt {
    actuator: usize,
    /// Delay in whole steps, and the remaining fraction of one.
    whole: usize,
    part: f64,
    /// Commands, the newest first.
    past: VecDeque<f64>,
    /// Number of commands to keep, the same for all delays up to the longest.
    kept: usize,
}

impl Acting for DelayAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let command = &mut view.ctrl[self.actuator];
        self.past.truncate(self.kept - 1);
        self.past.push_front(*command);
        let last = self.past.len() - 1;
        let back = |steps: usize| self.past[steps.min(last)];
        *command = (1.0 - self.part) * back(self.whole) + self.part * back(self.whole + 1);
    }

    fn restart(&mut self) {
        self.past.clear();
    }

    fn save(&self, memory: &mut Vec<f64>) {
        memory.extend(&self.past);
    }

    fn load(&mut self, memory: &[f64]) {
        self.past.clear();
        self.past.extend(memory.iter().take(self.kept));
    }
}

impl Effect for Delay {
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["actuator-lag", "sensor-filter"],
            told_apart_by: "a chirp tells more: a delay keeps the gain, a lag loses it",
        }]
    }

    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const { &[EffectParameter::new("delay", "s", [0.0, LONGEST], 0.0)] }
    }

    fn tolerance(&self, _: &Plant, _: &str, _: &dyn Fn(Reference) -> f64) -> Vec<[f64; 2]> {
        vec![[0.0, DELAY_TOLERANCE]]
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        actuators(plant)
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [delay] = values(site)?;
        document.actuator(site.name)?.delay += delay;
        Ok(Native::Nearly(
            "begins with a history of zero commands in other programs; mj_initCtrlHistory sets it"
                .into(),
        ))
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [delay] = values(site)?;
        let delay = at_least(site, "delay", delay, 0.0)?;
        let timestep = site.plant.layout.timestep;
        let steps = delay / timestep;
        let kept = (delay.max(LONGEST) / timestep).ceil() as usize + 2;
        Ok(Box::new(DelayAt {
            actuator: site.plant.layout.actuator(site.name)?,
            whole: steps.floor() as usize,
            part: steps.fract(),
            past: VecDeque::with_capacity(kept),
            kept,
        }))
    }
}

/// `T dy/dt = u - y`, solved exactly for a command that is constant over the step.
///
/// With `x = dt / T`, `y` ends at `u + (y - u) e^-x` and has the mean `u + (y - u) (1 - e^-x) / x`.
struct Lag;

struct LagAt {
    actuator: usize,
    /// `e^-x`, and its mean over a step.
    decay: f64,
    mean: f64,
    level: Option<f64>,
}

impl Acting for LagAt {
    fn before_step(&mut self, view: &mut StepView<'_>) {
        let command = &mut view.ctrl[self.actuator];
        let u = *command;
        let behind = self.level.unwrap_or(u) - u;
        *command = u + behind * self.mean;
        self.level = Some(u + behind * self.decay);
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

impl Effect for Lag {
    /// Every bus and control loop delays by a step at least; a current loop settles within one.
    ///
    /// Where the two cannot be told apart, a delay is likelier.
    fn unusual_at(&self, _plant: &Plant, _site: &str) -> bool {
        true
    }

    fn acts(&self) -> Acts {
        Acts::Command
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const { &[EffectParameter::new("time_constant", "s", [0.0, 0.5], 0.0)] }
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        actuators(plant)
    }

    fn native(&self, site: &Site<'_>, document: &mut NativeModel<'_>) -> Result<Native> {
        let [time] = values(site)?;
        let actuator = document.actuator(site.name)?;
        if actuator.lag > 0.0 {
            return Ok(Native::LeftOut(
                "is a second lag, and MJCF has one an actuator".into(),
            ));
        }
        actuator.lag = time;
        Ok(Native::Nearly(
            "is a filter whose activation begins at zero in other programs: set it to the first command".into(),
        ))
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let [time] = values(site)?;
        let time = at_least(site, "time_constant", time, 0.0)?;
        let x = site.plant.layout.timestep / time;
        let (decay, mean) = if x.is_finite() {
            ((-x).exp(), -(-x).exp_m1() / x)
        } else {
            (0.0, 0.0)
        };
        Ok(Box::new(LagAt {
            actuator: site.plant.layout.actuator(site.name)?,
            decay,
            mean,
            level: None,
        }))
    }
}
