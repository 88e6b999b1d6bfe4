//! Axes, grid and data box, shared by all plots.

use super::header::{Above, Entry, layout};
use super::scale::{Scale, Spacing, Ticks};
use super::{FONT_SIZE, coordinate};
use crate::markup::{escape, fit, text_width};
use crate::number::{superscript, unit_symbol};

/// Properties of an axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    pub(crate) label: String,
    pub(crate) unit: String,
    pub(crate) spacing: Spacing,
    pub(crate) domain: Option<[f64; 2]>,
    pub(crate) zero: bool,
    pub(crate) bare: bool,
    pub(crate) marks: Vec<(f64, String)>,
    pub(crate) gutter: f64,
}

impl Axis {
    /// An axis of `label` in `unit`; an empty unit is not shown.
    #[must_use]
    pub fn new(label: &str, unit: &str) -> Self {
        Self {
            label: label.to_owned(),
            unit: unit.to_owned(),
            ..Self::default()
        }
    }

    /// Fixes the domain; otherwise it is that of the data plus a margin.
    #[must_use]
    pub fn domain(mut self, domain: [f64; 2]) -> Self {
        self.domain = Some(domain);
        self
    }

    /// Includes zero.
    #[must_use]
    pub fn zero(mut self) -> Self {
        self.zero = true;
        self
    }

    /// Sets the spacing of the axis.
    #[must_use]
    pub fn spacing(mut self, spacing: Spacing) -> Self {
        self.spacing = spacing;
        self
    }

    /// Omits tick labels, for an axis whose unit is uninformative, such as a density.
    #[must_use]
    pub fn bare(mut self) -> Self {
        self.bare = true;
        self
    }

    /// Reserves at least this much room for tick labels, so that stacked plots line up.
    #[must_use]
    pub fn gutter(mut self, width: f64) -> Self {
        self.gutter = width;
        self
    }

    /// Sets the marks along the axis: `(position, text)`, increasing, such as the names of
    /// categories.
    #[must_use]
    pub fn marks(mut self, marks: Vec<(f64, String)>) -> Self {
        self.marks = marks;
        self
    }

    fn ticks(&self, scale: &Scale, most: usize) -> Ticks {
        if self.marks.is_empty() {
            return scale.ticks(most);
        }
        let (values, labels) = self
            .marks
            .iter()
            .filter(|m| m.0.is_finite())
            .cloned()
            .unzip();
        Ticks {
            values,
            labels,
            exponent: 0,
        }
    }

    pub(super) fn text(&self, exponent: i32) -> String {
        let unit = unit_symbol(&self.unit);
        let power = if exponent == 0 {
            String::new()
        } else {
            format!("10{}", superscript(exponent))
        };
        match (power.is_empty() || self.bare, unit.is_empty()) {
            (true, true) => self.label.clone(),
            (true, false) if self.bare => self.label.clone(),
            (true, false) => format!("{} ({unit})", self.label),
            (false, true) => format!("{} (×{power})", self.label),
            (false, false) => format!("{} ({power} {unit})", self.label),
        }
    }
}

/// A laid-out frame: scales for the data, and the drawing around and behind them.
pub(crate) struct Frame {
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    /// Grid, axes, labels, legend.
    pub(crate) svg: String,
    /// Clip path of the box, referenced as `url(#{id}-clip)`.
    pub(crate) clip: String,
    pub(crate) width: f64,
    pub(crate) height: f64,
    /// `[left, top, right, bottom]` of the box.
    pub(crate) area: [f64; 4],
}

