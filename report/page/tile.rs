//! Key figures at the top of a page.

use super::Tone;
use crate::markup::escape;

/// A key figure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tile {
    label: String,
    value: String,
    note: String,
    tone: Tone,
}

impl Tile {
    /// A tile that shows `value` (formatted, with its unit) under `label`.
    #[must_use]
    pub fn new(label: &str, value: &str) -> Self {
        Self {
            label: label.to_owned(),
            value: value.to_owned(),
            ..Self::default()
        }
    }

    /// Adds a line of small print.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Sets the tone of the value.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }

    pub(super) fn html(&self) -> String {
        let note = if self.note.is_empty() {
            String::new()
        } else {
            format!("<dd class=\"small\">{}</dd>", escape(&self.note))
        };
        format!(
            "<div class=\"tile {}\"><dt>{}</dt><dd class=\"value\">{}</dd>{note}</div>",
            self.tone.class(),
            escape(&self.label),
            escape(&self.value)
        )
    }
}
