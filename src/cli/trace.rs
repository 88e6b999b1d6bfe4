//! Fills the data that a run's report is made of.

use crate::pipeline::RunOutcome;
use anyhow::Result;
use asid_core::explore::CurvePoint;
use asid_core::parameter::Scale;
use asid_report::run as r;

use super::session::Session;

mod episode;
mod stages;

pub use episode::{episode, replay, replay_of, signals, tracked};
pub use stages::{downstream, exploration};

/// Samples of the posterior kept for the picture.
const SAMPLES: usize = 2000;

/// Everything the report shows of a run.
pub fn run_report(
    session: &Session,
    truth: &[f64],
    outcome: &RunOutcome,
    wall_s: f64,
    command: String,
) -> Result<r::RunReport> {
    let config = &session.config;
    let cost = session.cost(wall_s);
    Ok(r::RunReport {
        task: config.task.clone(),
        condition: condition(session, truth),
        backend: config.backend.clone(),
        explorer: config.explorer.name.clone(),
        identifier: config.identifier.name.clone(),
        solver: config.solver.name.clone(),
        seed: config.seed,
        real_world: r::RealWorld {
            kind: config.real.world.name().to_owned(),
            engine: config.real.backend.clone(),
            model: config
                .real
                .model
                .as_ref()
                .map(|p| p.display().to_string())
                .unwrap_or_default(),
            effects: effects(session),
            noise: session
                .signals
                .iter()
                .map(|s| format!("{} {}", s.sensor, s.noise))
                .collect::<Vec<_>>()
                .join(", "),
        },
        parameters: parameters(
            session,
            Some(truth),
            &outcome.belief,
            outcome.identified.as_ref().map(|f| &*f.iterations),
        ),
        episode: outcome
            .real
            .as_ref()
            .and_then(|real| episode(session, &real.episode)),
        signals: signals(session, outcome)?,
        view: super::view::of_run(session, outcome)?,
        exploration: exploration(
            session,
            &outcome.objective,
            &outcome.information,
            outcome.real.as_ref().map(|r| r.contact_fraction),
        ),
        learning: learning(&outcome.curve, outcome.curve_label),
        downstream: Some(downstream(session, &outcome.attempt, &outcome.trials)),
        costs: outcome.costs.clone(),
        wall_s,
        physics_steps: cost.physics_steps,
        env_steps: cost.env_steps,
        versions: versions(session),
        command,
        files: files(&[
            ("result.json", "the figures"),
            (
                "config.toml",
                "all settings; given to --config, it repeats the run",
            ),
            ("real.csv", "log of the real episode"),
            ("attempt.csv", "log of the attempt at the task"),
            ("policy.json", "the exploration policy"),
            ("posterior.json", "the posterior, for asid solve"),
            ("trace.json", "the data of this report"),
        ]),
        ..r::RunReport::default()
    })
}

/// Effects that the real world has and the simulator lacks: the named ones, then those drawn.
fn effects(session: &Session) -> Vec<String> {
    let named = session.config.real.effects.iter().cloned();
    let drawn = session.perturbed().into_iter();
    named.chain(drawn.flat_map(|p| p.drawn.words())).collect()
}

/// Versions of what made the result.
pub fn versions(session: &Session) -> Vec<r::NamedText> {
    [
        ("asid", env!("CARGO_PKG_VERSION").to_owned()),
        ("engine", session.engine.clone()),
        ("git", env!("ASID_GIT").to_owned()),
    ]
    .map(|(name, value)| r::NamedText {
        name: name.into(),
        value,
    })
    .into()
}

/// Files of the folder: name and what it holds.
pub fn files(entries: &[(&str, &str)]) -> Vec<r::FileEntry> {
    entries
        .iter()
        .map(|(name, what)| r::FileEntry {
            name: (*name).to_owned(),
            what: (*what).to_owned(),
        })
        .collect()
}

/// Return over the search for a policy; `None` without a search.
pub fn learning(curve: &[CurvePoint], label: &str) -> Option<r::LearningCurve> {
    (!curve.is_empty()).then(|| r::LearningCurve {
        x_label: label.to_owned(),
        y_label: "return".into(),
        x: curve.iter().map(|p| p.x).collect(),
        mean: curve.iter().map(|p| p.mean).collect(),
        std: curve.iter().map(|p| p.std).collect(),
        best: Vec::new(),
    })
}

