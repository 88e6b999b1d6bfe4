//! Mappings of a log's columns to quantities of the model: `[[column]]` in a study.
//!
//! Logs of other stacks have names, units, signs and zeros of their own. A mapping states them
//! once, and every reader applies it, so that logs are used as they were recorded.

use asid_core::layout::{Layout, Sensor};
use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

use super::entry_name;

/// Kinds of quantity that a unit measures, in words.
pub mod counts {
    /// rad and its multiples.
    pub const ANGLE: &str = "an angle";
    /// m and its parts.
    pub const LENGTH: &str = "a length";
    /// rad/s.
    pub const ANGULAR_SPEED: &str = "an angular speed";
    /// m/s.
    pub const SPEED: &str = "a speed";
    /// m/s².
    pub const ACCELERATION: &str = "an acceleration";
    /// N.
    pub const FORCE: &str = "a force";
    /// N m.
    pub const TORQUE: &str = "a torque";
    /// s.
    pub const TIME: &str = "a time";
    /// A ratio, of any quantity.
    pub const SHARE: &str = "";
}

use counts::{ACCELERATION, ANGLE, ANGULAR_SPEED, FORCE, LENGTH, SHARE, SPEED, TIME, TORQUE};

/// Units: name, factor to SI (NIST SP 811, appendix B), and kind of quantity.
const UNITS: [(&str, f64, &str); 24] = [
    ("rad", 1.0, ANGLE),
    ("mrad", 1e-3, ANGLE),
    ("deg", std::f64::consts::PI / 180.0, ANGLE),
    ("rev", std::f64::consts::TAU, ANGLE),
    ("rad/s", 1.0, ANGULAR_SPEED),
    ("deg/s", std::f64::consts::PI / 180.0, ANGULAR_SPEED),
    ("rpm", std::f64::consts::TAU / 60.0, ANGULAR_SPEED),
    ("m", 1.0, LENGTH),
    ("cm", 1e-2, LENGTH),
    ("mm", 1e-3, LENGTH),
    ("m/s", 1.0, SPEED),
    ("cm/s", 1e-2, SPEED),
    ("mm/s", 1e-3, SPEED),
    ("m/s^2", 1.0, ACCELERATION),
    ("g", 9.806_65, ACCELERATION),
    ("N", 1.0, FORCE),
    ("mN", 1e-3, FORCE),
    ("N m", 1.0, TORQUE),
    ("mN m", 1e-3, TORQUE),
    ("s", 1.0, TIME),
    ("ms", 1e-3, TIME),
    ("us", 1e-6, TIME),
    ("ns", 1e-9, TIME),
    ("%", 1e-2, SHARE),
];

/// Largest relative difference of equal factors: files round their digits.
const SAME_FACTOR: f64 = 1e-9;

/// One `[[column]]` of a study.
///
/// The quantity `name` of the model is `sign * scale * (column in SI units) + offset`, `delay`
/// seconds before the row's time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnMapping {
    /// A sensor, an entry of one (`sensor.0`), `ctrl.<actuator>`, or `time`.
    pub name: String,
    /// The log's column; for a whole vector the part before `.0`. By default `name`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Unit of the column, such as `deg` or `mm`. By default the SI unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// 1, or -1 where the column has the opposite direction.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub sign: f64,
    /// Factor besides unit and sign; not 0.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub scale: f64,
    /// Added after sign, unit and scale, in the SI unit of the quantity.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub offset: f64,
    /// Age of a reading at its stamp, s; for a command, the time until it acts.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub delay: f64,
}

