//! Links a plot over time to the 3-D view, and lets scripts read its drawing.

use super::coordinate;
use crate::markup::escape;

/// Link of a plot over time to the 3-D view: the episode, and the start of its time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Clock {
    /// Episode; empty for the one being played.
    pub(super) take: String,
    /// Value of the plot's axis at the episode's first row, s.
    pub(super) start: f64,
}

impl Clock {
    /// Attributes of a plot whose time axis spans `domain`, whose other axis, `label`, spans
    /// `range`, and whose box has these edges.
    pub(super) fn attributes(
        &self,
        domain: [f64; 2],
        (label, range): (&str, [f64; 2]),
        area: [f64; 4],
    ) -> String {
        let [from, to] = domain.map(|t| t - self.start);
        let edges = area.map(coordinate).join(" ");
        if !(from.is_finite() && to.is_finite()) {
            return String::new();
        }
        let take = escape(&self.take);
        let (start, [low, high], label) = (self.start, range, escape(label));
        format!(
            " data-take=\"{take}\" data-clock=\"{from} {to} {edges}\" data-start=\"{start}\" \
             data-range=\"{low} {high}\" data-label=\"{label}\""
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_count_from_the_first_row_of_the_episode() {
        let clock = Clock {
            take: "a \"b\"".into(),
            start: 10.0,
        };
        let area = [44.0, 20.0, 406.0, 190.5];
        assert_eq!(
            clock.attributes([10.0, 12.5], ("x (m)", [-1.0, 1.0]), area),
            " data-take=\"a &quot;b&quot;\" data-clock=\"0 2.5 44 20 406 190.5\" data-start=\"10\" \
             data-range=\"-1 1\" data-label=\"x (m)\""
        );
        let nowhere = clock.attributes([f64::NAN, 1.0], ("", [0.0, 1.0]), area);
        assert_eq!(nowhere, "");
    }
}
