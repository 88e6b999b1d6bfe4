//! `actuator-delay`: a command arrives later, by any time and not only by whole steps.

use std::collections::VecDeque;

use crate::anatomy::Anatomy;
use crate::cause::{Cause, Place, Values, drives};
use crate::world::{CommandPath, World};

/// The cause.
pub struct ActuatorDelay;

/// A delay line for commands.
///
/// A command holds for one step. If the delay is not a whole number of steps, two commands overlap
/// with a step; their weighted mean arrives in it.
pub struct Delay {
    /// Delay, s.
    pub seconds: f64,
    line: VecDeque<f64>,
    share: f64,
}

impl Delay {
    /// A delay line with a delay in seconds.
    #[must_use]
    pub fn new(seconds: f64) -> Self {
        Self {
            seconds,
            line: VecDeque::new(),
            share: 0.0,
        }
    }
}

impl CommandPath for Delay {
    fn begin(&mut self, first: f64, dt: f64) {
        let steps = self.seconds / dt;
        self.share = steps.fract();
        self.line = std::iter::repeat_n(first, steps as usize + 1).collect();
    }
    fn next(&mut self, sent: f64) -> f64 {
        self.line.push_back(sent);
        let older = self.line.pop_front().unwrap_or(sent);
        let newer = self.line.front().copied().unwrap_or(sent);
        self.share * older + (1.0 - self.share) * newer
    }
}

impl Cause for ActuatorDelay {
    fn name(&self) -> &'static str {
        "actuator-delay"
    }
    fn sites(&self, machine: &Anatomy) -> Vec<String> {
        drives(machine)
    }
    fn largest(&self, _place: &Place<'_>) -> f64 {
        0.3
    }
    fn act(&self, place: &Place<'_>, size: f64, world: &mut World) -> Values {
        let path = Box::new(Delay::new(size));
        world.commands.push((place.drive_index(), path));
        vec![("delay", size)]
    }
}
