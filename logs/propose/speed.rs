//! The unit and the sign of a speed, from its position.
//!
//! A joint's range does not determine the unit of its speed. The integral of the speed over a short
//! time does: it is the displacement of the position, in the position's unit. Once the positions
//! are assigned, the factor between the two determines the sign of a speed, and its unit if its
//! name has none.

use super::quantity::Dimension;
use super::{Match, fit, source, values};
use crate::episode::unit_factor;
use crate::raw::RawLog;
use crate::series::Series;

/// Smallest correlation of displacements for a speed to belong to a position.
const SURE: f64 = 0.8;
/// Largest difference of logarithms of the found factor and a unit's: 0.3 is 35 %.
const NEAR: f64 = 0.3;

/// Sets unit and sign of a speed from the displacements of its position; a unit in its name stays.
///
/// `own` is the position's series and factor.
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
    if sure.abs() < SURE {
        return;
    }
    let wanted = per * own.1;
    if mapping.unit.is_none() {
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
    }
    let unit = mapping.unit.as_deref().and_then(unit_factor);
    let is_near = (wanted.abs() / unit.unwrap_or(1.0)).ln().abs() < NEAR;
    if !is_near {
        found.reasons.push(format!(
            "its name has a unit in which it is not its position's speed: that is {wanted:.3} times it"
        ));
    }
    if wanted < 0.0 {
        mapping.sign = -1.0;
        found
            .reasons
            .push("runs against its position: one of the two counts the other way".into());
    } else if is_near {
        found.reasons.push("is its position's speed".into());
    }
    found.values = values(speed, mapping);
}
