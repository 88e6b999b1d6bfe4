//! How the posterior narrowed, and its final form.

use super::final_density;
use super::trace::{ParameterReport, Prior, RunReport};
use crate::number::{Precision, quantity};
use crate::page::{Figure, Section};
use crate::plot::{Axis, Chart, Colour, Layer, Spacing};

pub(super) fn section(report: &RunReport) -> Option<Section> {
    if report.identifier.is_empty()
        && report
            .parameters
            .iter()
            .all(|p| p.samples.is_empty() && p.narrowing.is_empty())
    {
        return None;
    }
    let mut figures = Vec::new();
    let mut notes = Vec::new();
    for p in &report.parameters {
        if p.narrowing.is_empty() {
            if !matches!(p.prior, Some(Prior::Binary { .. })) && !report.identifier.is_empty() {
                notes.push(format!(
                    "No narrowing of {}: the identifier does not iterate.",
                    p.name
                ));
            }
        } else {
            figures.push(narrowing(p));
        }
        match final_density::figure(p) {
            Some(figure) => figures.push(figure),
            None => notes.push(format!(
                "No posterior of {}: the run has neither samples nor a standard deviation.",
                p.name
            )),
        }
    }
    let mut section = Section::new("Identification")
        .lead("What is believed of each unknown, from the prior through the identifier's iterations to the final posterior.")
        .figures(figures);
    if report.parameters.is_empty() {
        section = section.note("The task has no unknown parameters.");
    }
    Some(notes.into_iter().fold(section, Section::note))
}

/// Spacing of a parameter's axis.
pub(super) fn spacing(p: &ParameterReport) -> Spacing {
    if p.log_scale {
        Spacing::Log
    } else {
        Spacing::Linear
    }
}

fn narrowing(p: &ParameterReport) -> Figure {
    let band = |low: usize, high: usize| {
        p.narrowing
            .iter()
            .map(|n| [f64::from(n.iteration), n.quantiles[low], n.quantiles[high]])
            .collect::<Vec<_>>()
    };
    let median = p
        .narrowing
        .iter()
        .map(|n| [f64::from(n.iteration), n.quantiles[2]])
        .collect();
    let title = format!("{} narrows over the iterations", p.name);
    let mut chart = Chart::new(
        &title,
        Axis::new("iteration", ""),
        Axis::new(&p.name, &p.unit).spacing(spacing(p)),
    )
    .layer(
        Layer::band(band(0, 4))
            .colour(Colour::Blue)
            .opacity(0.16)
            .label("95 %"),
    )
    .layer(
        Layer::band(band(1, 3))
            .colour(Colour::Blue)
            .opacity(0.3)
            .label("50 %"),
    )
    .layer(Layer::line(median).colour(Colour::Blue).label("median"));
    if let Some(truth) = p.truth {
        chart = chart.layer(
            Layer::horizontal(truth)
                .colour(Colour::Ink)
                .dashed()
                .label("truth"),
        );
    }
    let width = |q: &[f64; 5]| q[4] - q[0];
    let caption = match (p.narrowing.first(), p.narrowing.last()) {
        (Some(first), Some(last)) => {
            let precision = Precision::of(width(&first.quantiles), width(&last.quantiles));
            format!(
                "The central 95 % go from {} wide to {} wide.",
                quantity(&precision.show(width(&first.quantiles)), &p.unit),
                quantity(&precision.show(width(&last.quantiles)), &p.unit)
            )
        }
        _ => String::new(),
    };
    Figure::new(title, chart.description(caption.clone()), caption)
}