fn one() -> f64 {
    1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_one(x: &f64) -> bool {
    *x == 1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

impl ColumnMapping {
    /// A mapping that changes nothing.
    #[must_use]
    pub fn of(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            from: None,
            unit: None,
            sign: 1.0,
            scale: 1.0,
            offset: 0.0,
            delay: 0.0,
        }
    }

    /// First entry of a sensor that it maps; `None` if it maps none.
    pub(super) fn first_entry_of(&self, sensor: &Sensor) -> Option<usize> {
        let is_it = |i: &usize| {
            self.name == sensor.name || self.name == entry_name(&sensor.name, sensor.len, *i)
        };
        (0..sensor.len).find(is_it)
    }

    /// Factor of the column, with sign and unit; an unknown unit counts as 1.
    #[must_use]
    pub fn factor(&self) -> f64 {
        let unit = self.unit.as_deref().and_then(unit_factor).unwrap_or(1.0);
        self.sign * self.scale * unit
    }

    /// Simplifies a unit and a scale to one unit of the same kind, or to none for the SI unit.
    ///
    /// Nothing changes where no single unit has their factor.
    #[must_use]
    pub fn in_one_unit(mut self) -> Self {
        let Some(counts) = self.unit.as_deref().and_then(unit_counts) else {
            return self;
        };
        let factor = self.factor().abs();
        let is_same = |unit: &&(&str, f64, &str)| {
            unit.2 == counts && (unit.1 / factor - 1.0).abs() < SAME_FACTOR
        };
        if let Some((name, of_unit, _)) = UNITS.iter().find(is_same) {
            self.unit = (*of_unit != 1.0).then(|| (*name).to_owned());
            self.scale = 1.0;
        }
        self
    }

    /// The mapping as lines of a study file.
    #[must_use]
    pub fn lines(&self) -> String {
        let body = toml::to_string(self).unwrap_or_default();
        format!("[[column]]\n{}", body.trim_end())
    }

    /// Checks the mapping against a model with this layout.
    ///
    /// # Errors
    /// When the name is none of the model's, or a value is out of its domain; the message is one
    /// line.
    pub fn check(&self, layout: &Layout) -> Result<()> {
        let fail = |message: String| Error::Config {
            key: "column".into(),
            message: format!("[[column]] `{}`: {message}", self.name),
        };
        let known = names(layout);
        if self.name != "time" && !known.contains(&self.name) {
            let near = Error::unknown("column", &self.name, known.iter().map(|n| &**n));
            return Err(fail(format!(
                "`name` is a sensor, ctrl.<actuator> or time; {near}"
            )));
        }
        if self
            .from
            .as_ref()
            .is_some_and(|from| from.trim().is_empty())
        {
            return Err(fail("`from` is empty: it is the name of a column".into()));
        }
        if let Some(unit) = &self.unit
            && unit_factor(unit).is_none()
        {
            let units: Vec<&str> = UNITS.iter().map(|(n, ..)| *n).collect();
            return Err(fail(format!(
                "unit `{unit}` is not known; known: {}; or give `scale`",
                units.join(", ")
            )));
        }
        if self.sign.abs() != 1.0 {
            return Err(fail(format!("sign = {}: it is 1 or -1", self.sign)));
        }
        if !self.scale.is_finite() || self.scale == 0.0 {
            return Err(fail(format!(
                "scale = {}: it is a number other than 0",
                self.scale
            )));
        }
        if !self.offset.is_finite() || !self.delay.is_finite() {
            return Err(fail("offset and delay are finite numbers".into()));
        }
        if self.name == "time" && (self.sign != 1.0 || self.delay != 0.0 || self.offset != 0.0) {
            return Err(fail("time takes `from`, `unit` and `scale` only".into()));
        }
        Ok(())
    }
}

/// Factor of a unit to SI; `None` for an unknown unit.
#[must_use]
pub fn unit_factor(unit: &str) -> Option<f64> {
    let found = UNITS.iter().find(|(name, ..)| *name == unit);
    found.map(|(_, factor, _)| *factor)
}

/// Kind of quantity that a unit measures, in the words of [`counts`].
///
/// `None` for an unknown unit, and for a ratio, which fits any quantity.
#[must_use]
pub fn unit_counts(unit: &str) -> Option<&'static str> {
    let found = UNITS.iter().find(|(name, ..)| *name == unit);
    found
        .map(|(.., counts)| *counts)
        .filter(|counts| *counts != SHARE)
}

/// Names that a mapping may have: sensors, their entries, commands.
fn names(layout: &Layout) -> Vec<String> {
    let mut all = Vec::new();
    for s in &layout.sensors {
        all.push(s.name.clone());
        if s.len > 1 {
            all.extend((0..s.len).map(|i| format!("{}.{i}", s.name)));
        }
    }
    all.extend(layout.actuators.iter().map(|a| format!("ctrl.{}", a.name)));
    all
}

