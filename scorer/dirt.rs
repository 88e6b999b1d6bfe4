//! Named dirt is right if the label lists it, unless its fitted size is far too large.

use std::collections::BTreeMap;

use crate::answer::Answer;
use crate::catalogue::parameters_of;
use crate::label::{Label, name_of};
use crate::sites::Sites;

/// Largest ratio of fitted to drawn size at which named dirt is right.
///
/// Dirt is near the noise, so the error of its fitted size is about as large as the size itself.
const LARGEST_RATIO: f64 = 2.0;

/// Distances from the values at which the effect is off, by unit; parameters of one unit form one
/// size.
type Sizes = BTreeMap<&'static str, f64>;

/// Sizes of an effect's values.
///
/// A parameter that the catalogue lacks is off at 0 and has a unit of its own.
fn sizes(effect: &str, values: &BTreeMap<String, f64>) -> Sizes {
    let known = parameters_of(name_of(effect)).unwrap_or_default();
    let mut squares = Sizes::new();
    for (name, value) in values {
        let parameter = known.iter().find(|p| p.name == name);
        let (unit, null) = parameter.map_or(("", 0.0), |p| (p.unit, p.null));
        *squares.entry(unit).or_default() += (value - null).powi(2);
    }
    squares
        .into_iter()
        .map(|(unit, s)| (unit, s.sqrt()))
        .collect()
}

/// Whether the label lists `effect` (`NAME@SITE`) as dirt, and its fitted size is at most twice the
/// drawn one.
#[must_use]
pub fn is_listed(effect: &str, answer: &Answer, label: &Label, sites: &Sites) -> bool {
    let mut drawn = BTreeMap::new();
    let mut listed = false;
    for item in &label.dirt {
        let name = if item.site.is_empty() {
            item.effect.clone()
        } else {
            format!("{}@{}", item.effect, item.site)
        };
        if sites.same(&name, effect) {
            listed = true;
            drawn.extend(item.parameters.clone());
        }
    }
    let Some(fitted) = answer.values(effect).filter(|_| listed) else {
        return false;
    };
    let (drawn, fitted) = (sizes(effect, &drawn), sizes(effect, &fitted.parameters));
    drawn
        .iter()
        .filter(|(_, size)| **size > 0.0)
        .all(|(unit, size)| fitted.get(unit).is_none_or(|f| *f <= LARGEST_RATIO * size))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::EffectValues;
    use crate::label::Dirt;

    fn values(pairs: &[(&str, f64)]) -> BTreeMap<String, f64> {
        pairs.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect()
    }

    fn named(parameters: &[(&str, f64)], effect: &str) -> Answer {
        Answer {
            effects: vec![EffectValues {
                effect: effect.into(),
                site: "axis".into(),
                parameters: values(parameters),
                ..EffectValues::default()
            }],
            ..Answer::default()
        }
    }

    #[test]
    fn listed_dirt_is_right_up_to_twice_its_size() {
        let label = Label {
            dirt: vec![Dirt {
                effect: "coulomb-friction".into(),
                site: "axis".into(),
                parameters: values(&[("force", 0.03), ("offset", 0.04)]),
                ..Dirt::default()
            }],
            ..Label::default()
        };
        let listed = |force: f64| {
            let answer = named(&[("force", force), ("offset", 0.0)], "coulomb-friction");
            is_listed("coulomb-friction@axis", &answer, &label, &Sites::default())
        };
        // Force and offset have the same unit: the drawn size is 0.05.
        assert!(listed(0.099) && !listed(0.101));
        let other = named(&[("damping", 0.001)], "viscous-friction");
        assert!(!is_listed(
            "viscous-friction@axis",
            &other,
            &label,
            &Sites::default()
        ));
    }

    #[test]
    fn the_size_of_a_factor_is_its_distance_from_one() {
        let label = Label {
            dirt: vec![Dirt {
                effect: "mass".into(),
                site: "axis".into(),
                parameters: values(&[("factor", 1.03)]),
                ..Dirt::default()
            }],
            ..Label::default()
        };
        let listed = |factor: f64| {
            let answer = named(&[("factor", factor)], "mass");
            is_listed("mass@axis", &answer, &label, &Sites::default())
        };
        assert!(listed(0.95) && listed(1.05) && !listed(1.07));
    }
}
