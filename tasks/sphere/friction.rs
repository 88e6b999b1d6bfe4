//! The unknown of the tasks with one floor, and its named truths.

use asid_core::Target;
use asid_core::parameter::{Parameter, Scale};
use asid_core::task::Condition;

/// Range of rolling friction, m.
const RANGE: [f64; 2] = [1e-3, 5e-3];

/// Truths out of range, m.
const OUT_OF_RANGE: [f64; 2] = [5.2e-3, 6e-3];

/// Rolling friction of a geom, m.
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

/// A truth drawn from the prior by the seed, and one beyond it.
#[must_use]
pub fn conditions() -> Vec<Condition> {
    vec![
        Condition::drawn("in-range", &[]),
        Condition::drawn("out-of-range", &[("rolling_friction", OUT_OF_RANGE)]),
    ]
}