/// The log's column of a quantity or an entry of one, and how its numbers are converted.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Source {
    /// Name of the log's column.
    pub column: String,
    /// Factor to SI.
    pub factor: f64,
    /// Added after the factor.
    pub offset: f64,
    /// Delay, s.
    pub delay: f64,
}

impl Source {
    /// The source of a quantity; a mapping of the entry precedes that of the whole vector.
    pub(super) fn of(mappings: &[ColumnMapping], name: &str, entry: Option<usize>) -> Self {
        let own = match entry {
            Some(i) => format!("{name}.{i}"),
            None => name.to_owned(),
        };
        if let Some(m) = mappings.iter().find(|m| m.name == own) {
            return Self::new(m, m.from.clone().unwrap_or(own));
        }
        match (mappings.iter().find(|m| m.name == name), entry) {
            (Some(m), Some(i)) => {
                let from = m.from.as_deref().unwrap_or(name);
                Self::new(m, format!("{from}.{i}"))
            }
            _ => Self {
                column: own,
                factor: 1.0,
                offset: 0.0,
                delay: 0.0,
            },
        }
    }

    fn new(mapping: &ColumnMapping, column: String) -> Self {
        Self {
            column,
            factor: mapping.factor(),
            offset: mapping.offset,
            delay: mapping.delay,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::tests::layout;

    #[test]
    fn the_lines_of_a_mapping_read_back_as_the_mapping() {
        #[derive(Deserialize)]
        struct Study {
            column: Vec<ColumnMapping>,
        }
        let mapping = ColumnMapping {
            unit: Some("deg".into()),
            sign: -1.0,
            offset: 0.25,
            ..ColumnMapping::of("angle")
        };
        let read: Study = toml::from_str(&mapping.lines()).unwrap();
        assert_eq!(read.column, [mapping]);
    }

    #[test]
    fn a_scale_that_undoes_a_unit_takes_both_away() {
        let mapping = ColumnMapping {
            unit: Some("deg".into()),
            scale: 180.0 / std::f64::consts::PI,
            sign: -1.0,
            ..ColumnMapping::of("angle")
        };
        let plain = mapping.in_one_unit();
        assert_eq!((plain.unit, plain.scale, plain.sign), (None, 1.0, -1.0));
        let tenths = ColumnMapping {
            unit: Some("cm".into()),
            scale: 0.1,
            ..ColumnMapping::of("tip.0")
        };
        assert_eq!(tenths.in_one_unit().unit.as_deref(), Some("mm"));
        let odd = ColumnMapping {
            unit: Some("deg".into()),
            scale: 1.1,
            ..ColumnMapping::of("angle")
        };
        assert_eq!(odd.clone().in_one_unit(), odd);
    }

    #[test]
    fn a_mapping_that_makes_no_sense_is_refused_in_one_line() {
        let base = ColumnMapping::of("angle");
        for (mapping, said) in [
            (ColumnMapping::of("angel"), "known: `angle`"),
            (
                ColumnMapping {
                    unit: Some("parsec".into()),
                    ..base.clone()
                },
                "unit `parsec`",
            ),
            (
                ColumnMapping {
                    from: Some(String::new()),
                    ..base.clone()
                },
                "`from` is empty",
            ),
            (
                ColumnMapping {
                    sign: 2.0,
                    ..base.clone()
                },
                "1 or -1",
            ),
            (ColumnMapping { scale: 0.0, ..base }, "other than 0"),
        ] {
            let error = mapping.check(&layout()).unwrap_err().to_string();
            assert!(
                error.contains(said) && error.lines().count() == 1,
                "{error}"
            );
        }
    }

    #[test]
    fn an_entry_has_its_own_mapping_before_that_of_its_vector() {
        let mappings = [
            ColumnMapping {
                from: Some("mocap".into()),
                unit: Some("mm".into()),
                ..ColumnMapping::of("tip")
            },
            ColumnMapping {
                from: Some("laser".into()),
                ..ColumnMapping::of("tip.2")
            },
        ];
        let source = |i| Source::of(&mappings, "tip", Some(i));
        assert_eq!(
            (source(0).column.as_str(), source(0).factor),
            ("mocap.0", 1e-3)
        );
        assert_eq!(
            (source(2).column.as_str(), source(2).factor),
            ("laser", 1.0)
        );
    }
}