/// The chosen condition, else the one whose truth this is; empty where there is none.
fn condition(session: &Session, truth: &[f64]) -> String {
    if let Some(name) = &session.config.condition {
        return name.clone();
    }
    let names: Vec<&str> = session.parameters.iter().map(|p| &*p.name).collect();
    session
        .task
        .conditions()
        .into_iter()
        .find(|c| {
            !c.truth.is_empty()
                && c.truth.iter().all(|(n, [low, high])| {
                    names
                        .iter()
                        .position(|k| k == n)
                        .is_some_and(|i| low == high && truth[i] == *low)
                })
        })
        .map(|c| c.name)
        .unwrap_or_default()
}

/// The unknowns with what became known of them.
pub fn parameters(
    session: &Session,
    truth: Option<&[f64]>,
    belief: &asid_core::Posterior,
    iterations: Option<&[asid_core::identify::IterationSummary]>,
) -> Vec<r::ParameterReport> {
    parameters_of(&session.parameters, truth, belief, iterations)
}

/// As [`parameters`], for the unknowns of any machine.
pub fn parameters_of(
    parameters: &[asid_core::Parameter],
    truth: Option<&[f64]>,
    belief: &asid_core::Posterior,
    iterations: Option<&[asid_core::identify::IterationSummary]>,
) -> Vec<r::ParameterReport> {
    let keep = belief.samples.len().div_ceil(SAMPLES).max(1);
    parameters
        .iter()
        .zip(&belief.marginals)
        .enumerate()
        .map(|(i, (p, m))| {
            let [low, high] = p.range;
            let prior_quantiles = [0.025, 0.25, 0.5, 0.75, 0.975].map(|u| p.from_unit(u));
            let after = iterations
                .unwrap_or_default()
                .iter()
                .map(|s| s.quantiles[i]);
            r::ParameterReport {
                name: p.name.clone(),
                unit: p.unit.clone(),
                target: p
                    .targets
                    .iter()
                    .map(ToString::to_string)
                    .collect::<Vec<_>>()
                    .join(", "),
                log_scale: p.scale == Scale::Log,
                truth: truth.map(|t| t[i]),
                estimate: m.estimate,
                std: if m.unidentified { f64::NAN } else { m.std },
                interval95: m.interval95,
                prior: Some(match p.scale {
                    Scale::Linear => r::Prior::Uniform { low, high },
                    Scale::Log => r::Prior::LogUniform { low, high },
                    // Its two values are equally likely.
                    Scale::Binary(_) => r::Prior::Binary { probability: 0.5 },
                }),
                searched: m.searched,
                narrowing: std::iter::once(prior_quantiles)
                    .chain(after)
                    .enumerate()
                    .map(|(k, quantiles)| r::Narrowing {
                        iteration: k as u32,
                        quantiles,
                    })
                    .collect(),
                samples: belief.samples.iter().step_by(keep).map(|s| s[i]).collect(),
                weights: belief.weights.iter().step_by(keep).copied().collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: the report of an unknown that is 0 or 1 said "uniform, 0 to 1" of its prior, and
    /// drew a density with a peak at each value. Cause: its prior was written as a uniform one.
    #[test]
    fn an_unknown_that_is_0_or_1_is_drawn_as_two_probabilities() {
        let unknowns = [asid_core::Parameter {
            name: "articulated".into(),
            targets: vec!["joint/hinge/frictionloss".parse().unwrap()],
            range: [0.0, 1.0],
            scale: Scale::Binary([5.0, 0.1]),
            unit: String::new(),
        }];
        let samples = [0.0, 1.0, 1.0, 1.0].map(|x| vec![x]).into();
        let belief = asid_core::Posterior::from_samples(&unknowns, samples, &[1.0; 4]);
        let report = r::RunReport {
            parameters: parameters_of(&unknowns, None, &belief, None),
            ..r::RunReport::default()
        };
        let page = report.html();
        assert!(page.contains("1 with probability 0.5"), "{page}");
        assert!(page.contains("0.50 before, 0.75 after"), "{page}");
    }
}
