//! The interface of an effect: where it acts, which parameters it has, and what it does.

use asid_core::backend::Capabilities;
use asid_core::error::Result;
use asid_core::registry::Origin;
use asid_core::simulator::StepView;
use asid_core::target::Target;
use asid_mjcf::native::NativeModel;
use asid_mjcf::plant::{ForceLimit, Plant};

use crate::acts::Acts;
use crate::reach::Reach;

/// How a search for a parameter's value begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At the null value, from which the effect grows in proportion to the parameter.
    Slope,
    /// At each of these values.
    Values(&'static [f64]),
    /// At one of these values and nothing between them, such as a number of teeth.
    Choice(&'static [f64]),
    /// At these multiples of a quantity that the logs show.
    Multiples(Reference, &'static [f64]),
    /// At these quantiles (0 to 1) of the positions that the body of the site visits.
    ///
    /// The effect's first choice parameter names the axis (0, 1, 2).
    Places(&'static [f64]),
    /// Not searched for: it keeps its null value unless a value is given.
    Given,
    /// Not searched for: this multiple of a quantity that the logs show, unless a value is given.
    Set(Reference, f64),
}

/// Quantity of the logs that scales a start value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// The largest command of the actuator; for a position command, about its mean.
    Command,
    /// The largest speed of the joint.
    Speed,
    /// The spread of the sensor's readings.
    Reading,
    /// The largest force of the drive on the joint.
    Force,
    /// How far the joint travels between its ends.
    Travel,
    /// The compliance that yields by the joint's travel under the drive's largest force.
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
    /// Large values to try beside the slope: see [`EffectParameter::large_at`].
    pub large: Option<Start>,
    /// Number of the episode that the value is for; `None` where it is for all episodes.
    pub episode: Option<usize>,
}

impl EffectParameter {
    /// A parameter whose effect is proportional to its distance from the null value.
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

    /// Whether the parameter is a limit that the machine never reaches at its null value.
    ///
    /// The null is then the upper end of the range. Values between the null and those that act have
    /// no effect.
    #[must_use]
    pub fn is_limit(&self) -> bool {
        self.null == self.range[1]
    }

    /// Whether values scale with the machine's mass, or have a unit that the model chooses.
    ///
    /// The range then suits a machine on a table.
    #[must_use]
    pub fn grows_with_the_machine(&self) -> bool {
        !self.is_limit()
            && ["N", "kg", "unit"]
                .iter()
                .any(|part| self.unit.contains(part))
    }

    /// The same parameter, for the value of one episode of the logs.
    #[must_use]
    pub const fn of_episode(mut self, number: usize) -> Self {
        self.episode = Some(number);
        self
    }

    /// The same parameter with large values to try ([`Start::Values`] or [`Start::Multiples`]).
    ///
    /// Some effects are nonlinear where they are large, such as friction that holds its joint: a
    /// slope at the null value cannot show that. The search tries these values too where it replays
    /// segments of a log.
    #[must_use]
    pub const fn large_at(mut self, values: Start) -> Self {
        self.large = Some(values);
        self
    }

    /// The same parameter with another start of the search.
    #[must_use]
    pub const fn starting(mut self, start: Start) -> Self {
        self.start = start;
        self
    }
}

/// Where an effect is attached, with its values.
#[derive(Clone, Copy, Debug)]
pub struct Site<'a> {
    /// The machine.
    pub plant: &'a Plant,
    /// Name of the site; empty for an effect of the whole scene.
    pub name: &'a str,
    /// One value for each parameter.
    pub values: &'a [f64],
    /// Indices of the effect's targets, in the order of [`Effect::targets`].
    ///
    /// They index the columns that [`Acting::set`] gets and [`StepView::parameters`] shows.
    pub columns: &'a [usize],
    /// Number of the episode among all logs, in their order, from 0.
    pub episode: usize,
}

/// An effect at work at one site in one simulation.
///
/// It may hold any state, as long as [`Acting::save`] and [`Acting::load`] carry all of it:
/// simulations are saved and restored, and their parameters change while their state stays.
pub trait Acting: Send {
    /// Changes the model's parameters before the simulation runs; `columns` is one row of them all.
    fn set(&self, _columns: &mut [f64]) {}
    /// Called before each physics step.
    ///
    /// Commands are within their ranges. What effects make of them may leave these.
    fn before_step(&mut self, _view: &mut StepView<'_>) {}
    /// Turns the true reading of the site's sensor at a time (s) into what the sensor reports.
    ///
    /// Calls come in the order of time, possibly several for one time.
    fn read(&mut self, _time: f64, _reading: &mut [f64]) {}
    /// Called where the machine was placed `from` one state `to` another within an episode.
    ///
    /// This happens without a step, as when a replay restarts at the next reading of a log. Each
    /// state is `[qpos, qvel]`. Remembered positions of a joint must move along, or a stiff spring
    /// would feel the whole change.
    fn displaced(&mut self, _from: [&[f64]; 2], _to: [&[f64]; 2]) {}
    /// Clears the state for a new episode.
    fn restart(&mut self) {}
    /// Appends the state to `memory`.
    fn save(&self, _memory: &mut Vec<f64>) {}
    /// Takes over a saved state of the same site, possibly saved with other parameter values.
    fn load(&mut self, _memory: &[f64]) {}
}

/// Effects that leave similar traces in many logs, and the experiment that tells them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confusion {
    /// Names of the effects.
    pub with: &'static [&'static str],
    /// The experiment that tells them apart, as advice to the owner of the machine.
    pub told_apart_by: &'static str,
}

