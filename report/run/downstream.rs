//! The task itself: the metric over time, how the action was found, and the final state.

use std::collections::BTreeMap;

use super::episode::outline_of;
use super::head::{metric_name, metric_value};
use super::trace::{Downstream, RunReport, Search, SideView};
use crate::markup::capitalise;
use crate::number::{Precision, grouped, quantity, round, significant};
use crate::page::{Figure, Section};
use crate::plot::{Axis, Chart, Colour, Layer, Plan, Weighted};

pub(super) fn section(report: &RunReport) -> Option<Section> {
    let predicted = report.predicted();
    let section = Section::new(if predicted {
        "The task, as predicted"
    } else {
        "The task, zero-shot"
    });
    let Some(downstream) = &report.downstream else {
        if !report.stage.is_empty() {
            return None;
        }
        return Some(section.note("No downstream part: the run ended before the task was tried."));
    };
    let mut section = section.lead(lead(downstream, predicted));
    let mut figures = Vec::new();
    if downstream.time.is_empty() {
        section = section.note("No metric over time was kept.");
    } else {
        figures.push(over_time(downstream));
    }
    figures.extend(
        downstream
            .side_view
            .as_ref()
            .map(|view| side(view, downstream, predicted)),
    );
    match &downstream.search {
        Some(search) => figures.extend((0..search.chosen.len()).map(|i| tried(search, i))),
        None => section = section.note("No search to show: the solver kept no trials."),
    }
    Some(section.figures(figures))
}

fn lead(d: &Downstream, predicted: bool) -> String {
    let rule = if d.rule.is_empty() {
        String::new()
    } else {
        format!(" Success means {}.", d.rule)
    };
    let where_done = if predicted {
        "Done once in the simulator at the estimate"
    } else {
        "Done once in the real world with what was learnt"
    };
    format!(
        "{where_done}: {} is {}, {}.{rule}",
        metric_name(d),
        metric_value(d),
        if d.success {
            "a success"
        } else {
            "not a success"
        }
    )
}

fn over_time(d: &Downstream) -> Figure {
    let name = metric_name(d);
    let points: Vec<[f64; 2]> = d
        .time
        .iter()
        .zip(&d.metric_over_time)
        .map(|(&t, &v)| [t, v])
        .collect();
    let title = format!("{name} over the task");
    let spans = d.phases.iter().enumerate().map(|(i, phase)| {
        // Alternate the shade of neighbouring phases.
        Layer::span(phase.start, phase.end, &phase.name).opacity(if i % 2 == 0 {
            0.07
        } else {
            0.15
        })
    });
    let mut chart = Chart::new(
        &title,
        Axis::new("time", "s"),
        Axis::new(&name, &d.unit).zero(),
    )
    .layers(spans);
    if let Some(limit) = d.threshold.filter(|l| l.is_finite()) {
        let label = format!("limit {}", quantity(&round(limit, 3), &d.unit));
        chart = chart.layer(
            Layer::horizontal(limit)
                .colour(Colour::Vermillion)
                .dashed()
                .label(label),
        );
    }
    chart = chart.layer(Layer::line(points.clone()).colour(Colour::Blue).label(name));
    let peak = points
        .iter()
        .map(|p| p[1])
        .filter(|v| v.is_finite())
        .fold(f64::NAN, f64::max);
    let phases = if d.phases.is_empty() {
        ""
    } else {
        "; shades are the phases of the motion"
    };
    let caption = format!(
        "Peak {}; final value {}{phases}.",
        quantity(&significant(peak, 2), &d.unit),
        metric_value(d)
    );
    Figure::new(
        capitalise(&title),
        chart.description(caption.clone()),
        caption,
    )
}

/// Cost of the actions tried against one dimension of the action.
fn tried(search: &Search, dimension: usize) -> Figure {
    let chosen = &search.chosen[dimension];
    let cost = if search.cost_label.is_empty() {
        "cost"
    } else {
        &search.cost_label
    };
    let title = format!(
        "{} of the actions tried, by {}",
        capitalise(cost),
        chosen.name
    );
    let iterations = search.trials.iter().map(|t| t.iteration).max().unwrap_or(0);
    let mut chart = Chart::new(
        &title,
        Axis::new(&chosen.name, &chosen.unit),
        Axis::new(cost, &search.cost_unit),
    );
    let mut labelled = false;
    let mut tried: BTreeMap<u32, Vec<[f64; 2]>> = BTreeMap::new();
    for trial in &search.trials {
        if let Some(&place) = trial.action.get(dimension) {
            let dots = tried.entry(trial.iteration).or_default();
            dots.push([place, trial.cost]);
        }
    }
    for (iteration, dots) in tried {
        let share = f64::from(iteration) / f64::from(iterations.max(1));
        let mut layer = Layer::dots(dots)
            .colour(Colour::Blue)
            .radius(2.2)
            .opacity(0.2 + 0.6 * share);
        if iteration == iterations && !labelled {
            let text = if iterations > 0 {
                "tried (late is stronger)"
            } else {
                "tried"
            };
            layer = layer.label(text);
            labelled = true;
        }
        chart = chart.layer(layer);
    }
    let resolution = spread(search, dimension);
    let value = resolution.map_or_else(
        || significant(chosen.value, 3),
        |r| Precision::of(chosen.value, r).show(chosen.value),
    );
    chart = chart.layer(
        Layer::vertical(chosen.value)
            .colour(Colour::Ink)
            .label(format!("chosen {value}")),
    );
    let caption = format!(
        "{} actions in {} iterations of the solver, in the simulator; chosen: {} = {}.",
        grouped(search.trials.len() as u64),
        u64::from(iterations) + 1,
        chosen.name,
        quantity(&value, &chosen.unit)
    );
    Figure::new(title, chart.description(caption.clone()), caption)
}

/// A tenth of the spread of the tried actions: the precision needed for the chosen one.
fn spread(search: &Search, dimension: usize) -> Option<f64> {
    let values: Vec<f64> = search
        .trials
        .iter()
        .filter_map(|t| t.action.get(dimension).copied())
        .collect();
    Some(0.1 * Weighted::new(&values, &[])?.std()).filter(|s| *s > 0.0)
}

fn side(view: &SideView, d: &Downstream, predicted: bool) -> Figure {
    let world = if predicted { "simulator" } else { "real world" };
    let label = if view.x_label.is_empty() {
        "along"
    } else {
        &view.x_label
    };
    let mut plan = Plan::new(
        "The end of the task seen from the side",
        Axis::new(label, "m"),
        Axis::new("height", "m"),
    )
    .description(format!("{} is {}.", metric_name(d), metric_value(d)));
    if let Some(floor) = view.floor.filter(|f| f.is_finite()) {
        plan = plan.floor(floor);
    }
    for shape in &view.shapes {
        plan = plan.outline(outline_of(shape));
    }
    let caption = format!(
        "The final scene in the {world}, both axes to the same scale; {} {}.",
        metric_name(d),
        metric_value(d)
    );
    Figure::new("The end, seen from the side", plan, caption)
}
