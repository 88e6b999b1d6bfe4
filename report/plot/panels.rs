//! Plots side by side as one standalone SVG file, for a page of documentation.

use crate::markup::escape;
use crate::style::STYLE;

use super::{FONT_SIZE, NARROW, Plot, coordinate};

/// Free space around and between panels, in SVG units.
const GAP: f64 = 24.0;

/// Height of a panel's title, in SVG units.
const TITLE: f64 = 26.0;

/// Plots with titles, row by row.
pub struct Panels {
    columns: usize,
    panels: Vec<(String, Box<dyn Plot + Send + Sync>)>,
}

impl Panels {
    /// An empty grid with `columns` panels a row.
    #[must_use]
    pub fn new(columns: usize) -> Self {
        Self {
            columns: columns.max(1),
            panels: Vec::new(),
        }
    }

    /// Adds a plot.
    #[must_use]
    pub fn panel(
        mut self,
        title: impl Into<String>,
        plot: impl Plot + Send + Sync + 'static,
    ) -> Self {
        self.panels.push((title.into(), Box::new(plot)));
        self
    }

    /// The SVG file, with the colours of a light or dark page as the reader prefers.
    #[must_use]
    pub fn svg(&self) -> String {
        let columns = self.columns.min(self.panels.len().max(1));
        let width = columns as f64 * (NARROW + GAP) + GAP;
        let (mut body, mut top) = (String::new(), GAP);
        for (r, row) in self.panels.chunks(columns).enumerate() {
            let mut tallest: f64 = 0.0;
            for (c, (title, plot)) in row.iter().enumerate() {
                let svg = plot.svg(&format!("p{r}-{c}"), NARROW);
                let height = height(&svg).unwrap_or(NARROW);
                let left = GAP + c as f64 * (NARROW + GAP);
                let place = format!(
                    "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" ",
                    coordinate(left),
                    coordinate(top + TITLE),
                    coordinate(NARROW),
                    coordinate(height)
                );
                // Move the class to the group: its width applies to pages, not to files.
                let nested = svg
                    .replacen("<svg ", &place, 1)
                    .replacen("class=\"plot\" ", "", 1);
                body += &format!(
                    "<g class=\"plot\"><text class=\"strong\" x=\"{}\" y=\"{}\" font-size=\"15\">{}</text>{nested}</g>\n",
                    coordinate(left),
                    coordinate(top + 0.6 * TITLE),
                    escape(title)
                );
                tallest = tallest.max(height);
            }
            top += TITLE + tallest + GAP;
        }
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {w} {h}\" width=\"{w}\" height=\"{h}\" \
             font-size=\"{FONT_SIZE}\" font-family=\"system-ui, Helvetica Neue, Arial, sans-serif\">\n\
             <style>\n{STYLE}</style>\n<rect width=\"100%\" height=\"100%\" style=\"fill: var(--paper)\"/>\n{body}</svg>\n",
            w = coordinate(width),
            h = coordinate(top),
        )
    }
}

/// Height of an SVG element, from its view box.
fn height(svg: &str) -> Option<f64> {
    let (_, rest) = svg.split_once("viewBox=\"")?;
    rest.split('"').next()?.split(' ').nth(3)?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{Axis, Chart, Layer};

    #[test]
    fn panels_are_one_well_formed_file_and_do_not_overlap() {
        let chart = || {
            Chart::new("c", Axis::new("x", "m"), Axis::new("y", "m"))
                .layer(Layer::line(vec![[0.0, 0.0], [1.0, 1.0]]))
        };
        let svg = Panels::new(2)
            .panel("one & only", chart())
            .panel("two", chart())
            .panel("three", chart())
            .svg();
        let document = roxmltree::Document::parse(&svg).unwrap();
        let number = |n: roxmltree::Node<'_, '_>, a: &str| -> f64 {
            n.attribute(a).unwrap().parse().unwrap()
        };
        let nested: Vec<[f64; 4]> = document
            .descendants()
            .filter(|n| n.has_tag_name("svg") && n.attribute("x").is_some())
            .map(|n| ["x", "y", "width", "height"].map(|a| number(n, a)))
            .collect();
        assert_eq!(nested.len(), 3);
        assert!(nested[0][0] + nested[0][2] < nested[1][0]);
        assert!(nested[0][1] + nested[0][3] < nested[2][1]);
    }
}
