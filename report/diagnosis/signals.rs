//! Held-out episodes signal by signal: real against simulated readings, and the residuals.

use asid_results::diagnosis::DiagnosisResult;
use asid_results::trace::{DiagnosisTrace, SignalTrace};

use super::head::refined;
use super::lines::{MOST_DOTS, around_zero, dots, finite, lone, reach, span, stretches};
use super::words::{count, gap};
use crate::number::{quantity, significant};
use crate::page::{Figure, Section};
use crate::plot::{Axis, Chart, Colour, Layer};

/// Number of pictures that are unfolded: as many as a reader looks through.
const UNFOLDED: usize = 6;
/// Number of pictures that are folded away; more would make the page slow.
const FOLDED: usize = 48;

/// Room for tick labels, the same for both plots of a figure, in SVG units.
const GUTTER: f64 = 44.0;

/// What the pictures show of the three models.
#[derive(Clone, Copy)]
struct Shown {
    nominal: bool,
    refined: bool,
}

pub(super) fn section(d: &DiagnosisResult, t: &DiagnosisTrace) -> Section {
    let section = Section::new("Real against simulated");
    if t.signals.is_empty() {
        return section.note("No pictures: the diagnosis kept no readings of held-out episodes.");
    }
    let shown = Shown {
        nominal: t.signals.iter().any(|s| differ(&s.nominal, &s.identified)),
        refined: refined(d),
    };
    let mut section = section.lead(lead(shown));
    let order = by_gap(&t.signals);
    let mut room = UNFOLDED;
    let mut left = FOLDED;
    let mut untold = 0;
    for (i, episode) in episodes(&t.signals).into_iter().enumerate() {
        let mut traces: Vec<&SignalTrace> =
            t.signals.iter().filter(|s| s.episode == episode).collect();
        traces.sort_by_key(|s| order.iter().position(|o| *o == s.signal));
        // A later episode is unfolded only as a whole.
        let open = match (i, traces.len() <= room) {
            (0, _) => traces.len().min(room),
            (_, true) => traces.len(),
            _ => 0,
        };
        room -= open;
        if open > 0 {
            section = section
                .heading(format!("Episode {episode}"))
                .figures(traces[..open].iter().map(|s| figure(s, shown)).collect());
        } else {
            room = 0;
        }
        let folded = (traces.len() - open).min(left);
        left -= folded;
        untold += traces.len() - open - folded;
        if folded > 0 {
            let more = if open > 0 { "more " } else { "" };
            let summary = format!(
                "Episode {episode}: {}",
                count(folded, &format!("{more}signal"))
            );
            let figures = traces[open..open + folded].iter().map(|s| figure(s, shown));
            section = section.folded(summary, Section::new("").figures(figures.collect()));
        }
    }
    if untold > 0 {
        section = section.note(format!(
            "{untold} more pictures are left out; their data are in trace.json."
        ));
    }
    section
}

fn lead(shown: Shown) -> String {
    let mut text = "Episodes held out: no fit saw them. The recorded commands are replayed open-loop from the start. Faint dots, or a broad \
                    faint line: the real readings."
        .to_owned();
    if shown.nominal {
        text.push_str(" Dotted: the nominal model.");
    }
    text.push_str(" Dashed: the identified model.");
    if shown.refined {
        text.push_str(" Solid: the refined model.");
    }
    text.push_str(
        " Beneath: real minus simulated, in units of the sensor's noise; what is left of a complete model stays in the shaded band \
         and has no pattern. Signals with the largest gap come first.",
    );
    text
}

/// Names of the episodes, in the order given.
fn episodes(signals: &[SignalTrace]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for signal in signals {
        if !names.contains(&&*signal.episode) {
            names.push(&signal.episode);
        }
    }
    names
}

/// Names of the signals, largest gap of the identified model first.
fn by_gap(signals: &[SignalTrace]) -> Vec<&str> {
    let mut gaps: Vec<(&str, f64)> = Vec::new();
    for signal in signals {
        let gap = signal.gap(&signal.identified);
        let gap = if gap.is_nan() { 0.0 } else { gap };
        match gaps.iter_mut().find(|g| g.0 == signal.signal) {
            Some(known) => known.1 = known.1.max(gap),
            None => gaps.push((&signal.signal, gap)),
        }
    }
    gaps.sort_by(|a, b| b.1.total_cmp(&a.1));
    gaps.into_iter().map(|g| g.0).collect()
}

/// Whether two simulations differ.
fn differ(a: &[f64], b: &[f64]) -> bool {
    a.len() != b.len() || a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-12)
}

