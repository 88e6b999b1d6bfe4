//! What the exploration gathered, and how its policy was found.

use super::trace::{ExpectedStd, Exploration, LearningCurve, RunReport};
use crate::number::{decimals, quantity, significant};
use crate::page::{Figure, Section};
use crate::plot::{Axis, Chart, Colour, Layer};

pub(super) fn section(report: &RunReport) -> Option<Section> {
    if report.explorer.is_empty() && report.exploration.is_none() && report.learning.is_none() {
        return None;
    }
    let mut section = Section::new("Exploration");
    let mut figures = Vec::new();
    match &report.exploration {
        Some(exploration) => {
            let episode = if report.predicted() {
                "predicted"
            } else {
                "real"
            };
            section = section.lead(lead(exploration, episode));
            if !exploration.gained.is_empty() {
                figures.push(gained(exploration));
            }
            figures.extend(
                exploration
                    .expected_std
                    .iter()
                    .filter(|e| !e.value.is_empty())
                    .map(|e| expected(e, exploration)),
            );
        }
        None => {
            section = section.note("No information per step: it was not computed for this run.")
        }
    }
    match &report.learning {
        Some(curve) if !curve.x.is_empty() => figures.push(learning(curve)),
        _ => {
            section = section.note(format!(
                "No learning curve: {} does not plan or learn.",
                name(report)
            ))
        }
    }
    Some(section.figures(figures))
}

fn name(report: &RunReport) -> &str {
    if report.explorer.is_empty() {
        "the explorer"
    } else {
        &report.explorer
    }
}

fn lead(exploration: &Exploration, episode: &str) -> String {
    let mut text = match (exploration.objective.as_str(), exploration.form.as_str()) {
        ("", _) => format!("Fisher information of the {episode} episode."),
        (objective, "") => {
            format!(
                "Fisher information of the {episode} episode. The explorer's own objective is {objective}."
            )
        }
        (objective, form) => format!(
            "Fisher information of the {episode} episode, measured as that of every explorer: with {}. \
             The explorer's own objective is {objective}.",
            match form {
                "one-step" => "the sensitivities of one control step at a time",
                "trajectory" => "sensitivities from the episode's start on",
                other => other,
            }
        ),
    };
    if let Some(share) = exploration.contact_fraction.filter(|c| c.is_finite()) {
        text.push_str(&format!(
            " The robot touched the object in {} of the control steps.",
            quantity(&decimals(100.0 * share, 0), "%")
        ));
    }
    text
}

fn gained(exploration: &Exploration) -> Figure {
    let total: f64 = exploration.gained.iter().filter(|g| g.is_finite()).sum();
    let largest = exploration
        .gained
        .iter()
        .copied()
        .filter(|g| g.is_finite())
        .fold(0.0, f64::max);
    let enough = exploration
        .gained
        .iter()
        .filter(|g| g.is_finite() && **g >= 0.1 * largest && **g > 0.0)
        .count();
    let steps = step_bars(&exploration.time, &exploration.gained);
    let chart = Chart::new(
        "Information gained in each control step",
        Axis::new("time", "s"),
        Axis::new("information gained", &exploration.gained_unit).zero(),
    )
    .description(format!(
        "{} control steps, {} in all.",
        exploration.gained.len(),
        significant(total, 3)
    ))
    .layer(Layer::bars(steps).colour(Colour::Blue));
    Figure::new(
        "Information gained in each control step",
        chart,
        format!(
            "{} in all; {enough} of {} steps give at least a tenth of what the best one gives.",
            quantity(&significant(total, 3), &exploration.gained_unit),
            exploration.gained.len()
        ),
    )
}

/// Bars `[start, end, value]` from the end times of the steps.
fn step_bars(time: &[f64], value: &[f64]) -> Vec<[f64; 3]> {
    let first = match time {
        [a, b, ..] => a - (b - a),
        [only] => only - only.abs().max(1.0),
        [] => 0.0,
    };
    let starts = std::iter::once(first).chain(time.iter().copied());
    starts
        .zip(time)
        .zip(value)
        .map(|((start, &end), &value)| [start, end, value])
        .collect()
}

