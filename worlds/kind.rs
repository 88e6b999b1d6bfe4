//! Kinds of real worlds and their names.

use std::fmt;
use std::str::FromStr;

use asid_core::{Error, Result};
use serde::{Serialize, Serializer};

/// How a simulated real world differs from the method's simulator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum WorldKind {
    /// The simulator itself: same engine, same scene.
    #[default]
    Matched,
    /// Another engine simulates the same scene.
    Crossed,
    /// Step, contacts, masses, servos and tracker are all slightly off; see
    /// [`PerturbationRanges`](crate::PerturbationRanges).
    Perturbed,
    /// The scene has another object, which the task defines.
    StandIn,
    /// Defined by the user: an engine, a model file or single effects.
    Custom,
}

impl WorldKind {
    /// All kinds, in the order of tables.
    pub const ALL: [Self; 5] = [
        Self::Matched,
        Self::Crossed,
        Self::Perturbed,
        Self::StandIn,
        Self::Custom,
    ];

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Matched => "matched",
            Self::Crossed => "crossed",
            Self::Perturbed => "perturbed",
            Self::StandIn => "stand-in",
            Self::Custom => "custom",
        }
    }
}

impl fmt::Display for WorldKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for WorldKind {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut all = Self::ALL.into_iter();
        all.find(|k| k.name() == text)
            .ok_or_else(|| Error::unknown("world", text, Self::ALL.map(Self::name)))
    }
}

impl Serialize for WorldKind {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_round_trip_and_a_wrong_name_lists_the_near_ones() {
        for kind in WorldKind::ALL {
            assert_eq!(kind.to_string().parse::<WorldKind>().unwrap(), kind);
        }
        let error = "perturbd".parse::<WorldKind>().unwrap_err().to_string();
        assert!(error.contains("`perturbed`"), "{error}");
    }
}
