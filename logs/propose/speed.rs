//! The unit and the sign of a speed, by its position.
//!
//! The range of a joint says nothing of its speed. What the speed adds up to over a short time does: that is the
//! displacement of the position, in the position's unit. Once the positions are placed, the factor between the two
//! names the unit of a speed whose name does not, and its sign.

use super::quantity::Dimension;
use super::{Match, fit, source, values};
use crate::episode::unit_factor;
use crate::raw::RawLog;
use crate::series::Series;

/// Correlation of displacements above which a speed is sure to belong to a position.
const SURE: f64 = 0.8;
/// A unit explains the factor between a speed and its position where it is within this of it, as a logarithm: 35 %.
const NEAR: f64 = 0.3;

/// Unit and sign of a speed, by the displacements of its position; `own` is the position's series and factor.
pub fn match_speed(found: &mut Match, log: &RawLog, own: (&Series, f64), dimension: Dimension) {
    let Some(mapping) = &mut found.mapping else {
        return;
    };
    let Some(speed) = log.series(source(mapping)) else {
        return;
    };
    let Some((per, sure)) = fit::speed_factor(speed, own.0) else {
        return;
    };
    if sure.abs() < SURE || mapping.unit.is_some() {
        return;
    }
    let wanted = per * own.1;
    let units: &[&str] = match dimension {
        Dimension::Angle => &["rad/s", "deg/s", "rpm"],
        Dimension::Length => &["m/s", "cm/s", "mm/s"],
        Dimension::Other => return,
    };
    let apart = |unit: &&&str| (wanted.abs() / unit_factor(unit).unwrap_or(1.0)).ln().abs();
    let nearest = units.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
    let Some(unit) = nearest.filter(|u| apart(u) < NEAR) else {
        found.reasons.push(format!(
            "no unit makes it its position's speed: that is {wanted:.3} times it"
        ));
        return;
    };
    if *unit != units[0] {
        mapping.unit = Some((*unit).to_owned());
    }
    if wanted < 0.0 {
        mapping.sign = -1.0;
        found
            .reasons
            .push("runs against its position: one of the two counts the other way".into());
    } else {
        found.reasons.push("is its position's speed".into());
    }
    found.values = values(speed, mapping);
}
