//! The contract of an effect: where it acts, on what, with which parameters.

use asid_core::backend::Capabilities;
use asid_core::error::Result;
use asid_core::registry::Origin;
use asid_core::simulator::StepView;
use asid_core::target::Target;
use asid_mjcf::native::NativeModel;
use asid_mjcf::plant::Plant;

use crate::acts::Acts;
use crate::reach::Reach;

/// How a search for a parameter's value begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At the null value: the parameter acts from there on in proportion.
    Slope,
    /// At each of these values.
    Values(&'static [f64]),
    /// One of these values and nothing between them, such as a number of teeth.
    Choice(&'static [f64]),
    /// At these multiples of what the logs show of something.
    Multiples(Reference, &'static [f64]),
    /// At these quantiles (0 to 1) of the places that the body of the site visits; the
    /// first choice parameter of the effect says along which axis (0, 1, 2).
    Places(&'static [f64]),
    /// Not searched for: it stays at its null value unless it is given.
    Given,
    /// Not searched for: it is this multiple of what the logs show of something, unless it is given.
    Set(Reference, f64),
}

/// What a start value is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The largest command of the actuator, without its mean for a position.
    Command,
    /// The largest speed of the joint.
    Speed,
    /// The spread of the sensor's readings.
    Reading,
    /// The largest force of the drive on the joint.
    Force,
    /// How far the joint travels between its ends.
    Travel,
    /// The compliance by which the largest force of the drive on the joint gives way as far as the joint travels.
    Give,
}

/// A parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectParameter {
    /// Name, such as `gain`.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Plausible values.
    pub range: [f64; 2],
    /// Value at which the effect is off.
    pub null: f64,
    /// How a search for its value begins.
    pub start: Start,
    /// Large values that are looked at beside its slope: see [`EffectParameter::large_at`].
    pub large: Option<Start>,
    /// The episode of the logs whose value it is, by its number; `None` for a value of all.
    pub episode: Option<usize>,
}

impl EffectParameter {
    /// A parameter that acts in proportion from its null value on.
    #[must_use]
    pub const fn new(name: &'static str, unit: &'static str, range: [f64; 2], null: f64) -> Self {
        Self {
            name,
            unit,
            range,
            null,
            start: Start::Slope,
            large: None,
            episode: None,
        }
    }

    /// Whether it is a limit that the machine never reaches at its null value, the upper end of the range: there is nothing between
    /// that and the values that act.
    #[must_use]
    pub fn is_limit(&self) -> bool {
        self.null == self.range[1]
    }

    /// Whether its values grow with the machine's mass, or are in a unit that the model chooses: its range is then that of a
    /// machine on a table.
    #[must_use]
    pub fn grows_with_the_machine(&self) -> bool {
        !self.is_limit()
            && ["N", "kg", "unit"]
                .iter()
                .any(|part| self.unit.contains(part))
    }

    /// The same as the value of one episode of the logs.
    #[must_use]
    pub const fn of_episode(mut self, number: usize) -> Self {
        self.episode = Some(number);
        self
    }

    /// The same of what acts out of proportion where it is large, as friction does that holds its joint: where stretches of a log are replayed, a
    /// search looks at these values too ([`Start::Values`] or [`Start::Multiples`]). A slope at the null knows of no joint that is held.
    #[must_use]
    pub const fn large_at(mut self, values: Start) -> Self {
        self.large = Some(values);
        self
    }

    /// The same with another start of the search.
    #[must_use]
    pub const fn starting(mut self, start: Start) -> Self {
        self.start = start;
        self
    }
}

/// What an effect is attached to.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// The machine.
    pub plant: &'a Plant,
    /// Name of the site; empty for an effect of the whole scene.
    pub name: &'a str,
    /// One value a parameter.
    pub values: &'a [f64],
    /// Places of the effect's targets among the columns that [`Acting::set`] and
    /// [`StepView::parameters`] show, in the order of [`Effect::targets`].
    pub columns: &'a [usize],
    /// Number of the episode among all logs, in their order, from 0.
    pub episode: usize,
}

/// An effect at work at one site in one simulation.
///
/// It may remember what it likes, as long as [`Acting::save`] and [`Acting::load`] carry
/// all of it: simulations are snapshotted and restored, and their parameters change while
/// their memory stays.
pub trait Acting: Send {
    /// Changes the model's parameters before the simulation runs: a row of all columns.
    fn set(&self, _columns: &mut [f64]) {}
    /// Called before each physics step.
    fn before_step(&mut self, _view: &mut StepView<'_>) {}
    /// Turns what a sensor would read at a time (s) into what it says; called in the
    /// order of time, possibly more than once for one time, for the sensor of the site.
    fn read(&mut self, _time: f64, _reading: &mut [f64]) {}
    /// Called where the machine was placed `from` one state `to` another within an episode, not by a step, as on the next reading of a
    /// log; positions and speeds of all joints each. What is remembered of where a joint was goes with it: a stiff spring would feel all
    /// of the change else.
    fn displaced(&mut self, _from: [&[f64]; 2], _to: [&[f64]; 2]) {}
    /// Forgets what was: a new episode begins.
    fn restart(&mut self) {}
    /// Appends what it remembers.
    fn save(&self, _memory: &mut Vec<f64>) {}
    /// Takes over what another one at the same site, maybe with other values, has saved.
    fn load(&mut self, _memory: &[f64]) {}
}

/// Effects that leave much the same in many logs as another one, and what tells them from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confusion {
    /// Names of the effects.
    pub with: &'static [&'static str],
    /// The experiment that tells them apart, as advice to who has the machine.
    pub told_apart_by: &'static str,
}

