//! The kinds of cases.

use serde::{Deserialize, Serialize};

/// Kind of a case, by its causes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// No cause.
    None,
    /// One cause.
    Single,
    /// Two or three causes; viscous and dry friction of one joint are the most common.
    Several,
    /// One cause at all sites of a machine.
    Group,
    /// One cause of no catalogue.
    Unknown,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 5] = [
        Self::None,
        Self::Single,
        Self::Several,
        Self::Group,
        Self::Unknown,
    ];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Single => "single",
            Self::Several => "several",
            Self::Group => "group",
            Self::Unknown => "unknown",
        }
    }

    /// Description in words.
    #[must_use]
    pub fn about(self) -> &'static str {
        match self {
            Self::None => "Nothing",
            Self::Single => "One effect of the catalogue",
            Self::Several => "Two or three effects",
            Self::Group => "One effect at all places of a kind",
            Self::Unknown => "A cause that the catalogue has not got",
        }
    }

    /// The kind of that name; `pair` and `triple` are `Several`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "pair" | "triple" => Some(Self::Several),
            _ => Self::ALL.into_iter().find(|kind| kind.name() == name),
        }
    }
}