fn figure(trace: &SignalTrace, shown: Shown) -> Figure {
    let [nominal, identified, refined] =
        [&trace.nominal, &trace.identified, &trace.refined].map(|s| trace.gap(s));
    let told = |gap_or_unit: f64| {
        if trace.has_noise() {
            gap(gap_or_unit)
        } else {
            quantity(&significant(gap_or_unit, 2), &trace.unit)
        }
    };
    let mut steps = Vec::new();
    if shown.nominal {
        steps.push(format!("nominal {}", told(nominal)));
    }
    steps.push(format!("identified {}", told(identified)));
    if shown.refined {
        steps.push(format!("refined {}", told(refined)));
    }
    let noise = if trace.has_noise() {
        format!(
            ", in units of the noise ({})",
            quantity(&significant(trace.noise, 2), &trace.unit)
        )
    } else {
        String::new()
    };
    let (chart, outside) = readings(trace, shown);
    let outside = match &outside[..] {
        [] => String::new(),
        [name] => format!(" The curve of the {name} model runs off the plot."),
        names => format!(
            " The curves of the {} models run off the plot.",
            names.join(" and ")
        ),
    };
    let caption = format!(
        "Root mean square error{noise}: {}.{outside}",
        steps.join(", ")
    );
    Figure::new(
        trace.signal.clone(),
        chart.description(caption.clone()),
        caption,
    )
    .beneath(residuals(trace, shown))
}

/// The time axis, the same for both plots of a figure.
fn times(label: &str, trace: &SignalTrace) -> Axis {
    let axis = Axis::new(label, if label.is_empty() { "" } else { "s" });
    match span(&trace.time) {
        Some(span) => axis.domain(span),
        None => axis,
    }
}

/// Time of the episode's first row, s.
fn start(trace: &SignalTrace) -> f64 {
    trace.time.first().copied().unwrap_or(0.0)
}

/// The readings with the simulations, and the models that leave the picture.
fn readings(trace: &SignalTrace, shown: Shown) -> (Chart, Vec<&'static str>) {
    let models = [
        ("nominal", &trace.nominal, shown.nominal),
        ("identified", &trace.identified, true),
        ("refined", &trace.refined, shown.refined),
    ];
    let simulated = models.iter().filter(|m| m.2).map(|m| &m.1[..]);
    let domain = reach(
        &trace.real,
        simulated,
        if trace.has_noise() { trace.noise } else { 0.0 },
    );
    let outside = |values: &[f64]| {
        domain.is_some_and(|[low, high]| values.iter().any(|v| *v < low || *v > high))
    };
    let left = (models.iter())
        .filter(|m| m.2 && outside(m.1))
        .map(|m| m.0)
        .collect();

    let axis = Axis::new(&trace.signal, &trace.unit);
    let axis = match domain {
        Some(domain) => axis.domain(domain),
        None => axis,
    };
    let points = stretches(&trace.time, &trace.real);
    let real = if finite(&points) <= MOST_DOTS || lone(&points) > finite(&points) / 20 {
        Layer::dots(dots(&points)).radius(2.8).opacity(0.4)
    } else {
        Layer::line(points).width(5.5).opacity(0.3)
    };
    let line = |values: &[f64]| Layer::line(stretches(&trace.time, values));
    let mut chart = Chart::new(
        &format!("{}: real and simulated", trace.signal),
        times("", trace),
        axis.gutter(GUTTER),
    )
    .height(170.0)
    .clock(&trace.episode, start(trace))
    .layer(real.label("real"));
    if shown.nominal {
        chart = chart.layer(
            line(&trace.nominal)
                .colour(Colour::Muted)
                .dotted()
                .label("nominal"),
        );
    }
    chart = chart.layer(
        line(&trace.identified)
            .colour(Colour::Vermillion)
            .dashed()
            .label("identified"),
    );
    if shown.refined {
        chart = chart.layer(line(&trace.refined).colour(Colour::Blue).label("refined"));
    }
    (chart, left)
}

/// Residuals before and after identification.
fn residuals(trace: &SignalTrace, shown: Shown) -> Chart {
    let before = trace.residuals(&trace.identified);
    let after = trace.residuals(&trace.refined);
    let label = if trace.has_noise() {
        Axis::new("residual / noise", "")
    } else {
        Axis::new("residual", &trace.unit)
    };
    let all = before.iter().chain(after.iter().filter(|_| shown.refined));
    let least = if trace.has_noise() { 3.0 } else { 0.0 };
    let chart = Chart::new(
        &format!("{}: residuals", trace.signal),
        times("time", trace),
        label
            .gutter(GUTTER)
            .domain(around_zero(all.copied(), least)),
    )
    .description("Real minus simulated, before and after the effects are added.")
    .height(84.0)
    .clock(&trace.episode, start(trace));
    let chart = match span(&trace.time) {
        Some([first, last]) if trace.has_noise() => chart.layer(
            Layer::band(vec![[first, -2.0, 2.0], [last, -2.0, 2.0]])
                .colour(Colour::Green)
                .label("± 2 × noise"),
        ),
        _ => chart,
    };
    let line = |values: &[f64]| Layer::line(stretches(&trace.time, values)).width(1.3);
    let chart = chart.layer(line(&before).colour(Colour::Vermillion));
    if shown.refined {
        chart.layer(line(&after).colour(Colour::Blue))
    } else {
        chart
    }
}