/// Input of a frame's layout.
pub(crate) struct Request<'a> {
    pub(crate) id: &'a str,
    pub(crate) width: f64,
    pub(crate) x: (&'a Axis, [f64; 2]),
    pub(crate) y: (&'a Axis, [f64; 2]),
    pub(crate) entries: Vec<Entry>,
    /// Labels above the plot, `x` in data units.
    pub(crate) above: Vec<Above>,
    /// Whether to draw grid lines from the x axis as well.
    pub(crate) map_grid: bool,
}

impl Frame {
    /// Space to the left of a box of `plot_height` for its y ticks, and to the right of it.
    pub(crate) fn margins(y: (&Axis, [f64; 2]), plot_height: f64) -> [f64; 2] {
        let ticks = y_ticks(y, [plot_height, 0.0], plot_height).1;
        let widest = ticks
            .labels
            .iter()
            .map(|l| text_width(l, FONT_SIZE))
            .fold(y.0.gutter, f64::max);
        [if y.0.bare { 4.0 } else { widest + 9.0 }, 14.0]
    }

    /// Lays out a frame whose box is `plot_height` high.
    pub(crate) fn new(request: Request<'_>, plot_height: f64) -> Self {
        let Request {
            id,
            width,
            x,
            y,
            entries,
            mut above,
            map_grid,
        } = request;
        let [margin_left, margin_right] = Self::margins(y, plot_height);
        let (left, right) = (margin_left, width - margin_right);
        let x_scale = Scale::new(x.1, [left, right], x.0.spacing);
        above
            .iter_mut()
            .for_each(|a| a.x = x_scale.map_clamped(a.x));

        let exponent = y_ticks(y, [plot_height, 0.0], plot_height).1.exponent;
        let header = layout(width, &y.0.text(exponent), &entries, &above);
        let (top, bottom) = (header.height, header.height + plot_height);
        let (y_scale, y_marks) = y_ticks(y, [bottom, top], plot_height);
        let x_marks = x_ticks(x.0, &x_scale, right - left);

        let mut svg = header.svg;
        // Grid lines with their tick labels.
        for (value, label) in y_marks.values.iter().zip(&y_marks.labels) {
            let at = y_scale.map(*value);
            svg.push_str(&format!(
                "<path class=\"grid\" d=\"M{} {}H{}\"/>",
                coordinate(left),
                coordinate(at),
                coordinate(right)
            ));
            if !y.0.bare {
                svg.push_str(&format!(
                    "<text class=\"tick\" text-anchor=\"end\" x=\"{}\" y=\"{}\">{}</text>",
                    coordinate(left - 7.0),
                    coordinate(at + 0.35 * FONT_SIZE),
                    escape(label)
                ));
            }
        }
        for (value, label) in x_marks.values.iter().zip(&x_marks.labels) {
            let at = x_scale.map(*value);
            if map_grid {
                svg.push_str(&format!(
                    "<path class=\"grid\" d=\"M{} {}V{}\"/>",
                    coordinate(at),
                    coordinate(top),
                    coordinate(bottom)
                ));
            }
            svg.push_str(&format!(
                "<path class=\"axis\" d=\"M{} {}v4\"/>",
                coordinate(at),
                coordinate(bottom)
            ));
            // Move labels at the ends inwards rather than out of the drawing.
            let half = 0.5 * text_width(label, FONT_SIZE);
            svg.push_str(&format!(
                "<text class=\"tick\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>",
                coordinate(at.clamp(half, (width - half).max(half))),
                coordinate(bottom + 18.0),
                escape(label)
            ));
        }
        svg.push_str(&format!(
            "<path class=\"axis\" d=\"M{} {}H{}\"/>",
            coordinate(left),
            coordinate(bottom),
            coordinate(right)
        ));
        let x_text = fit(&x.0.text(x_marks.exponent), FONT_SIZE, right - left);
        svg.push_str(&format!(
            "<text class=\"axis-label\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>",
            coordinate(0.5 * (left + right)),
            coordinate(bottom + 37.0),
            escape(&x_text)
        ));

        let clip = format!(
            "<clipPath id=\"{}-clip\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath>",
            escape(id),
            coordinate(left),
            coordinate(top - 1.0),
            coordinate(right - left),
            coordinate(plot_height + 2.0)
        );
        Self {
            x: x_scale,
            y: y_scale,
            svg,
            clip,
            width,
            height: bottom + 43.0,
            area: [left, top, right, bottom],
        }
    }
}

fn y_ticks((axis, domain): (&Axis, [f64; 2]), range: [f64; 2], plot_height: f64) -> (Scale, Ticks) {
    let scale = Scale::new(domain, range, axis.spacing);
    let ticks = axis.ticks(&scale, (plot_height / 38.0).floor().max(3.0) as usize);
    (scale, ticks)
}

/// As many ticks as fit without overlapping labels.
pub(super) fn x_ticks(axis: &Axis, scale: &Scale, width: f64) -> Ticks {
    let mut most = (width / 55.0).floor().max(2.0) as usize;
    loop {
        let ticks = axis.ticks(scale, most);
        let apart = ticks
            .values
            .windows(2)
            .zip(ticks.labels.windows(2))
            .all(|(v, l)| {
                let room = scale.map(v[1]) - scale.map(v[0]);
                room >= 0.5 * (text_width(&l[0], FONT_SIZE) + text_width(&l[1], FONT_SIZE)) + 10.0
            });
        if apart || most <= 2 {
            return ticks;
        }
        most -= 1;
    }
}
