//! The missing force against time, speed, position and load, with the fitted law.

use asid_results::diagnosis::DiagnosisResult;
use asid_results::trace::{DiagnosisTrace, ForceSeries, ForceTrace};

use super::head::refined;
use super::lines::{finite, stretches};
use crate::number::{quantity, significant};
use crate::page::{Figure, Section};
use crate::plot::{Axis, Chart, Colour, Layer};

/// Degrees of freedom that are unfolded; the others are folded away.
const UNFOLDED: usize = 2;
/// Room for tick labels, in SVG units, the same for the plots of a figure.
const GUTTER: f64 = 44.0;
/// Fewest points for which a scatter plot is drawn.
const FEWEST: usize = 8;
/// Spread of a column, relative to its largest magnitude, below which a plot against it shows
/// nothing.
const SPREAD: f64 = 1e-3;

pub(super) fn section(d: &DiagnosisResult, t: &DiagnosisTrace) -> Option<Section> {
    if t.forces.is_empty() {
        return None;
    }
    let law = refined(d) && t.forces.iter().any(|f| finite_in(&f.spread.law));
    let mut section = Section::new("The force that is missing").lead(lead(law));
    let (open, folded) = t.forces.split_at(t.forces.len().min(UNFOLDED));
    for force in open {
        section = section
            .heading(heading(d, force, law))
            .figures(figures(force, law));
    }
    if !folded.is_empty() {
        let names: Vec<&str> = folded.iter().map(|f| &*f.dof).collect();
        let summary = format!("Where less is missing: {}", names.join(", "));
        let inner = folded.iter().fold(Section::new(""), |inner, force| {
            inner
                .heading(heading(d, force, law))
                .figures(figures(force, law))
        });
        section = section.folded(summary, inner);
    }
    Some(section)
}

fn lead(law: bool) -> String {
    let mut text = "The generalized force that the identified model lacks, as a Kalman smoother estimates it at each row of the training logs. Where it \
                    lies on a curve against speed, position or load, that curve is the law that the model lacks: a step at speed \
                    zero is dry friction, a slope against speed viscous friction, a slope against position a spring, a band that \
                    widens with the load friction of a gear."
        .to_owned();
    if law {
        text.push_str(
            " Blue: the force that the refined model adds at the same rows. If the cause is right, it follows the missing force in every plot.",
        );
    }
    text
}

fn finite_in(values: &[f64]) -> bool {
    values.iter().any(|x| x.is_finite())
}

/// The degree of freedom, and how much force is missing there before and after.
fn heading(d: &DiagnosisResult, force: &ForceTrace, law: bool) -> String {
    let Some(m) = d.missing_force.iter().find(|m| m.dof == force.dof) else {
        return force.dof.clone();
    };
    let told = |x: f64| quantity(&significant(x, 2), &m.unit);
    if law {
        let (before, after) = (told(m.identified), told(m.refined));
        format!("{}: {before} is missing, {after} is left", force.dof)
    } else {
        format!("{}: {} is missing", force.dof, told(m.identified))
    }
}

fn figures(force: &ForceTrace, law: bool) -> Vec<Figure> {
    let speed = format!("{}/s", force.position_unit);
    let spread = &force.spread;
    let clouds = [
        ("speed", "speed", &*speed, &spread.speed),
        (
            "position",
            if force.position_unit == "rad" {
                "angle"
            } else {
                "position"
            },
            &*force.position_unit,
            &spread.position,
        ),
        ("load", "force of the drives", &*force.unit, &spread.load),
    ];
    let clouds = clouds.into_iter().filter(|(.., x)| varies(x));
    let clouds = clouds.map(|(what, label, unit, x)| cloud(force, law, what, (label, unit, x)));
    std::iter::once(against_time(force, law))
        .chain(clouds)
        .collect()
}

/// Whether a column has enough distinct values for a plot against it.
fn varies(x: &[f64]) -> bool {
    let there = || x.iter().copied().filter(|x| x.is_finite());
    let [low, high] = there().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| {
        [l.min(x), h.max(x)]
    });
    there().count() >= FEWEST && high - low > SPREAD * low.abs().max(high.abs())
}

fn force_axis(force: &ForceTrace) -> Axis {
    Axis::new("missing force", &force.unit).gutter(GUTTER)
}

fn against_time(force: &ForceTrace, law: bool) -> Figure {
    let ForceSeries {
        time,
        before,
        after,
        law: added,
        ..
    } = &force.stretch;
    let line = |values: &[f64]| Layer::line(stretches(time, values));
    let mut chart = Chart::new(
        &format!("{}: missing force against time", force.dof),
        Axis::new("time", "s"),
        force_axis(force),
    )
    .clock(&force.episode, 0.0)
    .layer(line(before).width(5.0).opacity(0.3).label("missing"));
    let mut caption = format!("Episode {}.", force.episode);
    if law {
        let added = line(added).colour(Colour::Blue);
        chart = chart.layer(added.label("added by the effects"));
    }
    if law && finite_in(after) {
        let left = line(after).colour(Colour::Vermillion).dashed();
        chart = chart.layer(left.label("left"));
        caption.push_str(" Dashed: the missing force that remains with the effects in the model.");
    }
    Figure::new("Against time", chart.description(caption.clone()), caption)
}

/// The missing force over a column, with the law over the same column.
fn cloud(
    force: &ForceTrace,
    law: bool,
    what: &str,
    (label, unit, x): (&str, &str, &[f64]),
) -> Figure {
    let points = |y: &[f64]| -> Vec<[f64; 2]> {
        let pairs = x.iter().zip(y).map(|(x, y)| [*x, *y]);
        pairs.filter(|p| p.iter().all(|x| x.is_finite())).collect()
    };
    let missing = points(&force.spread.before);
    let added = points(&force.spread.law);
    let mut chart = Chart::new(
        &format!("{}: missing force against {what}", force.dof),
        Axis::new(label, unit),
        force_axis(force),
    )
    .layer(
        Layer::dots(missing)
            .radius(2.6)
            .opacity(0.35)
            .label("missing"),
    );
    if law && finite(&added) > 0 {
        chart = chart.layer(
            Layer::dots(added)
                .colour(Colour::Blue)
                .radius(1.7)
                .opacity(0.8)
                .label("added by the effects"),
        );
    }
    let caption = if what == "load" {
        "Each dot is a row of a training log. The force of the drives is that of the model under the recorded commands."
    } else {
        "Each dot is a row of a training log."
    };
    Figure::new(
        format!("Against {label}"),
        chart.description(caption),
        caption,
    )
}
