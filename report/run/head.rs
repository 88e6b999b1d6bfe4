//! The top of the page: what ran, the answer, the key figures.

use super::trace::{Downstream, ParameterReport, RunReport};
use crate::number::{Precision, decimals, duration, grouped, quantity, significant};
use crate::page::{Page, Tile, Tone};

pub(super) fn page(report: &RunReport) -> Page {
    let title = if report.condition.is_empty() {
        report.task.clone()
    } else {
        format!("{}, {}", report.task, report.condition)
    };
    let stage = if report.stage.is_empty() {
        "run"
    } else {
        &report.stage
    };
    let mut page = Page::new(&title)
        .kicker(&format!("ASID {stage}"))
        .lead(answer(report));
    if let Some(downstream) = &report.downstream {
        let (word, tone) = if downstream.success {
            ("success", Tone::Good)
        } else {
            ("no success", Tone::Bad)
        };
        page = if report.predicted() {
            page.badge(&format!("{word} expected"), tone)
        } else {
            page.badge(word, tone)
        };
    }

    let stages: Vec<&str> = [&report.explorer, &report.identifier, &report.solver]
        .into_iter()
        .map(String::as_str)
        .filter(|s| !s.is_empty())
        .collect();
    if !stages.is_empty() {
        page = if report.stage.is_empty() {
            page.fact("explorer → identifier → solver", stages.join(" → "))
        } else {
            page.fact("algorithm", stages.join(", "))
        };
    }
    let seed = format!(
        "{}, seed {}",
        if report.backend.is_empty() {
            "unknown"
        } else {
            &report.backend
        },
        report.seed
    );
    page = page.fact("simulator", seed);
    if let Some(world) = real_world(report) {
        page = page.fact("real world", world);
    }
    for note in &report.notes {
        page = page.fact("note", note.clone());
    }
    tiles(report).into_iter().fold(page, Page::tile)
}

