//! The posterior of an unknown that is 0 or 1.

use super::super::trace::ParameterReport;
use crate::number::decimals;
use crate::plot::{Axis, Chart, Colour, Layer, Weighted};

/// Two pairs of bars for a binary parameter.
pub(super) fn bars(p: &ParameterReport, prior: f64) -> Option<Chart> {
    let after = match Weighted::new(&p.samples, &p.weights) {
        Some(weighted) => weighted.mean(),
        None => p.estimate,
    };
    if !after.is_finite() {
        return None;
    }
    let pair = |one: f64, x: f64| vec![[x, x + 0.3, 1.0 - one], [1.0 + x, 1.3 + x, one]];
    let x_axis = Axis::new(&p.name, "")
        .domain([-0.5, 1.5])
        .marks(vec![(0.0, "0".to_owned()), (1.0, "1".to_owned())]);
    let mut chart = Chart::new(
        &format!("Posterior of {}", p.name),
        x_axis,
        Axis::new("probability", "").domain([0.0, 1.0]),
    )
    .description(format!(
        "Probability of 1: {} before, {} after.",
        decimals(prior, 2),
        decimals(after, 2)
    ))
    .layer(
        Layer::bars(pair(prior, -0.3))
            .colour(Colour::Muted)
            .opacity(0.35)
            .label("prior"),
    )
    .layer(
        Layer::bars(pair(after, 0.0))
            .colour(Colour::Blue)
            .label("posterior"),
    );
    if let Some(truth) = p.truth {
        chart = chart.layer(
            Layer::vertical(truth)
                .colour(Colour::Ink)
                .dashed()
                .label("truth"),
        );
    }
    Some(chart)
}
