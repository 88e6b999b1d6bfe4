//! The sections of the report on what exploration gathered and how the task went.

use crate::pipeline::EpisodeInformation;
use asid_core::real_world::Attempt;
use asid_core::solve::Trial;
use asid_report::run as r;

use super::super::session::Session;
use super::episode::shape;

/// What an episode tells about the unknowns, step by step.
pub fn exploration(
    session: &Session,
    objective: &str,
    information: &EpisodeInformation,
    contact_fraction: Option<f64>,
) -> Option<r::Exploration> {
    let (prior, rest) = information.expected_std.split_first()?;
    let protocol = session.task.exploration();
    let step = protocol.frames_per_step as f64 * protocol.frame_period;
    Some(r::Exploration {
        objective: objective.to_owned(),
        form: information.form.into(),
        time: (1..=rest.len()).map(|k| k as f64 * step).collect(),
        gained: information.reward.clone(),
        gained_unit: information.unit.into(),
        expected_std: session
            .parameters
            .iter()
            .enumerate()
            .map(|(i, p)| r::ExpectedStd {
                parameter: p.name.clone(),
                unit: p.unit.clone(),
                prior: Some(prior[i]),
                value: rest.iter().map(|s| s[i]).collect(),
            })
            .collect(),
        contact_fraction,
    })
}

/// An attempt at the task and how its action was found.
pub fn downstream(session: &Session, attempt: &Attempt, trials: &[Trial]) -> r::Downstream {
    let protocol = session.task.downstream();
    let series = session.task.metric(&attempt.readings);
    let label = protocol
        .metric
        .split('_')
        .next()
        .unwrap_or_default()
        .to_owned();
    let width = attempt.readings.len() / protocol.frames;
    let last = &attempt.readings[attempt.readings.len() - width..];
    let view = session.task.side_view(last);
    r::Downstream {
        metric: protocol.metric.clone(),
        label: label.clone(),
        unit: protocol.unit.clone(),
        value: attempt.outcome.value,
        success: attempt.outcome.success,
        rule: protocol.rule.clone(),
        threshold: protocol.threshold,
        time: (1..=series.len())
            .map(|k| k as f64 * protocol.frame_period)
            .collect(),
        metric_over_time: series,
        phases: protocol
            .phases
            .iter()
            .map(|(name, start, end)| r::Phase {
                name: name.clone(),
                start: *start,
                end: *end,
            })
            .collect(),
        search: Some(r::Search {
            chosen: protocol
                .action
                .iter()
                .zip(&attempt.action)
                .map(|(c, &value)| r::NamedValue {
                    name: c.name.clone(),
                    value,
                    unit: c.unit.clone(),
                })
                .collect(),
            cost_label: format!("expected {label}, with penalties"),
            cost_unit: protocol.unit.clone(),
            trials: trials
                .iter()
                .map(|t| r::Trial {
                    iteration: t.iteration as u32,
                    action: t.action.clone(),
                    cost: t.cost,
                })
                .collect(),
        }),
        side_view: (!view.is_empty()).then(|| r::SideView {
            x_label: "x".into(),
            floor: Some(0.0),
            shapes: view
                .iter()
                .enumerate()
                .map(|(i, o)| {
                    let kind = if i + 1 == view.len() {
                        r::ShapeKind::Object
                    } else {
                        r::ShapeKind::Fixed
                    };
                    shape(o, kind)
                })
                .collect(),
        }),
    }
}