fn expected(entry: &ExpectedStd, exploration: &Exploration) -> Figure {
    let start = step_bars(&exploration.time, &entry.value)
        .first()
        .map(|b| b[0]);
    let prior = entry.prior.filter(|p| p.is_finite());
    let mut points: Vec<[f64; 2]> = start.zip(prior).map(|(t, p)| [t, p]).into_iter().collect();
    points.extend(
        exploration
            .time
            .iter()
            .zip(&entry.value)
            .map(|(&t, &v)| [t, v]),
    );
    let title = format!("Expected standard deviation of {} so far", entry.parameter);
    let mut chart = Chart::new(
        &title,
        Axis::new("time", "s"),
        Axis::new("expected std", &entry.unit).zero(),
    )
    .layer(Layer::steps(points).colour(Colour::Blue).label("posterior"));
    if let Some(prior) = prior {
        chart = chart.layer(
            Layer::horizontal(prior)
                .colour(Colour::Muted)
                .dashed()
                .label("prior"),
        );
    }
    let last = entry
        .value
        .iter()
        .rev()
        .copied()
        .find(|v| v.is_finite())
        .unwrap_or(f64::NAN);
    let from = prior.map_or(String::new(), |p| {
        format!(" from {}", quantity(&significant(p, 2), &entry.unit))
    });
    let caption = format!(
        "What the readings so far can tell at best: it falls{from} to {}.",
        quantity(&significant(last, 2), &entry.unit)
    );
    Figure::new(title, chart.description(caption.clone()), caption)
}

fn learning(curve: &LearningCurve) -> Figure {
    let or = |text: &str, default: &str| {
        if text.is_empty() {
            default.to_owned()
        } else {
            text.to_owned()
        }
    };
    let (x_label, y_label) = (
        or(&curve.x_label, "iteration"),
        or(&curve.y_label, "return"),
    );
    let pairs = |values: &[f64]| {
        curve
            .x
            .iter()
            .zip(values)
            .map(|(&x, &y)| [x, y])
            .collect::<Vec<_>>()
    };
    let mut chart = Chart::new(
        "Return while the explorer improves",
        Axis::new(&x_label, ""),
        Axis::new(&y_label, ""),
    );
    if !curve.std.is_empty() {
        let band = pairs(&curve.mean)
            .iter()
            .zip(&curve.std)
            .map(|(p, s)| [p[0], p[1] - s, p[1] + s])
            .collect();
        chart = chart.layer(Layer::band(band).colour(Colour::Blue).label("± std"));
    }
    chart = chart.layer(
        Layer::line(pairs(&curve.mean))
            .colour(Colour::Blue)
            .label("mean"),
    );
    if !curve.best.is_empty() {
        chart = chart.layer(
            Layer::line(pairs(&curve.best))
                .colour(Colour::Vermillion)
                .dashed()
                .label("best"),
        );
    }
    let ends = (
        curve.mean.iter().find(|v| v.is_finite()),
        curve.mean.iter().rev().find(|v| v.is_finite()),
    );
    let caption = match ends {
        (Some(&first), Some(&last)) => {
            format!(
                "The mean {y_label} goes from {} to {}.",
                significant(first, 3),
                significant(last, 3)
            )
        }
        _ => "No finite return.".to_owned(),
    };
    Figure::new(
        "Return while the explorer improves",
        chart.description(caption.clone()),
        caption,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_begin_where_the_one_before_ended() {
        assert_eq!(
            step_bars(&[0.25, 0.5], &[3.0, 4.0]),
            vec![[0.0, 0.25, 3.0], [0.25, 0.5, 4.0]]
        );
        assert_eq!(step_bars(&[], &[1.0]), Vec::<[f64; 3]>::new());
    }
}
