//! A titled part of a page, and the blocks that it can contain.

use asid_results::view::View;

use super::{Figure, Table};
use crate::markup::escape;

/// One part of a section's body.
#[derive(Debug)]
pub(super) enum Block {
    Figures(Vec<Figure>),
    Table(Table),
    View(Box<View>),
    Note(String),
    Command(String),
    Facts(Vec<(String, String)>),
    Heading(String),
    Text(String),
    Folded(String, Vec<Block>),
}

/// A titled part of a page.
#[derive(Debug)]
pub struct Section {
    title: String,
    lead: String,
    blocks: Vec<Block>,
}

impl Section {
    /// An empty section.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            lead: String::new(),
            blocks: Vec::new(),
        }
    }

    /// Sets the sentence or two that introduce the section.
    #[must_use]
    pub fn lead(mut self, lead: impl Into<String>) -> Self {
        self.lead = lead.into();
        self
    }

    /// Adds figures, two a row on a wide screen; the last of an odd number gets a row to itself.
    #[must_use]
    pub fn figures(mut self, figures: Vec<Figure>) -> Self {
        if !figures.is_empty() {
            self.blocks.push(Block::Figures(figures));
        }
        self
    }

    /// Adds a table.
    #[must_use]
    pub fn table(mut self, table: Table) -> Self {
        self.blocks.push(Block::Table(table));
        self
    }

    /// Adds the 3-D view of the machine.
    #[must_use]
    pub fn view(mut self, view: View) -> Self {
        self.blocks.push(Block::View(Box::new(view)));
        self
    }

    /// Whether it contains a 3-D view.
    pub(super) fn has_view(&self) -> bool {
        self.blocks.iter().any(|b| matches!(b, Block::View(_)))
    }

    /// Adds a remark, such as why an expected part is missing.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.blocks.push(Block::Note(note.into()));
        self
    }

    /// Adds a command line that is selected as a whole and can be copied.
    #[must_use]
    pub fn command(mut self, command: impl Into<String>) -> Self {
        self.blocks.push(Block::Command(command.into()));
        self
    }

    /// Adds a list of names and their values.
    #[must_use]
    pub fn facts(mut self, facts: Vec<(String, String)>) -> Self {
        if !facts.is_empty() {
            self.blocks.push(Block::Facts(facts));
        }
        self
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn text(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Text(text.into()));
        self
    }

    /// Adds the body of another section, hidden until its summary is clicked.
    #[must_use]
    pub fn folded(mut self, summary: impl Into<String>, inner: Self) -> Self {
        if !inner.blocks.is_empty() {
            self.blocks
                .push(Block::Folded(summary.into(), inner.blocks));
        }
        self
    }

    /// Adds a heading inside the section.
    #[must_use]
    pub fn heading(mut self, heading: impl Into<String>) -> Self {
        self.blocks.push(Block::Heading(heading.into()));
        self
    }

    pub(super) fn html(&self, number: usize) -> String {
        let mut figures = 0;
        let blocks: String = self
            .blocks
            .iter()
            .map(|block| block.html(number, &mut figures))
            .collect();
        let lead = if self.lead.is_empty() {
            String::new()
        } else {
            format!("<p>{}</p>", escape(&self.lead))
        };
        format!(
            "<section aria-labelledby=\"s{number}\"><div class=\"margin\"><h2 id=\"s{number}\">{}</h2>{lead}</div>\
             <div class=\"body\">{blocks}</div></section>\n",
            escape(&self.title)
        )
    }
}

impl Block {
    /// The section as HTML; `figures` counts its figures, for identifiers that are unique on the
    /// page.
    pub(super) fn html(&self, section: usize, figures: &mut usize) -> String {
        match self {
            Self::Figures(list) => {
                let odd = list.len() % 2 == 1;
                let mut out = String::from("<div class=\"figures\">");
                for (i, figure) in list.iter().enumerate() {
                    out.push_str(
                        &figure.html(&format!("p{section}-{figures}"), odd && i + 1 == list.len()),
                    );
                    *figures += 1;
                }
                out.push_str("</div>");
                out
            }
            Self::Table(table) => table.html(),
            Self::View(view) => super::view::html(view),
            Self::Note(text) => format!("<p class=\"note\">{}</p>", escape(text)),
            Self::Command(text) => {
                format!(
                    "<div class=\"command\"><pre tabindex=\"0\"><code>{}</code></pre></div>",
                    escape(text)
                )
            }
            Self::Facts(facts) => {
                let rows: String = facts
                    .iter()
                    .map(|(k, v)| {
                        format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(k), escape(v))
                    })
                    .collect();
                format!("<dl class=\"facts\">{rows}</dl>")
            }
            Self::Text(text) => format!("<p class=\"text\">{}</p>", escape(text)),
            Self::Folded(summary, blocks) => {
                let inner: String = blocks.iter().map(|b| b.html(section, figures)).collect();
                format!(
                    "<details><summary>{}</summary><div class=\"body\">{inner}</div></details>\n",
                    escape(summary)
                )
            }
            Self::Heading(text) => format!("<h3 class=\"heading\">{}</h3>", escape(text)),
        }
    }
}
