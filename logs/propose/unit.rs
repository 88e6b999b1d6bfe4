//! The unit of a column. The first of these that is conclusive decides:
//!
//! 1. its name, such as `elbow_deg`;
//! 2. its stack: positions of LeRobot are degrees or shares of a range, and ROS uses SI;
//! 3. its values: the first usual unit in which a position lies within the range of the model.
//!
//! A speed without a named unit counts as SI here; later its position determines the unit, in
//! [`match_speed`](super::speed::match_speed).

use super::quantity::{Dimension, Quantity};
use super::words::{Measure, Words};
use crate::format::LogFormat;
use crate::series::Series;

/// How far readings may lie beyond a joint's range, as a share of it: stops yield, zeros are off.
const BEYOND: f64 = 0.15;
/// How far readings may lie beyond any joint's range in addition, rad or m.
const BEYOND_LEAST: f64 = 0.05;
/// Largest angle that counts as radians where the model states no range, rad: two turns.
const LARGEST_ANGLE: f64 = 12.6;
/// Largest position that counts as metres where the model states no range, m.
const LARGEST_PLACE: f64 = 20.0;

/// Conversion of a column to a quantity's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Unit as a study spells it; `None` for SI.
    pub name: Option<&'static str>,
    /// Factor besides the unit's.
    pub scale: f64,
    /// Added after it.
    pub offset: f64,
    /// How the unit is known, in a few words; empty for SI.
    pub reason: String,
    /// Whether the values fit.
    pub fits: bool,
}

impl Unit {
    fn si(fits: bool) -> Self {
        Self {
            name: None,
            scale: 1.0,
            offset: 0.0,
            reason: String::new(),
            fits,
        }
    }

    fn named(name: &'static str, reason: &str) -> Self {
        Self {
            name: Some(name),
            reason: reason.into(),
            ..Self::si(true)
        }
    }
}

/// Share of a range, 0 to 100, as LeRobot's grippers use.
fn percent(range: [f64; 2], reason: &str) -> Unit {
    Unit {
        name: Some("%"),
        scale: range[1] - range[0],
        offset: range[0],
        reason: reason.into(),
        fits: true,
    }
}

/// Whether values are from 0 to 100, as shares of a range are.
fn is_share(series: &Series) -> bool {
    let slack = BEYOND * 100.0;
    let mut values = series.values.iter().filter(|x| x.is_finite());
    values.all(|x| (-slack..=100.0 + slack).contains(x))
}

/// The unit of a series, if it holds a quantity.
#[must_use]
pub fn unit(quantity: &Quantity, series: &Series, words: &Words, kind: LogFormat) -> Unit {
    let per_second = |unit: &'static str| match (unit, quantity.measure) {
        ("deg", Some(Measure::Velocity)) => "deg/s",
        ("rad", Some(Measure::Velocity)) => "rad/s",
        ("mm", Some(Measure::Velocity)) => "mm/s",
        ("cm", Some(Measure::Velocity)) => "cm/s",
        (unit, _) => unit,
    };
    let position = quantity.measure == Some(Measure::Position);
    if let Some(named) = words.unit {
        return match (named, quantity.range) {
            ("%", Some(range)) if position && is_share(series) => percent(range, "named so"),
            ("%", _) => {
                let factor = crate::episode::unit_factor("%").unwrap_or(1.0);
                Unit {
                    fits: allows(quantity, series, factor),
                    ..Unit::named("%", "named so")
                }
            }
            _ => Unit::named(per_second(named), "named so"),
        };
    }
    // A table may hold LeRobot's data, under LeRobot's names.
    let features = ["action.", "observation.state."];
    let named_so =
        series.name.ends_with(".pos") && features.iter().any(|f| series.name.starts_with(f));
    let lerobot = kind == LogFormat::Lerobot || (kind.is_table() && named_so);
    if lerobot && position && quantity.joint.is_some() {
        let gripper = words.own.iter().any(|w| w == "gripper");
        return match (quantity.dimension, quantity.range) {
            (Dimension::Length, Some(range)) => percent(range, "LeRobot: 0 to 100 of the range"),
            (Dimension::Angle, Some(range)) if gripper => {
                percent(range, "LeRobot: 0 to 100 of the range")
            }
            _ => Unit::named("deg", "LeRobot: degrees"),
        };
    }
    let candidates: &[&'static str] = match quantity.dimension {
        Dimension::Angle if position => &["rad", "deg"],
        Dimension::Length if position => &["m", "cm", "mm"],
        _ => return Unit::si(true),
    };
    // Recordings of ROS are in SI by its rules (REP 103), whatever the values are.
    if matches!(kind, LogFormat::Mcap | LogFormat::Rosbag2) {
        return Unit::si(allows(quantity, series, 1.0));
    }
    let fitting = candidates.iter().find(|name| {
        let factor = crate::episode::unit_factor(name).unwrap_or(1.0);
        allows(quantity, series, factor)
    });
    match fitting {
        Some(&("rad" | "m")) => Unit::si(true),
        Some(name) => Unit::named(name, "by the joint's range"),
        None => Unit::si(false),
    }
}