/// How well a plain MJCF document expresses an effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Native {
    /// Completely.
    Whole,
    /// Nearly: a sentence on what differs.
    Nearly(String),
    /// Not at all: the reason, as a sentence that continues the effect's name.
    LeftOut(String),
}

/// A physical effect.
pub trait Effect: Send + Sync {
    /// Where it acts.
    fn acts(&self) -> Acts;
    /// Its parameters.
    fn parameters(&self) -> &'static [EffectParameter];
    /// Names of the machine's sites that it can be attached to.
    ///
    /// An effect of the whole scene has one empty name.
    fn sites(&self, plant: &Plant) -> Vec<String>;
    /// Parameters of the model that it changes at a site.
    fn targets(&self, _plant: &Plant, _site: &str) -> Vec<Target> {
        Vec::new()
    }
    /// What it moves directly at a site.
    ///
    /// Override this with [`Reach::Everything`] where its forces act on more than its targets name,
    /// or on another drive than the site's.
    fn reach(&self, plant: &Plant, site: &str) -> Reach {
        Reach::of(plant, self.acts(), site, &self.targets(plant, site))
    }
    /// Whether [`Acting::before_step`] has something to do.
    fn steps(&self) -> bool {
        matches!(self.acts(), Acts::Command | Acts::Force)
    }
    /// Whether it takes the drive of its site, a joint, away from the joint.
    ///
    /// It then comes last, since others depend on the drive.
    fn takes_drive(&self) -> bool {
        false
    }
    /// The limit of the force of the drive at its site that it sets with some values.
    ///
    /// Where another effect [takes](Effect::takes_drive) that drive, that one applies the limit.
    /// Else the last of several effects that limit one drive applies all limits: those of the
    /// others are in `force_limits` of its site's plant.
    fn force_limit(&self, _values: &[f64]) -> Option<ForceLimit> {
        None
    }
    /// Whether the reading that it makes depends on earlier readings.
    ///
    /// If not, it depends on the current reading and its time alone.
    fn remembers_readings(&self) -> bool {
        self.acts() == Acts::Measurement
    }
    /// Names of effects that it refines.
    ///
    /// It equals one of them where some of its parameters have their null values. A diagnosis
    /// prefers the simpler one unless that leaves much larger residuals.
    fn refines(&self) -> &'static [&'static str] {
        &[]
    }
    /// Parameters that correspond to one of the law that it [refines](Effect::refines).
    ///
    /// Pairs of names: its own and the simpler law's. Where it replaces that law it starts from
    /// those values.
    fn takes_over(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }
    /// Effects that it is easily mistaken for. Only one side of a pair lists the other.
    fn mistaken_for(&self) -> &'static [Confusion] {
        &[]
    }
    /// Whether this effect is an unlikely explanation at this site a priori.
    ///
    /// An example is a force on a body that joints hold: friction and drives are likelier there.
    fn unusual_at(&self, _plant: &Plant, _site: &str) -> bool {
        false
    }
    /// Effects that share its site more often than by chance, because they have one origin.
    ///
    /// Only one side of a pair lists the other.
    fn goes_with(&self) -> &'static [&'static str] {
        &[]
    }
    /// Lowest and highest value of each parameter on an ordinary machine that matches its model.
    ///
    /// Makers' tolerances and friction that varies between machines cause them. The bounds count as
    /// three standard deviations. `shown` returns what the logs show of the site. Empty where an
    /// ordinary machine has none of this effect.
    fn tolerance(
        &self,
        _plant: &Plant,
        _site: &str,
        _shown: &dyn Fn(Reference) -> f64,
    ) -> Vec<[f64; 2]> {
        Vec::new()
    }
    /// Whether it only rounds readings to multiples of its one parameter, which a log shows
    /// directly.
    fn rounds(&self) -> bool {
        false
    }
    /// Whether it only delays readings, by its one parameter (s).
    fn delays(&self) -> bool {
        false
    }
    /// Whether it only adds constants to its sensor's readings.
    ///
    /// The first value goes to a number, the later values to the entries of a vector.
    fn shifts_readings(&self) -> bool {
        false
    }
    /// Whether it depends on [`Site::episode`].
    ///
    /// It then follows the order of the logs, or has values of single episodes.
    fn counts_episodes(&self) -> bool {
        self.parameters().iter().any(|p| p.episode.is_some())
    }
    /// Capabilities that an engine needs for it.
    ///
    /// Setting its targets, and hooks where it [steps](Effect::steps), are implied.
    fn needs(&self) -> Capabilities {
        Capabilities::empty()
    }
    /// Writes it at a site with MJCF's own elements, and returns how well they express it.
    ///
    /// An effect that only changes values of its targets needs no code here: the values are
    /// written.
    ///
    /// # Errors
    /// When the scene has no such site, or a value is invalid.
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
    /// When the scene has no such site, or a value is invalid.
    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>>;
}

/// An effect in the registry.
pub struct EffectEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for `asid list`.
    pub about: &'static str,
    /// Constructs it.
    pub make: &'static (dyn Fn() -> Box<dyn Effect> + Sync),
    /// Where it comes from.
    pub origin: Origin,
}

asid_core::__entry!(EffectEntry, "effect");

/// Registers an effect under a name, with the package that contains the statement as origin.
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
