//! The shell of a report: one HTML file with header, tiles, sections, figures and tables.
//!
//! The file is also well-formed XML, opens offline, follows the reader's light
//! or dark preference, prints, and needs no script. On a wide screen a
//! section's title and introduction stand in the margin; on a phone all is one
//! column and only tables scroll sideways.
//!
//! ```
//! use asid_report::page::{Column, Page, Section, Table, Tile, Tone};
//! let html = Page::new("Engines compared")
//!     .kicker("asid conformance")
//!     .lead("Both engines pass.")
//!     .tile(Tile::new("passed", "12").tone(Tone::Good))
//!     .section(Section::new("Checks").lead("Each against theory.").table(
//!         Table::new(vec![Column::text("check"), Column::number("value")])
//!             .row(vec!["free fall".into(), "0.001".into()]),
//!     ))
//!     .html();
//! assert!(html.starts_with("<!DOCTYPE html>"));
//! ```

mod figure;
mod table;

pub use figure::Figure;
pub use table::{Cell, Column, Table};

use crate::markup::escape;

const STYLE: &str = include_str!("page/style.css");
const SCRIPT: &str = include_str!("page/copy.js");

/// How a tile or a table cell is meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// A fact.
    #[default]
    Plain,
    /// As one hopes.
    Good,
    /// Not as one hopes.
    Bad,
}

impl Tone {
    pub(crate) const fn class(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Good => "good",
            Self::Bad => "bad",
        }
    }
}

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

    /// Says how the value is meant.
    #[must_use]
    pub fn tone(mut self, tone: Tone) -> Self {
        self.tone = tone;
        self
    }

    fn html(&self) -> String {
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

/// One part of a section's body.
#[derive(Debug)]
enum Block {
    Figures(Vec<Figure>),
    Table(Table),
    Note(String),
    Command(String),
    Facts(Vec<(String, String)>),
    Heading(String),
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

    /// Adds figures, two a row on a wide screen; an odd one out gets a row to itself.
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

    /// Adds a remark, such as why something that a reader expects is not there.
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

    /// Adds a list of names and what they are.
    #[must_use]
    pub fn facts(mut self, facts: Vec<(String, String)>) -> Self {
        if !facts.is_empty() {
            self.blocks.push(Block::Facts(facts));
        }
        self
    }

    /// Adds a heading inside the section.
    #[must_use]
    pub fn heading(mut self, heading: impl Into<String>) -> Self {
        self.blocks.push(Block::Heading(heading.into()));
        self
    }

    fn html(&self, number: usize) -> String {
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
    /// `figures` counts the figures of the section, for identifiers that are unique on the page.
    fn html(&self, section: usize, figures: &mut usize) -> String {
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
            Self::Heading(text) => format!("<h3 class=\"heading\">{}</h3>", escape(text)),
        }
    }
}

/// A whole report.
#[derive(Debug)]
pub struct Page {
    title: String,
    kicker: String,
    lead: String,
    badge: Option<(String, Tone)>,
    facts: Vec<(String, String)>,
    tiles: Vec<Tile>,
    sections: Vec<Section>,
    footer: String,
}

impl Page {
    /// An empty page.
    #[must_use]
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            kicker: String::new(),
            lead: String::new(),
            badge: None,
            facts: Vec::new(),
            tiles: Vec::new(),
            sections: Vec::new(),
            footer: String::new(),
        }
    }

    /// Sets the small line over the title: what kind of report this is.
    #[must_use]
    pub fn kicker(mut self, kicker: &str) -> Self {
        self.kicker = kicker.to_owned();
        self
    }

    /// Sets the answer in one sentence.
    #[must_use]
    pub fn lead(mut self, lead: impl Into<String>) -> Self {
        self.lead = lead.into();
        self
    }

    /// Sets a word beside the title, such as `success`.
    #[must_use]
    pub fn badge(mut self, text: &str, tone: Tone) -> Self {
        self.badge = Some((text.to_owned(), tone));
        self
    }

    /// Adds a line of the header: a name and what it is.
    #[must_use]
    pub fn fact(mut self, name: &str, value: impl Into<String>) -> Self {
        self.facts.push((name.to_owned(), value.into()));
        self
    }

    /// Adds a key figure.
    #[must_use]
    pub fn tile(mut self, tile: Tile) -> Self {
        self.tiles.push(tile);
        self
    }

    /// Adds a section.
    #[must_use]
    pub fn section(mut self, section: Section) -> Self {
        self.sections.push(section);
        self
    }

    /// Sets the last line.
    #[must_use]
    pub fn footer(mut self, footer: impl Into<String>) -> Self {
        self.footer = footer.into();
        self
    }

    /// The page as one self-contained HTML file.
    #[must_use]
    pub fn html(&self) -> String {
        let some = |tag: &str, class: &str, text: &str| {
            if text.is_empty() {
                String::new()
            } else {
                format!("<{tag} class=\"{class}\">{}</{tag}>", escape(text))
            }
        };
        let badge = self.badge.as_ref().map_or(String::new(), |(text, tone)| {
            format!(
                " <span class=\"badge {}\">{}</span>",
                tone.class(),
                escape(text)
            )
        });
        let facts = Block::Facts(self.facts.clone()).html(0, &mut 0);
        let tiles: String = self.tiles.iter().map(Tile::html).collect();
        let sections: String = self
            .sections
            .iter()
            .enumerate()
            .map(|(i, s)| s.html(i + 1))
            .collect();
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\" />\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\" />\n\
             <meta name=\"color-scheme\" content=\"light dark\" />\n<title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n\
             <body>\n<header>{kicker}<h1>{title}{badge}</h1>{lead}{facts}</header>\n<main>\n{tiles}{sections}</main>\n{footer}\
             <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
            title = escape(&self.title),
            kicker = some("p", "kicker", &self.kicker),
            lead = some("p", "lead", &self.lead),
            facts = if self.facts.is_empty() { "" } else { &facts },
            tiles = if tiles.is_empty() {
                String::new()
            } else {
                format!("<dl class=\"tiles\">{tiles}</dl>\n")
            },
            footer = some("footer", "", &self.footer),
        )
    }
}