/// Whether the values of a series, times a factor, are possible positions.
fn allows(quantity: &Quantity, series: &Series, factor: f64) -> bool {
    let fold = |start: f64, f: fn(f64, f64) -> f64| series.values.iter().copied().fold(start, f);
    let (low, high) = (
        factor * fold(f64::INFINITY, f64::min),
        factor * fold(f64::NEG_INFINITY, f64::max),
    );
    match (quantity.range, quantity.dimension) {
        (Some([a, b]), _) => {
            let slack = BEYOND * (b - a) + BEYOND_LEAST;
            a - slack <= low && high <= b + slack
        }
        (None, Dimension::Angle) => high.max(-low) <= LARGEST_ANGLE,
        (None, _) => high.max(-low) <= LARGEST_PLACE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantity(dimension: Dimension, range: Option<[f64; 2]>) -> Quantity {
        Quantity {
            name: "q".into(),
            vector: None,
            command: false,
            place: Some(0),
            joint: Some(0),
            measure: Some(Measure::Position),
            dimension,
            counts: None,
            range,
            words: vec![Words::of("q")],
            axis: None,
        }
    }

    fn series(values: &[f64]) -> Series {
        Series {
            values: values.to_vec(),
            ..Series::default()
        }
    }

    /// Symptom: a motor's command of 0 % was read as its lowest command.
    ///
    /// Cause: percentages counted as shares of the range, from its lower end, whatever they are of.
    #[test]
    fn a_percentage_of_a_motor_is_signed() {
        let position = quantity(Dimension::Angle, Some([-1.0, 1.0]));
        let motor = Quantity {
            measure: Some(Measure::Effort),
            dimension: Dimension::Other,
            ..position.clone()
        };
        let of = |q: &Quantity, values: &[f64]| {
            let words = Words::of("u_percent");
            let found = unit(q, &series(values), &words, LogFormat::Csv);
            (found.name, found.scale, found.offset, found.fits)
        };
        let plain = (Some("%"), 1.0, 0.0, true);
        assert_eq!(of(&motor, &[-80.0, 0.0, 90.0]), plain);
        assert_eq!(of(&motor, &[0.0, 90.0]), plain);
        assert!(!of(&motor, &[0.0, 900.0]).3);
        // A position of a range may be a share of it, or be signed as well.
        assert_eq!(of(&position, &[0.0, 90.0]), (Some("%"), 2.0, -1.0, true));
        assert_eq!(of(&position, &[-80.0, 90.0]), plain);
    }

    #[test]
    fn names_stacks_and_ranges_tell_units() {
        let joint = quantity(Dimension::Angle, Some([-1.5, 1.5]));
        let slide = quantity(Dimension::Length, Some([0.0, 0.04]));
        let unit = |q: &Quantity, values: &[f64], name: &str, kind| {
            unit(q, &series(values), &Words::of(name), kind)
        };
        assert_eq!(unit(&joint, &[0.1, 1.2], "a", LogFormat::Csv).name, None);
        assert_eq!(
            unit(&joint, &[5.0, 60.0], "a", LogFormat::Csv).name,
            Some("deg")
        );
        assert_eq!(
            unit(&joint, &[0.1, 1.2], "a_deg", LogFormat::Csv).name,
            Some("deg")
        );
        assert!(!unit(&joint, &[900.0], "a", LogFormat::Csv).fits);
        assert_eq!(
            unit(&joint, &[0.1], "a.pos", LogFormat::Lerobot).name,
            Some("deg")
        );
        let gripper = unit(&slide, &[0.0, 100.0], "gripper.pos", LogFormat::Lerobot);
        assert_eq!((gripper.name, gripper.scale), (Some("%"), 0.04));
        assert_eq!(
            unit(&slide, &[0.0, 38.0], "a", LogFormat::Csv).name,
            Some("mm")
        );
    }
}
