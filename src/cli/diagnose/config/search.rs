//! How widely a diagnosis searches: the keys `search.KEY`.

use asid_diagnosis::diagnose::Contact;
use asid_diagnosis::search::Breadth;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How widely to search.
#[derive(Clone, Copy, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SearchConfig {
    /// Effects that the replay search fits on its first, shortest stage. More take longer and miss less.
    first: usize,
    /// Of these, those that it follows to whole logs.
    last: usize,
    /// Single effects that it follows to whole logs whatever sets of more do.
    singles: usize,
    /// Explanations that it tries a further effect upon.
    beam: usize,
    /// Most effects that it joins.
    depth: usize,
    /// How logs are taken in which bodies touch: by whole replays, in short segments, or by what is affordable. One of auto,
    /// replays, segments.
    #[schemars(with = "String")]
    pub(super) contact: Contact,
}

impl Default for SearchConfig {
    fn default() -> Self {
        let Breadth {
            first,
            last,
            singles,
            beam,
            depth,
        } = Breadth::default();
        Self {
            first,
            last,
            singles,
            beam,
            depth,
            contact: Contact::default(),
        }
    }
}

impl SearchConfig {
    /// The breadth of the replay search.
    pub(super) fn breadth(self) -> Breadth {
        let Self {
            first,
            last,
            singles,
            beam,
            depth,
            contact: _,
        } = self;
        Breadth {
            first,
            last,
            singles,
            beam,
            depth,
        }
    }

    /// Whether a number that must be at least 1 is 0.
    pub(super) fn has_a_zero(self) -> bool {
        [self.first, self.last, self.depth, self.beam].contains(&0)
    }
}
