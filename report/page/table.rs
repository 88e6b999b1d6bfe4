//! Tables that scroll inside their own frame on narrow screens.

use super::{Gauge, Tone};
use crate::markup::escape;

/// Content of a column, which determines its typesetting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A word or two, never broken.
    Text,
    /// Numbers, right-aligned.
    Number,
    /// Sentences, broken where necessary.
    Prose,
}

/// A column's head and the kind of its content.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    title: String,
    kind: Kind,
}

impl Column {
    /// A column of text.
    #[must_use]
    pub fn text(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            kind: Kind::Text,
        }
    }

    /// A column of numbers.
    #[must_use]
    pub fn number(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            kind: Kind::Number,
        }
    }

    /// A column of sentences.
    #[must_use]
    pub fn prose(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            kind: Kind::Prose,
        }
    }
}

/// A cell: formatted text and its tone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cell {
    text: String,
    tone: Tone,
    gauge: Option<Gauge>,
    note: String,
    hint: String,
}

impl Cell {
    /// A cell with a tone.
    #[must_use]
    pub fn toned(text: impl Into<String>, tone: Tone) -> Self {
        Self {
            text: text.into(),
            tone,
            ..Self::default()
        }
    }

    /// Adds a gauge under the text.
    #[must_use]
    pub fn gauge(mut self, gauge: Gauge) -> Self {
        self.gauge = Some(gauge);
        self
    }

    /// Adds a sentence of small print under the text.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Adds a tooltip.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = hint.into();
        self
    }

    /// Content of the cell as HTML.
    fn html(&self) -> String {
        let gauge = self.gauge.as_ref().map_or_else(String::new, Gauge::html);
        let note = match &*self.note {
            "" => String::new(),
            note => format!("<small>{}</small>", escape(note)),
        };
        format!("{}{gauge}{note}", escape(&self.text))
    }

    /// The attribute with the tooltip.
    fn title(&self) -> String {
        match &*self.hint {
            "" => String::new(),
            hint => format!(" title=\"{}\"", escape(hint)),
        }
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self::toned(text, Tone::Plain)
    }
}

/// A table. Rows shorter than the head are padded with empty cells, longer ones are cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
    total: bool,
    caption: String,
}

impl Table {
    /// A table without rows.
    #[must_use]
    pub fn new(columns: Vec<Column>) -> Self {
        Self {
            columns,
            rows: Vec::new(),
            total: false,
            caption: String::new(),
        }
    }

    /// Adds a row.
    #[must_use]
    pub fn row(mut self, cells: Vec<Cell>) -> Self {
        self.rows.push(cells);
        self
    }

    /// Marks the last row as the sum of the others.
    #[must_use]
    pub fn total(mut self) -> Self {
        self.total = true;
        self
    }

    /// Sets the caption above the table.
    #[must_use]
    pub fn caption(mut self, caption: impl Into<String>) -> Self {
        self.caption = caption.into();
        self
    }

    pub(super) fn html(&self) -> String {
        let class = |column: &Column, tone: Tone| {
            let kind = match column.kind {
                Kind::Text => "",
                Kind::Number => "n",
                Kind::Prose => "p",
            };
            match format!("{kind} {}", tone.class()).trim() {
                "" => String::new(),
                classes => format!(" class=\"{classes}\""),
            }
        };
        let head: String = self
            .columns
            .iter()
            .map(|c| {
                format!(
                    "<th scope=\"col\"{}>{}</th>",
                    class(c, Tone::Plain),
                    escape(&c.title)
                )
            })
            .collect();
        let mut body = String::new();
        for (i, row) in self.rows.iter().enumerate() {
            let last = self.total && i + 1 == self.rows.len();
            body.push_str(if last { "<tr class=\"total\">" } else { "<tr>" });
            for (j, column) in self.columns.iter().enumerate() {
                let empty = Cell::default();
                let cell = row.get(j).unwrap_or(&empty);
                let (open, close) = if j == 0 {
                    ("<th scope=\"row\"", "</th>")
                } else {
                    ("<td", "</td>")
                };
                body.push_str(&format!(
                    "{open}{}{}>{}{close}",
                    class(column, cell.tone),
                    cell.title(),
                    cell.html()
                ));
            }
            body.push_str("</tr>");
        }
        let caption = if self.caption.is_empty() {
            String::new()
        } else {
            format!("<caption>{}</caption>", escape(&self.caption))
        };
        format!(
            "<div class=\"table\" tabindex=\"0\" role=\"region\" aria-label=\"table\"><table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>\n"
        )
    }
}
