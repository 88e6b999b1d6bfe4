//! Candidates: effects at sites, and where the search for their parameters begins.

use std::sync::Arc;

use asid_core::parameter::Scale;
use asid_core::registry::all;
use asid_core::{Parameter, Target};
use asid_effects::EffectEntry;
use asid_effects::EffectSpec;
use asid_effects::{Acts, Effect, EffectParameter, Reference, Start};
use asid_mjcf::Plant;

use crate::chance;
use crate::machine::Machine;
use crate::trajectory::Trajectory;

/// An effect at a site.
#[derive(Clone)]
pub struct Candidate {
    /// The effect.
    pub effect: Arc<dyn Effect>,
    /// Name and site, with no values: all parameters at null.
    pub spec: EffectSpec,
    /// Starting points, one value per parameter.
    pub starts: Vec<Vec<f64>>,
    /// Points at which the effect is large and not proportional to its value.
    ///
    /// They are evaluated in addition to the derivatives where segments of the logs are replayed.
    pub large: Vec<Vec<f64>>,
    /// Range of each parameter: that of the effect, or the one about which the logs carry
    /// information.
    pub ranges: Vec<[f64; 2]>,
    /// Number of training logs; values that belong to other logs are not fitted.
    pub episodes: usize,
    /// Whether it stands for an ordinary tolerance, within [`Effect::tolerance`]: it is fitted and
    /// never named.
    pub is_tolerance: bool,
}

/// A candidate that was left out, with the reason.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftOut {
    /// `NAME@SITE`.
    pub label: String,
    /// Reason, in words.
    pub why: String,
}

/// Factor by which a value that grows with the machine may exceed its range on a table.
///
/// Mass grows with the third power of length, and a machine may be ten times as long.
const LARGER: f64 = 1000.0;

/// Maximum number of starting points of one candidate.
const MAX_STARTS: usize = 24;

impl Candidate {
    /// Returns `NAME@SITE`.
    #[must_use]
    pub fn label(&self) -> String {
        self.spec.label()
    }

    /// Returns the parameters of the effect.
    #[must_use]
    pub fn parameters(&self) -> &'static [EffectParameter] {
        self.effect.parameters()
    }

    /// Returns the parameters as columns of a batch, each with whether it is searched for
    /// continuously.
    ///
    /// A tolerance keeps the values that the missing force has given: fits to whole replays use no
    /// priors.
    #[must_use]
    pub fn unknowns(&self) -> Vec<(Parameter, bool)> {
        self.parameters()
            .iter()
            .zip(&self.ranges)
            .map(|(p, &range)| {
                let target = Target {
                    element: "effect".into(),
                    name: self.label(),
                    attribute: p.name.into(),
                    index: 0,
                };
                let parameter = Parameter {
                    name: format!("{}.{}", self.label(), p.name),
                    targets: vec![target],
                    range,
                    scale: Scale::Linear,
                    unit: p.unit.into(),
                };
                let free = !matches!(p.start, Start::Choice(_) | Start::Given | Start::Set(..));
                (parameter, free && !self.is_tolerance && self.is_fitted(p))
            })
            .collect()
    }

    /// Returns how far a fit may move a parameter: over its range, or a thousand times as far if
    /// that is the range of a machine on a table.
    #[must_use]
    pub fn limits(&self, parameter: usize) -> [f64; 2] {
        let range = self.ranges[parameter];
        if self.is_tolerance {
            return range;
        }
        limits(&self.parameters()[parameter], range)
    }

    /// Returns the parameters whose effect is proportional to their value from the null value on.
    #[must_use]
    pub fn slopes(&self) -> Vec<usize> {
        let parameters = self.parameters().iter().enumerate();
        parameters
            .filter(|(_, p)| p.start == Start::Slope && self.is_fitted(p))
            .map(|(i, _)| i)
            .collect()
    }

    /// Returns the number of columns of each form of the candidate: one form for each start, and
    /// where segments are `replayed` one for each value at which it is large.
    #[must_use]
    pub fn forms(&self, replayed: bool) -> Vec<usize> {
        // An effect without a derivative has a secant.
        let columns = self.slopes().len().max(1);
        let mut forms = vec![columns; self.starts.len().max(1)];
        if replayed {
            forms.extend(self.large.iter().map(|_| 1));
        }
        forms
    }

    /// Whether a parameter applies to all episodes, or to one that is fitted to.
    fn is_fitted(&self, parameter: &EffectParameter) -> bool {
        parameter.episode.is_none_or(|e| e < self.episodes)
    }
}

/// Returns the candidate as an ordinary tolerance; `None` if the effect has none at its site.
fn within_tolerance(candidate: &Candidate, plant: &Plant, shown: &Trajectory) -> Option<Candidate> {
    let site = &candidate.spec.site;
    let measured = |reference: Reference| measure(plant, site, reference, shown);
    let ranges = candidate.effect.tolerance(plant, site, &measured);
    let is_wide = ranges.iter().any(|[low, high]| low < high);
    (ranges.len() == candidate.parameters().len() && is_wide).then(|| Candidate {
        ranges,
        large: Vec::new(),
        is_tolerance: true,
        ..candidate.clone()
    })
}

