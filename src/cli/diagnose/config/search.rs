//! Breadth of a diagnosis' search: the keys `search.KEY`.

use asid_diagnosis::settings::Breadth;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How widely to search. More takes longer and misses less.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SearchConfig {
    /// Sets of effects that are fitted a little after each screening.
    raced: usize,
    /// Of these, those that are fitted to the end.
    finished: usize,
    /// Most effects, or groups of one law at several sites, that are named one upon the other.
    depth: usize,
}

impl Default for SearchConfig {
    fn default() -> Self {
        let Breadth {
            raced,
            finished,
            depth,
            ..
        } = Breadth::default();
        Self {
            raced,
            finished,
            depth,
        }
    }
}

impl SearchConfig {
    /// The breadth of the search.
    pub(super) fn breadth(self) -> Breadth {
        let Self {
            raced,
            finished,
            depth,
        } = self;
        Breadth {
            raced,
            finished,
            depth,
            ..Breadth::default()
        }
    }

    /// Whether a number that must be at least 1 is 0.
    pub(super) fn has_a_zero(self) -> bool {
        [self.raced, self.finished, self.depth].contains(&0)
    }
}
