//! The shell of a report: one HTML file with header, tiles, sections, figures and tables.
//!
//! The file is also well-formed XML, opens offline, follows the reader's light or dark preference,
//! and prints. Scripts are needed only for the interactive parts. On a wide screen a section's
//! title and introduction stand in the margin. On a phone there is one column, and only tables
//! scroll sideways.
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
mod gauge;
mod section;
mod table;
mod tile;
mod time;
mod view;

use section::Block;

pub use figure::Figure;
pub use gauge::Gauge;
pub use section::Section;
pub use table::{Cell, Column, Table};
pub use tile::Tile;

use crate::markup::escape;
use crate::style::STYLE;

const SCRIPT: &str = include_str!("page/copy.js");

/// The tone of a tile or table cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// A neutral fact.
    #[default]
    Plain,
    /// Favourable.
    Good,
    /// Not ideal, but known and accepted.
    Fair,
    /// Unfavourable.
    Bad,
}

impl Tone {
    pub(crate) const fn class(self) -> &'static str {
        match self {
            Self::Plain => "",
            Self::Good => "good",
            Self::Fair => "fair",
            Self::Bad => "bad",
        }
    }
}

/// A whole report.
#[derive(Debug)]
pub struct Page {
    title: String,
    kicker: String,
    lead: String,
    answer: String,
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
            answer: String::new(),
            badge: None,
            facts: Vec::new(),
            tiles: Vec::new(),
            sections: Vec::new(),
            footer: String::new(),
        }
    }

    /// Sets the small line over the title: the kind of report.
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

    /// Sets the answer in one sentence, if it is the purpose of the page: larger, above the lead.
    #[must_use]
    pub fn answer(mut self, answer: impl Into<String>) -> Self {
        self.answer = answer.into();
        self
    }

    /// Sets a badge beside the title, such as `success`.
    #[must_use]
    pub fn badge(mut self, text: &str, tone: Tone) -> Self {
        self.badge = Some((text.to_owned(), tone));
        self
    }

    /// Adds a line of the header: a name and its value.
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
        let (style, player) = player(&sections, self.sections.iter().any(Section::has_view));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\" />\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\" />\n\
             <meta name=\"color-scheme\" content=\"light dark\" />\n<title>{title}</title>\n<style>\n{style}{STYLE}</style>\n</head>\n\
             <body>\n<header>{kicker}<h1>{title}{badge}</h1>{answer}{lead}{facts}</header>\n<main>\n{tiles}{sections}</main>\n{footer}\
             <script>\n{SCRIPT}</script>\n{player}</body>\n</html>\n",
            title = escape(&self.title),
            kicker = some("p", "kicker", &self.kicker),
            answer = some("p", "lead answer", &self.answer),
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

/// Style sheet and script of the interactive parts of a page: the machine in 3-D, and plots over
/// time. Empty if there are none. The script is valid in XML and in HTML.
fn player(sections: &str, has_view: bool) -> (&'static str, String) {
    if !has_view && !time::has_plots(sections) {
        return ("", String::new());
    }
    let scripts = [time::scripts(), view::scripts()].concat();
    let script = format!("<script>//<![CDATA[\n(function () {{\n{scripts}}})();\n//]]></script>\n");
    (time::STYLE, script)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scripts_are_xml_and_small() {
        let (_, script) = player("", true);
        let document = roxmltree::Document::parse(script.trim()).unwrap();
        let text = document.root_element().text().unwrap();
        assert!(text.contains("function Player") && text.contains("uPlot"));
        // A report must stay under 3 MB, of which the drawing code is a small part.
        assert!(script.len() < 150_000, "{}", script.len());
        assert_eq!(script.matches("]]>").count(), 1);
        assert_eq!(player("<svg></svg>", false), ("", String::new()));
    }
}