/// Returns how many of the candidates can be named.
#[must_use]
pub fn nameable(candidates: &[Candidate]) -> usize {
    candidates.iter().filter(|c| !c.is_tolerance).count()
}

/// Returns the evidence that the best of the candidates that can be named exceeds with at most
/// probability `rate` if none of them acts.
///
/// Each form of a candidate is a chance of its own; `replayed` is as in [`Candidate::forms`].
#[must_use]
pub fn threshold(candidates: &[Candidate], replayed: bool, rate: f64) -> f64 {
    let named = candidates.iter().filter(|c| !c.is_tolerance);
    let forms: Vec<usize> = named.flat_map(|c| c.forms(replayed)).collect();
    chance::threshold(&forms, rate)
}

/// Returns the study's parameter that fits the whole mass of a body, if a target is one of its
/// geoms; a model takes one of the two.
fn fitted_as_a_whole<'p>(
    plant: &Plant,
    targets: &[Target],
    parameters: &'p [Parameter],
) -> Option<&'p str> {
    let of_geom = |target: &Target| {
        let geoms = &plant.layout.geoms;
        let place = geoms.iter().position(|g| *g == target.name)?;
        let shapes = target.element == "geom" && matches!(&*target.attribute, "mass" | "pos");
        shapes.then(|| &plant.layout.bodies[plant.geoms[place].body])
    };
    let bodies: Vec<&String> = targets.iter().filter_map(of_geom).collect();
    let is_whole =
        |t: &Target| (&*t.element, &*t.attribute) == ("body", "mass") && bodies.contains(&&t.name);
    let found = parameters.iter().find(|p| p.targets.iter().any(is_whole));
    found.map(|p| &*p.name)
}

/// Returns all effects at all sites that the engine can add to the scene, followed by their
/// tolerances, and those left out.
///
/// It skips effects that the model has already, those named in `without`, and those that set in
/// another way what the study's `parameters` set.
#[must_use]
pub fn enumerate(
    machine: &Machine,
    shown: &Trajectory,
    (without, parameters): (&[String], &[Parameter]),
) -> (Vec<Candidate>, Vec<LeftOut>) {
    let plant = &machine.plant;
    let (mut found, mut left_out) = (Vec::new(), Vec::new());
    for entry in all::<EffectEntry>() {
        if without.iter().any(|name| name == entry.name) {
            continue;
        }
        let sites = (entry.make)().sites(plant);
        for site in sites {
            let effect = (entry.make)();
            let spec = EffectSpec {
                name: entry.name.to_owned(),
                site: site.clone(),
                values: Vec::new(),
            };
            let label = spec.label();
            if machine.given_effects().iter().any(|e| e.label() == label) {
                continue;
            }
            // A sensor that is in no log carries no information on its own effects.
            if effect.acts() == Acts::Measurement && !shown.sensors.contains(&site) {
                continue;
            }
            // An effect on contacts alone does nothing where there are none.
            if of_contacts(&*effect, plant, &site) && !shown.touches(plant, &site) {
                let why = "nothing touches it in these logs".to_owned();
                left_out.push(LeftOut { label, why });
                continue;
            }
            let targets = effect.targets(plant, &site);
            if let Some(parameter) = fitted_as_a_whole(plant, &targets, parameters) {
                let why = format!("parameter `{parameter}` fits the mass of the body as a whole");
                left_out.push(LeftOut { label, why });
                continue;
            }
            if let Err(error) = machine.with(std::slice::from_ref(&spec)) {
                left_out.push(LeftOut {
                    label,
                    why: error.to_string(),
                });
                continue;
            }
            let numbered = effect.parameters().iter().filter_map(|p| p.episode);
            if let Some(last) = numbered.max().filter(|last| shown.logs > last + 1) {
                let why = format!(
                    "it has values for {} logs, and {} are fitted to",
                    last + 1,
                    shown.logs
                );
                left_out.push(LeftOut { label, why });
                continue;
            }
            let starts = starts(&*effect, plant, &site, shown);
            let large = large(&*effect, plant, &site, (shown, &starts));
            let ranges = ranges(&*effect, plant, &site, shown);
            found.push(Candidate {
                effect: effect.into(),
                spec,
                starts,
                large,
                ranges,
                episodes: shown.logs,
                is_tolerance: false,
            });
        }
    }
    let tolerances = found
        .iter()
        .filter_map(|c| within_tolerance(c, plant, shown));
    let tolerances: Vec<Candidate> = tolerances.collect();
    found.extend(tolerances);
    (found, left_out)
}

/// Whether an effect changes nothing but the contact behaviour of a geom.
fn of_contacts(effect: &dyn Effect, plant: &Plant, site: &str) -> bool {
    let targets = effect.targets(plant, site);
    let contact = |t: &Target| {
        t.element == "geom" && matches!(&*t.attribute, "friction" | "solref" | "solimp")
    };
    !targets.is_empty() && targets.iter().all(contact)
}