fn real_world(report: &RunReport) -> Option<String> {
    let world = &report.real_world;
    let mut parts = Vec::new();
    if !world.kind.is_empty() {
        parts.push(world.kind.clone());
    }
    if !world.engine.is_empty() {
        parts.push(world.engine.clone());
    }
    if !world.model.is_empty() {
        parts.push(format!("model {}", world.model));
    }
    if !world.effects.is_empty() {
        parts.push(format!("with {}", world.effects.join(", ")));
    }
    if !world.noise.is_empty() {
        parts.push(format!("noise {}", world.noise));
    }
    if report.parameters.iter().any(|p| p.truth.is_some()) {
        parts.push("truth hidden from the method".to_owned());
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// The answer in one sentence.
fn answer(report: &RunReport) -> String {
    if !report.answer.is_empty() {
        return report.answer.clone();
    }
    let mut parts: Vec<String> = report
        .parameters
        .iter()
        .filter(|p| p.estimate.is_finite())
        .map(|p| {
            let truth = p.truth.map_or(String::new(), |t| {
                format!(" (truth {})", precision(p).show(t))
            });
            format!("{} is {}{truth}", p.name, estimate(p))
        })
        .collect();
    if let Some(d) = &report.downstream {
        let verdict = if d.success { "success" } else { "no success" };
        let world = if report.predicted() {
            "simulator"
        } else {
            "real world"
        };
        parts.push(format!(
            "{} in the {world} is {}: {verdict}",
            metric_name(d),
            metric_value(d)
        ));
    }
    if parts.is_empty() {
        String::new()
    } else {
        format!("{}.", parts.join("; "))
    }
}

/// Precision of all numbers of a parameter.
pub(super) fn precision(p: &ParameterReport) -> Precision {
    Precision::of(p.estimate, p.std)
}

/// `0.0612 ± 0.0021 m`.
fn estimate(p: &ParameterReport) -> String {
    quantity(&precision(p).with_uncertainty(p.estimate, p.std), &p.unit)
}

/// `0.0571 to 0.0653`, without the unit.
pub(super) fn interval(p: &ParameterReport) -> Option<String> {
    p.interval95
        .iter()
        .all(|x| x.is_finite())
        .then(|| precision(p).interval(p.interval95))
}

/// Whether the truth is known and lies in the 95 % interval.
pub(super) fn covered(p: &ParameterReport) -> Option<bool> {
    let [low, high] = p.interval95;
    let truth = p.truth.filter(|_| low.is_finite() && high.is_finite())?;
    Some((low..=high).contains(&truth))
}

/// The metric's name in a sentence: its label, or its name without the unit and underscores.
pub(super) fn metric_name(d: &Downstream) -> String {
    if !d.label.is_empty() {
        return d.label.clone();
    }
    let bare = d
        .metric
        .strip_suffix(&format!("_{}", d.unit))
        .unwrap_or(&d.metric);
    if bare.is_empty() {
        "the metric".to_owned()
    } else {
        bare.replace('_', " ")
    }
}

pub(super) fn metric_value(d: &Downstream) -> String {
    // A metric far below its limit needs no third digit.
    let number = match d.threshold {
        Some(limit) if limit.is_finite() && limit > 0.0 && d.value.is_finite() => {
            let places = (1.0 - limit.log10().floor()).clamp(0.0, 6.0);
            decimals(d.value, places as usize)
        }
        _ => significant(d.value, 3),
    };
    quantity(&number, &d.unit)
}

fn tiles(report: &RunReport) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let single = report.parameters.len() == 1;
    for p in &report.parameters {
        let coverage = match covered(p) {
            Some(true) => "holds the truth",
            Some(false) => "misses the truth",
            None => "",
        };
        if single {
            tiles.push(
                Tile::new(&p.name, &quantity(&precision(p).show(p.estimate), &p.unit))
                    .note(standard_deviation(p)),
            );
            if let Some(truth) = p.truth {
                tiles.push(
                    Tile::new("truth", &quantity(&precision(p).show(truth), &p.unit))
                        .note("hidden from the method"),
                );
                let error = p.estimate - truth;
                let note = if p.std > 0.0 && error.is_finite() {
                    format!("{} standard deviations", decimals((error / p.std).abs(), 1))
                } else {
                    String::new()
                };
                tiles.push(
                    Tile::new("error", &quantity(&precision(p).show(error), &p.unit)).note(note),
                );
            }
            if let Some(interval) = interval(p) {
                let note = [p.unit.as_str(), coverage]
                    .iter()
                    .filter(|t| !t.is_empty())
                    .copied()
                    .collect::<Vec<_>>()
                    .join(", ");
                tiles.push(Tile::new("95 % interval", &interval).note(note));
            }
        } else {
            let truth = p
                .truth
                .map_or(String::new(), |t| format!("truth {}", precision(p).show(t)));
            let note = [standard_deviation(p), truth, coverage.to_owned()]
                .into_iter()
                .filter(|t| !t.is_empty())
                .collect::<Vec<_>>();
            tiles.push(
                Tile::new(&p.name, &quantity(&precision(p).show(p.estimate), &p.unit))
                    .note(note.join(", ")),
            );
        }
    }
    if let Some(d) = &report.downstream {
        let tone = if d.success { Tone::Good } else { Tone::Bad };
        tiles.push(
            Tile::new(&metric_name(d), &metric_value(d))
                .note(d.rule.clone())
                .tone(tone),
        );
        tiles.push(
            Tile::new("outcome", if d.success { "success" } else { "no success" })
                .note(if report.predicted() {
                    "in the simulator, at the estimate"
                } else {
                    "one try, zero-shot"
                })
                .tone(tone),
        );
    }
    if report.wall_s.is_finite() {
        tiles.push(Tile::new("wall time", &duration(report.wall_s)).note("whole run"));
    }
    if report.physics_steps > 0 {
        let note = if report.env_steps > 0 {
            format!("{} control steps", grouped(report.env_steps))
        } else {
            String::new()
        };
        tiles.push(Tile::new("physics steps", &grouped(report.physics_steps)).note(note));
    }
    tiles
}

fn standard_deviation(p: &ParameterReport) -> String {
    if p.std.is_finite() && p.std > 0.0 {
        format!("± {}", quantity(&precision(p).show(p.std), &p.unit))
    } else {
        String::new()
    }
}
