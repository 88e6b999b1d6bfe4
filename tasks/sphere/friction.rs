//! The unknown of the tasks with a uniform floor, and its named truths.

use asid_core::Target;
use asid_core::parameter::{Parameter, Scale};
use asid_core::task::Condition;

/// Prior range of the rolling friction, m.
const RANGE: [f64; 2] = [1e-3, 5e-3];

/// Range of out-of-range truths, m.
const OUT_OF_RANGE: [f64; 2] = [5.2e-3, 6e-3];

/// The unknown rolling friction of a geom, m.
#[must_use]
pub fn rolling_friction(geom: &str) -> Parameter {
    Parameter {
        name: "rolling_friction".into(),
        targets: vec![Target::new("geom", geom, "friction", 2)],
        range: RANGE,
        scale: Scale::Linear,
        unit: "m".into(),
    }
}

/// Conditions: a truth drawn from the prior by the seed, and one beyond the prior.
#[must_use]
pub fn conditions() -> Vec<Condition> {
    vec![
        Condition::drawn("in-range", &[]),
        Condition::drawn("out-of-range", &[("rolling_friction", OUT_OF_RANGE)]),
    ]
}