/// Returns how far a fit may move a parameter of the given range.
fn limits(parameter: &EffectParameter, range: [f64; 2]) -> [f64; 2] {
    if parameter.grows_with_the_machine() {
        range.map(|end| LARGER * end)
    } else {
        range
    }
}

/// Returns the ranges of the parameters; the range of a place is the one over which the body moves.
fn ranges(effect: &dyn Effect, plant: &Plant, site: &str, shown: &Trajectory) -> Vec<[f64; 2]> {
    let parameters = effect.parameters().iter();
    parameters
        .map(|p| {
            if !matches!(p.start, Start::Places(_)) {
                return p.range;
            }
            let ends = (0..2).map(|axis| shown.places(plant, site, axis, &[0.0, 1.0]));
            let all: Vec<f64> = ends.flatten().collect();
            let low = all.iter().copied().fold(f64::INFINITY, f64::min);
            let high = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if low < high { [low, high] } else { p.range }
        })
        .collect()
}

/// Returns all combinations of the parameters' starting values.
fn starts(effect: &dyn Effect, plant: &Plant, site: &str, shown: &Trajectory) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = vec![Vec::new()];
    let parameters = effect.parameters();
    let axis = parameters
        .iter()
        .position(|p| matches!(p.start, Start::Choice(_)));
    // Choices come first: places are measured along the chosen axis.
    let mut order: Vec<usize> = (0..parameters.len()).collect();
    order.sort_by_key(|&i| !matches!(parameters[i].start, Start::Choice(_)));
    for start in &mut all {
        start.extend(parameters.iter().map(|p| p.null));
    }
    for i in order {
        let p = &parameters[i];
        all = all
            .iter()
            .flat_map(|row| {
                let values = match p.start {
                    Start::Slope | Start::Given => vec![p.null],
                    Start::Values(v) | Start::Choice(v) => v.to_vec(),
                    Start::Set(reference, multiple) => {
                        vec![multiple * measure(plant, site, reference, shown)]
                    }
                    Start::Multiples(reference, v) => multiples(plant, site, (reference, v), shown),
                    Start::Places(quantiles) => {
                        let axis = axis.map_or(0, |a| row[a] as usize);
                        shown.places(plant, site, axis, quantiles)
                    }
                };
                values.into_iter().map(|x| {
                    let mut other = row.clone();
                    let [low, high] = limits(p, p.range);
                    other[i] = x.clamp(low, high);
                    other
                })
            })
            .collect();
    }
    all.truncate(MAX_STARTS);
    all
}

/// Returns the first starting point with one parameter at each of the values at which it is large.
fn large(
    effect: &dyn Effect,
    plant: &Plant,
    site: &str,
    (shown, starts): (&Trajectory, &[Vec<f64>]),
) -> Vec<Vec<f64>> {
    let Some(first) = starts.first() else {
        return Vec::new();
    };
    let mut all = Vec::new();
    for (i, p) in effect.parameters().iter().enumerate() {
        let values = match p.large {
            Some(Start::Values(v)) => v.to_vec(),
            Some(Start::Multiples(reference, v)) => multiples(plant, site, (reference, v), shown),
            _ => Vec::new(),
        };
        let [low, high] = limits(p, p.range);
        let values = values.into_iter().map(|x| x.clamp(low, high));
        all.extend(values.filter(|x| *x != p.null).map(|x| {
            let mut row = first.clone();
            row[i] = x;
            row
        }));
    }
    all
}

/// Returns multiples of a quantity that the logs show at a site.
fn multiples(
    plant: &Plant,
    site: &str,
    (reference, multiples): (Reference, &[f64]),
    shown: &Trajectory,
) -> Vec<f64> {
    let unit = measure(plant, site, reference, shown);
    multiples.iter().map(|x| x * unit).collect()
}

/// Returns the quantity that the logs show at a site, in the unit of the reference.
fn measure(plant: &Plant, site: &str, reference: Reference, shown: &Trajectory) -> f64 {
    let layout = &plant.layout;
    let actuator = layout.actuators.iter().position(|a| a.name == site);
    let joint = layout.joints.iter().position(|j| j.name == site);
    let driven = joint.or_else(|| actuator.and_then(|a| plant.drives[a].map(|d| d.joint)));
    match reference {
        Reference::Command => actuator.map_or(1.0, |a| shown.command(plant, a)),
        Reference::Speed => driven.map_or(1.0, |j| shown.speed(plant, j)),
        Reference::Reading => shown.reading(site),
        Reference::Force => driven.map_or(1.0, |j| shown.force(plant, j)),
        Reference::Travel => driven.map_or(1.0, |j| shown.travel(plant, j)),
        Reference::Give => driven.map_or(1.0, |j| {
            shown.travel(plant, j) / shown.force(plant, j).max(f64::MIN_POSITIVE)
        }),
    }
}
