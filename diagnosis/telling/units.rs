//! Units of an effect's values at its site: of a catalogue's `N m s/rad or N s/m` the first holds
//! at a hinge, the second at a slide.

use std::collections::BTreeMap;

use asid_core::layout::JointKind;
use asid_core::registry::find;
use asid_effects::{EffectEntry, EffectSpec};

use crate::bench::Bench;

/// Separator of the two units of a value that acts at hinges and at slides.
const EITHER: &str = " or ";
/// Placeholder for the unit of the sensor at the site.
const OF_READING: [&str; 2] = ["unit of the reading", "units of the reading"];

/// What a site determines about units.
struct Site<'s> {
    /// Kind of the joint that the site is, or that its drive moves.
    joint: Option<JointKind>,
    /// Unit of the sensor that the site is.
    reading: Option<&'s str>,
}

impl<'s> Site<'s> {
    fn of(bench: &'s Bench, name: &str) -> Self {
        let plant = &bench.machine.plant;
        let layout = &plant.layout;
        let driven = || {
            let drive = layout.actuators.iter().position(|a| a.name == name)?;
            plant.drives[drive].map(|d| d.joint)
        };
        let joint = layout.joints.iter().position(|j| j.name == name);
        let sensor = bench.train.logs.sensors.iter().find(|s| s.name == name);
        Self {
            joint: joint.or_else(driven).map(|j| plant.joint_kind(j)),
            reading: sensor.map(|s| &*s.unit).filter(|u| !u.is_empty()),
        }
    }

    /// Returns the unit at this site of a value whose unit a catalogue declares.
    fn unit(&self, declared: &str) -> String {
        let [one, many] = OF_READING;
        let declared = match self.reading {
            Some(unit) => declared.replace(many, unit).replace(one, unit),
            None => declared.to_owned(),
        };
        match self.joint {
            Some(JointKind::Hinge) => one_of(&declared, true),
            Some(JointKind::Slide) => one_of(&declared, false),
            _ => declared,
        }
    }
}

/// Chooses from two units, `A or B`, the one about an axis or the one along it; text after a comma
/// stays.
fn one_of(declared: &str, about_axis: bool) -> String {
    let (units, said) = declared.split_at(declared.find(',').unwrap_or(declared.len()));
    let Some((a, b)) = units.split_once(EITHER) else {
        return declared.to_owned();
    };
    let is_about = |unit: &str| ["rad", "N m", "m²"].iter().any(|part| unit.contains(part));
    match (is_about(a), is_about(b)) {
        (true, false) => if about_axis { a } else { b }.to_owned() + said,
        (false, true) => if about_axis { b } else { a }.to_owned() + said,
        _ => declared.to_owned(),
    }
}

/// Returns the units of an effect's values at its site, by name.
pub(super) fn units(bench: &Bench, effect: &EffectSpec) -> BTreeMap<String, String> {
    let Ok(entry) = find::<EffectEntry>(&effect.name) else {
        return BTreeMap::new();
    };
    let site = Site::of(bench, &effect.site);
    let made = (entry.make)();
    let each = made.parameters().iter();
    each.map(|p| (p.name.to_owned(), site.unit(p.unit)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hinge_has_the_unit_about_its_axis_and_a_slide_the_one_along_it() {
        for (declared, hinge, slide) in [
            ("N m s/rad or N s/m", "N m s/rad", "N s/m"),
            ("N or N m", "N m", "N"),
            ("N m or N", "N m", "N"),
            ("rad/s or m/s", "rad/s", "m/s"),
            ("rad/(N m) or m/N", "rad/(N m)", "m/N"),
            ("kg m² or kg", "kg m²", "kg"),
            (
                "N m s/rad or N s/m, before the gear",
                "N m s/rad, before the gear",
                "N s/m, before the gear",
            ),
            ("s", "s", "s"),
        ] {
            assert_eq!(one_of(declared, true), hinge);
            assert_eq!(one_of(declared, false), slide);
        }
    }

    #[test]
    fn no_effect_of_the_catalogue_has_two_units_that_a_joint_leaves_open() {
        for entry in asid_core::registry::all::<EffectEntry>() {
            for p in (entry.make)().parameters() {
                for about_axis in [true, false] {
                    let unit = one_of(p.unit, about_axis);
                    assert!(!unit.contains(EITHER), "{} {}", entry.name, p.name);
                }
            }
        }
    }

    #[test]
    fn a_reading_has_the_unit_of_its_sensor() {
        let site = Site {
            joint: None,
            reading: Some("rad"),
        };
        assert_eq!(site.unit(OF_READING[0]), "rad");
        assert_eq!(
            site.unit("units of the reading per second"),
            "rad per second"
        );
        assert_eq!(site.unit("1"), "1");
    }

    /// Symptom: a friction at a hinge was told in `N m or N`. Cause: the hinge's encoder has its
    /// name, and the site counted as a sensor only.
    #[test]
    fn a_joint_with_the_name_of_its_encoder_has_the_units_of_both() {
        let site = Site {
            joint: Some(JointKind::Hinge),
            reading: Some("rad"),
        };
        assert_eq!(site.unit("N m or N"), "N m");
        assert_eq!(site.unit(OF_READING[0]), "rad");
    }
}
