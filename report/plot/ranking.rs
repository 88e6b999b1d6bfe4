//! Bars with their names beside them, or above them on a narrow page.

use super::frame::{Axis, x_ticks};
use super::header::{Above, layout};
use super::scale::{Scale, Spacing};
use super::{Colour, FONT_SIZE, NARROW, Plot, coordinate, root};
use crate::markup::{escape, fit, text_width};

/// Height of a bar.
const BAR: f64 = 13.0;
/// Height of a line of text.
const LINE: f64 = 17.0;

/// A bar with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranked {
    name: String,
    note: String,
    value: f64,
    text: String,
    colour: Colour,
    strong: bool,
}

impl Ranked {
    /// A bar as long as `value`, with `text` at its end.
    #[must_use]
    pub fn new(name: impl Into<String>, value: f64, text: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            note: String::new(),
            value,
            text: text.into(),
            colour: Colour::Muted,
            strong: false,
        }
    }

    /// Adds a line of small print.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Sets the colour.
    #[must_use]
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = colour;
        self
    }

    /// Sets the name in bold.
    #[must_use]
    pub fn strong(mut self) -> Self {
        self.strong = true;
        self
    }

    /// Width of the text beside the bar; bold is wider.
    fn width(&self) -> f64 {
        let name = text_width(&self.name, FONT_SIZE) * if self.strong { 1.08 } else { 1.0 };
        name.max(text_width(&self.note, FONT_SIZE))
    }
}

/// Bars from top to bottom, in the order given.
#[derive(Clone, Debug)]
pub struct Ranking {
    title: String,
    description: String,
    axis: Axis,
    base: f64,
    references: Vec<(f64, String)>,
    rows: Vec<Ranked>,
}

impl Ranking {
    /// An empty ranking over the axis of its values.
    #[must_use]
    pub fn new(title: &str, axis: Axis) -> Self {
        Self {
            title: title.to_owned(),
            description: String::new(),
            axis,
            base: 0.0,
            references: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// Sets the value at which bars start, instead of zero; a logarithmic axis needs one.
    #[must_use]
    pub fn base(mut self, base: f64) -> Self {
        self.base = base;
        self
    }

    /// Adds a labelled line over the full height.
    #[must_use]
    pub fn reference(mut self, value: f64, label: impl Into<String>) -> Self {
        self.references.push((value, label.into()));
        self
    }

    /// Adds a bar beneath the existing ones.
    #[must_use]
    pub fn row(mut self, row: Ranked) -> Self {
        self.rows.push(row);
        self
    }

    /// Adds bars in order.
    #[must_use]
    pub fn rows(mut self, rows: impl IntoIterator<Item = Ranked>) -> Self {
        self.rows.extend(rows);
        self
    }

    /// Sets the description for screen readers.
    #[must_use]
    pub fn description(mut self, description: impl Into<String>) -> Self {
        self.description = description.into();
        self
    }

    /// The axis' own domain, or that of the base, the references and the values.
    fn domain(&self) -> [f64; 2] {
        if let Some(fixed) = self.axis.domain {
            return fixed;
        }
        let log = self.axis.spacing == Spacing::Log;
        let values = (self.rows.iter().map(|r| r.value))
            .chain(self.references.iter().map(|r| r.0))
            .chain([self.base])
            .filter(|v| v.is_finite() && (!log || *v > 0.0));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        })
    }
}

/// Positions of the parts of a row.
struct Places {
    scale: Scale,
    left: f64,
    beside: bool,
    base: f64,
}

impl Places {
    /// Height of a row with the gap to the next one.
    fn height(&self, row: &Ranked) -> f64 {
        let lines = if row.note.is_empty() { 1.0 } else { 2.0 };
        if self.beside {
            LINE * lines + 8.0
        } else {
            LINE * lines + BAR + 11.0
        }
    }

