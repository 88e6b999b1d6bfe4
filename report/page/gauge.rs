//! A gauge of a value relative to its limit, small enough for a table cell.

use super::Tone;
use crate::plot::{Scale, Spacing};

/// Width and height of the drawing, in CSS pixels.
const SIZE: [f64; 2] = [112.0, 10.0];

/// Shares of the limit at the two ends.
const RANGE: [f64; 2] = [1e-6, 10.0];

/// A bar on a logarithmic scale from a millionth of a limit to ten times the limit, with a tick at
/// the limit. A smaller value is a ring at the left end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    share: f64,
    tone: Tone,
}

impl Gauge {
    /// A value as a share of its limit: 1 is just within it.
    #[must_use]
    pub fn new(share: f64, tone: Tone) -> Self {
        Self { share, tone }
    }

    pub(super) fn html(&self) -> String {
        let [width, height] = SIZE;
        let middle = height / 2.0;
        let scale = Scale::new(RANGE, [4.0, width - 4.0], Spacing::Log);
        let place = |share: f64| format!("{:.1}", scale.map_clamped(share));
        let (from, to, limit) = (place(RANGE[0]), place(RANGE[1]), place(1.0));
        let share = if self.share.is_finite() {
            self.share.abs()
        } else {
            f64::MAX
        };
        let colour = match self.tone {
            Tone::Plain => "c-muted",
            Tone::Good => "c-green",
            Tone::Fair => "c-ochre",
            Tone::Bad => "c-vermillion",
        };
        let mark = if share <= RANGE[0] {
            format!("<circle class=\"ring\" cx=\"{from}\" cy=\"{middle}\" r=\"2.6\" />")
        } else {
            let end = place(share);
            format!(
                "<line class=\"bar\" x1=\"{from}\" y1=\"{middle}\" x2=\"{end}\" y2=\"{middle}\" />"
            )
        };
        format!(
            "<svg class=\"gauge {colour}\" viewBox=\"0 0 {width} {height}\" aria-hidden=\"true\">\
             <line class=\"track\" x1=\"{from}\" y1=\"{middle}\" x2=\"{to}\" y2=\"{middle}\" />{mark}\
             <line class=\"limit\" x1=\"{limit}\" y1=\"0.5\" x2=\"{limit}\" y2=\"{}\" /></svg>",
            height - 0.5
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_ends_before_the_limit_exactly_where_the_figure_is_within_it() {
        let end = |share: f64| -> (f64, f64) {
            let html = Gauge::new(share, Tone::Good).html();
            let after = |mark: &str, name: &str| -> f64 {
                let text = html.split_once(mark).unwrap().1;
                let text = text.split_once(name).unwrap().1;
                text.split('"').nth(1).unwrap().parse().unwrap()
            };
            (
                after("class=\"bar\"", "x2="),
                after("class=\"limit\"", "x1="),
            )
        };
        for share in [1e-4, 0.5, 0.9] {
            let (bar, limit) = end(share);
            assert!(bar < limit, "{share}");
        }
        for share in [1.2, 30.0, f64::INFINITY, f64::NAN] {
            let (bar, limit) = end(share);
            assert!(bar > limit && bar <= SIZE[0], "{share}");
        }
        assert!(Gauge::new(0.0, Tone::Good).html().contains("ring"));
    }
}
