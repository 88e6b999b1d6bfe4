//! The rows above a plot: the y axis' label, the legend, and lanes for marker labels.
//!
//! Estimated text widths determine all positions, so that no two texts overlap, whatever the data.
//! The legend flows into as many rows as it needs, and a marker label that would overlap another
//! one moves up a lane.

use super::{Colour, Dash, FONT_SIZE, coordinate};
use crate::markup::{escape, fit, text_width};

/// Height of a row of the key, in SVG units.
const ROW: f64 = 19.0;
/// Width of the sample of a line or mark, in SVG units.
const KEY_WIDTH: f64 = 20.0;
/// Distance from the sample to its name, in SVG units.
const KEY_GAP: f64 = 6.0;
/// Distance between two items of the key, in SVG units.
const ITEM_GAP: f64 = 16.0;
/// Distance from a label to what it labels, in SVG units.
const LABEL_GAP: f64 = 9.0;

/// How a legend entry is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Key {
    Line(Dash),
    /// A broad, faint line: its width and opacity.
    Broad(f64, f64),
    Fill(f64),
    Dot(f64),
    /// Faint to strong dots: time.
    Fade,
}

/// One entry of the legend.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) key: Key,
    pub(crate) colour: Colour,
    pub(crate) text: String,
}

/// A label to be placed above `x`.
#[derive(Clone, Debug)]
pub(crate) struct Above {
    pub(crate) x: f64,
    pub(crate) text: String,
    pub(crate) colour: Colour,
}

/// The rows above the plot, drawn, and their height.
pub(crate) struct Header {
    pub(crate) svg: String,
    pub(crate) height: f64,
}

/// Lays out the rows above a plot of `width`.
pub(crate) fn layout(width: f64, y_label: &str, entries: &[Entry], above: &[Above]) -> Header {
    let mut svg = String::new();

    // The legend shares the y label's row if it fits.
    let y_label = fit(y_label, FONT_SIZE, width);
    let mut baseline = FONT_SIZE;
    let mut x = 0.0;
    if !y_label.is_empty() {
        svg.push_str(&format!(
            "<text class=\"axis-label\" x=\"0\" y=\"{}\">{}</text>",
            coordinate(baseline),
            escape(&y_label)
        ));
        x = text_width(&y_label, FONT_SIZE) + 1.4 * ITEM_GAP;
    }
    let mut at_row_start = x == 0.0;
    // A legend that needs several rows starts on a row of its own.
    let total: f64 = entries.iter().map(|e| item_width(&e.text)).sum::<f64>()
        + ITEM_GAP * entries.len().saturating_sub(1) as f64;
    if !entries.is_empty() && !at_row_start && x + total > width {
        (x, baseline, at_row_start) = (0.0, baseline + ROW, true);
    }
    for entry in entries {
        let text = fit(&entry.text, FONT_SIZE, width - KEY_WIDTH - KEY_GAP);
        let needed = item_width(&text);
        if !at_row_start && x + needed > width {
            (x, baseline) = (0.0, baseline + ROW);
        }
        svg.push_str(&key(entry, x, baseline - 0.35 * FONT_SIZE));
        svg.push_str(&format!(
            "<text x=\"{}\" y=\"{}\">{}</text>",
            coordinate(x + KEY_WIDTH + KEY_GAP),
            coordinate(baseline),
            escape(&text)
        ));
        x += needed + ITEM_GAP;
        at_row_start = false;
    }
    let mut height = if y_label.is_empty() && entries.is_empty() {
        4.0
    } else {
        baseline + 13.0
    };

    // Marker labels, left to right; lane 0 is next to the plot.
    let placed = lanes(width, above);
    if !placed.is_empty() {
        height -= 4.0;
    }
    let count = placed.iter().map(|p| p.lane + 1).max().unwrap_or(0);
    for label in &placed {
        let y = height + ROW * (count - label.lane) as f64 - 5.0;
        svg.push_str(&format!(
            "<text class=\"mark-label {}\" x=\"{}\" y=\"{}\">{}</text>",
            label.colour.class(),
            coordinate(label.left),
            coordinate(y),
            escape(&label.text)
        ));
    }
    height += ROW * count as f64;
    Header { svg, height }
}

fn item_width(text: &str) -> f64 {
    KEY_WIDTH + KEY_GAP + text_width(text, FONT_SIZE)
}