    /// The row whose top is at `y`.
    fn draw(&self, row: &Ranked, y: f64, width: f64) -> String {
        let room = if self.beside { self.left - 14.0 } else { width };
        let (anchor, x) = if self.beside {
            ("end", self.left - 14.0)
        } else {
            ("start", 0.0)
        };
        let text = |class: &str, line: f64, text: &str| {
            format!(
                "<text class=\"over {class}\" text-anchor=\"{anchor}\" x=\"{}\" y=\"{}\">{}</text>",
                coordinate(x),
                coordinate(y + LINE * line + 12.5),
                escape(&fit(text, FONT_SIZE, room))
            )
        };
        let mut svg = format!("<g><title>{}</title>", escape(&row.name));
        let mut lines = 1.0;
        svg.push_str(&text(
            if row.strong { "strong" } else { "" },
            0.0,
            &row.name,
        ));
        if !row.note.is_empty() {
            svg.push_str(&text("small", 1.0, &row.note));
            lines = 2.0;
        }
        let top = if self.beside {
            y + 0.5 * (LINE * lines - BAR)
        } else {
            y + LINE * lines + 1.0
        };
        let start = self.scale.map_clamped(self.base);
        let mut end = self.scale.map_clamped(row.value);
        if !end.is_finite() {
            end = start;
        } else if row.value != self.base {
            // Keep the bar thick enough to be visible.
            let (from, to) = (start.min(end), start.max(end).max(start.min(end) + 1.5));
            svg.push_str(&format!(
                "<rect class=\"fill {}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{BAR}\" rx=\"1.5\" fill-opacity=\"0.85\"/>",
                row.colour.class(),
                coordinate(from),
                coordinate(top),
                coordinate(to - from),
            ));
        }
        svg.push_str(&format!(
            "<text class=\"over\" x=\"{}\" y=\"{}\">{}</text></g>",
            coordinate(end.max(start) + 7.0),
            coordinate(top + 0.5 * BAR + 0.35 * FONT_SIZE),
            escape(&row.text)
        ));
        svg
    }
}

impl Plot for Ranking {
    fn svg(&self, id: &str, width: f64) -> String {
        let beside = width > NARROW * 1.5;
        let names = self.rows.iter().map(Ranked::width).fold(0.0, f64::max);
        let texts = self.rows.iter().map(|r| text_width(&r.text, FONT_SIZE));
        let left = if beside {
            names.clamp(60.0, 0.42 * width) + 14.0
        } else {
            2.0
        };
        let right = width - texts.fold(0.0, f64::max).max(10.0) - 10.0;
        let scale = Scale::new(self.domain(), [left, right], self.axis.spacing);
        let above: Vec<Above> = (self.references.iter())
            .filter(|(value, _)| value.is_finite())
            .map(|(value, label)| Above {
                x: scale.map_clamped(*value),
                text: label.clone(),
                colour: Colour::Ink,
            })
            .collect();
        let header = layout(width, "", &[], &above);
        let places = Places {
            scale,
            left,
            beside,
            base: self.base,
        };

        let top = header.height + 4.0;
        let mut rows = String::new();
        let mut bottom = top + 4.0;
        for row in &self.rows {
            rows.push_str(&places.draw(row, bottom, width));
            bottom += places.height(row);
        }
        if self.rows.is_empty() {
            rows = format!(
                "<text class=\"empty\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">no data</text>",
                coordinate(0.5 * (left + right)),
                coordinate(bottom + LINE)
            );
            bottom += 2.5 * LINE;
        }

        // Draw grid and ticks first, then the reference lines, then the bars.
        let vertical = |class: &str, at: f64| {
            format!(
                "<path class=\"{class}\" d=\"M{} {}V{}\"/>",
                coordinate(at),
                coordinate(top),
                coordinate(bottom)
            )
        };
        let mut svg = header.svg;
        let marks = x_ticks(&self.axis, &scale, right - left);
        for (value, label) in marks.values.iter().zip(&marks.labels) {
            let at = scale.map(*value);
            let half = 0.5 * text_width(label, FONT_SIZE);
            svg.push_str(&vertical("grid", at));
            svg.push_str(&format!(
                "<text class=\"tick\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>",
                coordinate(at.clamp(half, (width - half).max(half))),
                coordinate(bottom + 16.0),
                escape(label)
            ));
        }
        for mark in &above {
            svg.push_str(&vertical("axis", mark.x));
        }
        svg.push_str(&rows);
        svg.push_str(&format!(
            "<text class=\"axis-label\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>",
            coordinate(0.5 * (left + right)),
            coordinate(bottom + 34.0),
            escape(&fit(
                &self.axis.text(marks.exponent),
                FONT_SIZE,
                right - left
            ))
        ));
        root(
            id,
            [width, bottom + 40.0],
            &self.title,
            &self.description,
            &svg,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_on_a_logarithmic_axis_are_ratios_to_the_base() {
        let plot = Ranking::new("gap", Axis::new("gap", "").spacing(Spacing::Log))
            .base(1.0)
            .rows([10.0, 100.0, f64::NAN, 0.0].map(|v| Ranked::new("a <b>", v, "v")));
        for width in [NARROW, 2.0 * NARROW] {
            let svg = plot.svg("r", width);
            let document = roxmltree::Document::parse(&svg).unwrap();
            let bars: Vec<f64> = document
                .descendants()
                .filter(|n| n.has_tag_name("rect"))
                .map(|n| n.attribute("width").unwrap().parse().unwrap())
                .collect();
            assert!((bars[1] / bars[0] - 2.0).abs() < 0.01, "{bars:?}");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn nothing_to_rank_says_so() {
        let svg = Ranking::new("gap", Axis::new("gap", "")).svg("r", NARROW);
        assert!(roxmltree::Document::parse(&svg).is_ok() && svg.contains("no data"));
    }
}