/// How well a plain document says an effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Native {
    /// All of it.
    Whole,
    /// Not quite: a sentence on what differs.
    Nearly(String),
    /// Not at all: a sentence on why, which follows on its name.
    LeftOut(String),
}

/// A physical effect.
pub trait Effect: Send + Sync {
    /// Where it acts.
    fn acts(&self) -> Acts;
    /// Its parameters.
    fn parameters(&self) -> &'static [EffectParameter];
    /// Names of the sites of a machine that it can be attached to; one empty name for an
    /// effect of the whole scene.
    fn sites(&self, plant: &Plant) -> Vec<String>;
    /// Parameters of the model that it changes at a site.
    fn targets(&self, _plant: &Plant, _site: &str) -> Vec<Target> {
        Vec::new()
    }
    /// What it moves by itself at a site. An effect whose forces act elsewhere than on what its targets name, or that moves
    /// another drive than that of its site, says [`Reach::Everything`].
    fn reach(&self, plant: &Plant, site: &str) -> Reach {
        Reach::of(plant, self.acts(), site, &self.targets(plant, site))
    }
    /// Whether [`Acting::before_step`] has something to do.
    fn steps(&self) -> bool {
        matches!(self.acts(), Acts::Command | Acts::Force)
    }
    /// Whether what it makes of a reading depends on readings before, and not on this one and its time alone.
    fn remembers_readings(&self) -> bool {
        self.acts() == Acts::Measurement
    }
    /// Names of effects that it is a refinement of: with some of its parameters at their null
    /// values it is one of them. The simpler one is preferred unless that leaves much more.
    fn refines(&self) -> &'static [&'static str] {
        &[]
    }
    /// Parameters that do what one of the law does that it [refines](Effect::refines), as pairs of names: its own and the simpler law's. In the place of that
    /// law it begins with those values.
    fn takes_over(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }
    /// Effects that it is easily mistaken for. One side of a pair says so.
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[]
    }
    /// Whether this effect is an unlikely explanation at this site a priori. A force on a body that joints hold
    /// is one: friction and drives are likelier there.
    fn unusual_at(&self, _plant: &Plant, _site: &str) -> bool {
        false
    }
    /// Effects that come with it at the same site more often than by chance, for they have one origin. One side of a pair says so.
    fn goes_with(&self) -> &'static [&'static str] {
        &[]
    }
    /// Values of each parameter, lowest and highest, that an ordinary machine has which is as its model says: makers' tolerances, friction that
    /// differs from one machine to the next. They are taken as three deviations. `shown` is what the logs show of the site. Empty
    /// where an ordinary machine has none of it.
    fn tolerance(
        &self,
        _plant: &Plant,
        _site: &str,
        _shown: &dyn Fn(Reference) -> f64,
    ) -> Vec<[f64; 2]> {
        Vec::new()
    }
    /// Whether it rounds readings to multiples of its one parameter: a log shows that by itself.
    fn rounds(&self) -> bool {
        false
    }
    /// Whether it hands readings on late by its one parameter, s, and does nothing else.
    fn delays(&self) -> bool {
        false
    }
    /// Whether it adds constants to readings of its sensor and does nothing else: its first value to a number, those after it to the entries of a vector.
    fn shifts_readings(&self) -> bool {
        false
    }
    /// Whether it depends on [`Site::episode`]: it goes with the order of the logs, or has values of single ones.
    fn counts_episodes(&self) -> bool {
        self.parameters().iter().any(|p| p.episode.is_some())
    }
    /// What an engine must be able to do for it, besides setting its targets and, where it
    /// [steps](Effect::steps), calling hooks.
    fn needs(&self) -> Capabilities {
        Capabilities::empty()
    }
    /// Writes it at a site with MJCF's own elements, and tells how well they say it. An effect that only changes
    /// values of its targets has nothing to do here: the values are written.
    ///
    /// # Errors
    /// When the scene has no such site, or a value makes no sense.
    fn native(&self, _site: &Site<'_>, _document: &mut NativeModel<'_>) -> Result<Native> {
        if self.acts() == Acts::Model && !self.steps() {
            return Ok(Native::Whole);
        }
        Ok(Native::LeftOut(
            "has no counterpart among MJCF's elements".into(),
        ))
    }
    /// Attaches it at a site, for one simulation.
    ///
    /// # Errors
    /// When the scene has no such site, or a value makes no sense.
    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>>;
}

/// An effect in the registry.
pub struct EffectEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// Makes it.
    pub make: &'static (dyn Fn() -> Box<dyn Effect> + Sync),
    /// Where it comes from.
    pub origin: Origin,
}

asid_core::__entry!(EffectEntry, "effect");

/// Registers an effect under a name, with the package that the statement stands in.
#[macro_export]
macro_rules! register {
    (EffectEntry {
        name: $name:expr,
        about: $about:expr,
        make: $make:expr $(,)?
    }) => {
        $crate::__inventory::submit! {
            $crate::EffectEntry {
                name: $name,
                about: $about,
                make: &$make,
                origin: $crate::__core::linked_origin!(),
            }
        }
    };
}
