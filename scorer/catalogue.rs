//! Looks up effects of the catalogue by name.

use asid_core::registry::all;
use asid_effects::{EffectEntry, EffectParameter};

/// Parameters of an effect; `None` if the catalogue lacks the effect.
#[must_use]
pub fn parameters_of(name: &str) -> Option<&'static [EffectParameter]> {
    let entry = all::<EffectEntry>().into_iter().find(|e| e.name == name)?;
    Some((entry.make)().parameters())
}

/// Whether an effect has a parameter.
#[must_use]
pub fn has_parameter(effect: &str, parameter: &str) -> bool {
    parameters_of(effect).is_some_and(|all| all.iter().any(|p| p.name == parameter))
}