/// A marker label with its position: left edge, right edge, lane counted upwards from the plot.
#[derive(Debug)]
struct Placed {
    text: String,
    colour: Colour,
    left: f64,
    right: f64,
    lane: usize,
}

fn lanes(width: f64, above: &[Above]) -> Vec<Placed> {
    let mut order: Vec<&Above> = above
        .iter()
        .filter(|a| a.x.is_finite() && !a.text.is_empty())
        .collect();
    order.sort_by(|a, b| a.x.total_cmp(&b.x));
    let mut placed: Vec<Placed> = Vec::with_capacity(order.len());
    for label in order {
        let text = fit(&label.text, FONT_SIZE, width);
        let wide = text_width(&text, FONT_SIZE);
        let left = (label.x - 0.5 * wide).clamp(0.0, (width - wide).max(0.0));
        let right = left + wide;
        // Take the lowest lane without an overlap.
        let lane = (0..)
            .find(|&lane| {
                placed
                    .iter()
                    .filter(|p| p.lane == lane)
                    .all(|p| left > p.right + LABEL_GAP || right < p.left - LABEL_GAP)
            })
            .unwrap_or(placed.len());
        placed.push(Placed {
            text,
            colour: label.colour,
            left,
            right,
            lane,
        });
    }
    placed
}

fn key(entry: &Entry, x: f64, y: f64) -> String {
    let class = entry.colour.class();
    let (x1, y0) = (coordinate(x + KEY_WIDTH), coordinate(y));
    match entry.key {
        Key::Line(dash) => {
            format!("<path class=\"line {class}\" d=\"M{} {y0}H{x1}\"{}/>", coordinate(x), dash.attribute())
        }
        Key::Broad(wide, opacity) => format!(
            "<path class=\"line {class}\" d=\"M{} {y0}H{x1}\" stroke-opacity=\"{}\" style=\"stroke-width:{}\"/>",
            coordinate(x),
            coordinate(opacity),
            coordinate(wide),
        ),
        Key::Fill(opacity) => format!(
            "<rect class=\"fill {class}\" x=\"{}\" y=\"{}\" width=\"{KEY_WIDTH}\" height=\"10\" rx=\"1.5\" fill-opacity=\"{}\"/>",
            coordinate(x),
            coordinate(y - 5.0),
            coordinate(opacity.max(0.2)),
        ),
        Key::Dot(opacity) => format!(
            "<circle class=\"fill {class}\" cx=\"{}\" cy=\"{y0}\" r=\"3\" fill-opacity=\"{}\"/>",
            coordinate(x + 0.5 * KEY_WIDTH),
            coordinate(opacity)
        ),
        Key::Fade => (0..3)
            .map(|i| {
                format!(
                    "<circle class=\"fill {class}\" cx=\"{}\" cy=\"{y0}\" r=\"3\" fill-opacity=\"{}\"/>",
                    coordinate(x + 3.0 + 7.0 * f64::from(i)),
                    coordinate(0.3 + 0.35 * f64::from(i))
                )
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marker_labels_never_touch_and_stay_inside() {
        let above: Vec<Above> = [10.0, 12.0, 14.0, 200.0, 399.0, f64::NAN]
            .iter()
            .map(|&x| Above {
                x,
                text: "truth 0.0600".to_owned(),
                colour: Colour::Ink,
            })
            .collect();
        let placed = lanes(400.0, &above);
        assert_eq!(placed.len(), 5);
        for (i, a) in placed.iter().enumerate() {
            assert!(a.left >= 0.0 && a.right <= 400.0);
            for b in &placed[i + 1..] {
                assert!(
                    a.lane != b.lane || a.right < b.left || b.right < a.left,
                    "{a:?} meets {b:?}"
                );
            }
        }
    }

    #[test]
    fn a_long_legend_flows_into_rows() {
        let entries: Vec<Entry> = (0..6)
            .map(|i| Entry {
                key: Key::Dot(1.0),
                colour: Colour::Blue,
                text: format!("a rather long entry {i}"),
            })
            .collect();
        let one = layout(420.0, "tilt (°)", &entries[..1], &[]);
        let all = layout(420.0, "tilt (°)", &entries, &[]);
        assert!(all.height > one.height + 2.0 * ROW);
    }
}
