//! Fills the data that a run's report is made of.

use anyhow::Result;
use asid_core::explore::CurvePoint;
use asid_core::parameter::Scale;
use asid_core::pipeline::{EpisodeInformation, RunOutcome};
use asid_core::real_world::Attempt;
use asid_core::replay::Replay as Replayed;
use asid_core::signal::yaw;
use asid_core::solve::Trial;
use asid_core::task::Outline;
use asid_report::run as r;

use super::session::Session;

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
            engine: config.real.backend.clone(),
            model: config
                .real
                .model
                .as_ref()
                .map(|p| p.display().to_string())
                .unwrap_or_default(),
            effects: Vec::new(),
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
            .map(|real| episode(session, &real.episode)),
        signals: signals(session, outcome)?,
        exploration: exploration(
            session,
            &outcome.objective,
            &outcome.information,
            outcome.real.as_ref().map(|r| r.contact_fraction),
        ),
        learning: learning(&outcome.curve, outcome.curve_label),
        downstream: Some(downstream(session, &outcome.attempt, &outcome.trials)),
        costs: outcome
            .costs
            .iter()
            .map(|c| r::StageCost {
                stage: c.stage.to_owned(),
                wall_s: c.wall_s,
                physics_steps: c.physics_steps,
            })
            .collect(),
        wall_s,
        physics_steps: cost.physics_steps,
        env_steps: cost.env_steps,
        versions: versions(session),
        command,
        files: files(&[
            ("result.json", "the figures"),
            (
                "config.toml",
                "all settings; `--config` with it repeats the run",
            ),
            ("real.csv", "log of the real episode"),
            ("policy.json", "the exploration policy"),
            ("posterior.json", "the posterior, for `asid solve`"),
            ("trace.json", "the data of this report"),
        ]),
        ..r::RunReport::default()
    })
}

/// What made the result.
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

/// Return over the search for a policy; `None` where it did not search.
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

/// The condition whose truth this is; empty where it is none's.
fn condition(session: &Session, truth: &[f64]) -> String {
    let names: Vec<&str> = session.parameters.iter().map(|p| &*p.name).collect();
    session
        .task
        .conditions()
        .into_iter()
        .find(|c| {
            c.truth.iter().all(|(n, v)| {
                names
                    .iter()
                    .position(|k| k == n)
                    .is_some_and(|i| truth[i] == *v)
            })
        })
        .map(|c| c.name)
        .unwrap_or_default()
}

/// The unknowns and what became known of them.
pub fn parameters(
    session: &Session,
    truth: Option<&[f64]>,
    belief: &asid_core::Posterior,
    iterations: Option<&[asid_core::identify::IterationSummary]>,
) -> Vec<r::ParameterReport> {
    let keep = belief.samples.len().div_ceil(SAMPLES).max(1);
    session
        .parameters
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
                std: m.std,
                interval95: m.interval95,
                prior: Some(match p.scale {
                    Scale::Linear => r::Prior::Uniform { low, high },
                    Scale::Log => r::Prior::LogUniform { low, high },
                }),
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

fn shape(outline: &Outline, kind: r::ShapeKind) -> r::Shape {
    r::Shape {
        label: outline.label.clone(),
        kind,
        points: outline.corners.clone(),
        radius: None,
    }
}

/// The real episode from above.
pub fn episode(session: &Session, log: &asid_core::Episode) -> r::Episode {
    let view = session.task.top_view();
    let protocol = session.task.exploration();
    let position = session.signals.first().and_then(|s| log.channel(&s.sensor));
    let orientation = session
        .signals
        .iter()
        .filter_map(|s| log.channel(&s.sensor))
        .find(|c| c.len() == 4);
    let poses = |row: &[f64]| {
        let (p, q) = (position.clone()?, orientation.clone()?);
        Some([row[p.start], row[p.start + 1], yaw(&row[q])])
    };
    let effector = protocol
        .proprioception
        .first()
        .and_then(|name| log.channel(name));
    let every = protocol.frames_per_step.max(1);
    r::Episode {
        objects: vec![r::ObjectTrack {
            name: view.object.label.clone(),
            outline: view.object.corners.clone(),
            time: log.time.clone(),
            poses: (0..log.rows())
                .map(|i| poses(log.reading(i)).unwrap_or([f64::NAN; 3]))
                .collect(),
        }],
        end_effector: effector.map(|range| r::PlanarPath {
            time: log.time.iter().step_by(every).copied().collect(),
            position: (0..log.rows())
                .step_by(every)
                .map(|i| {
                    let row = &log.reading(i)[range.clone()];
                    [row[0], row[1]]
                })
                .collect(),
        }),
        workspace: Some([
            view.bounds[0][0],
            view.bounds[1][0],
            view.bounds[0][1],
            view.bounds[1][1],
        ]),
        shapes: view
            .fixtures
            .iter()
            .map(|f| shape(f, r::ShapeKind::Fixed))
            .collect(),
    }
}

/// Real readings against replays at the prior's centre and at the estimate.
fn signals(session: &Session, outcome: &RunOutcome) -> Result<Vec<r::Signal>> {
    let (Some(real), Some(found)) = (&outcome.real, &outcome.identified) else {
        return Ok(Vec::new());
    };
    let center: Vec<f64> = session
        .parameters
        .iter()
        .map(asid_core::Parameter::center)
        .collect();
    let before = replay(session, &real.episode, &center, &found.starts[0])?;
    let after = replay(
        session,
        &real.episode,
        &outcome.belief.mean(),
        &found.starts[0],
    )?;
    Ok(tracked(session, &real.episode, Some((&before, &after))))
}

/// Readings of the tracked signals, an orientation as its heading, with replays.
pub fn tracked(
    session: &Session,
    log: &asid_core::Episode,
    replays: Option<(&[f64], &[f64])>,
) -> Vec<r::Signal> {
    let width: usize = session
        .signals
        .iter()
        .filter_map(|s| session.model.layout().sensor(&s.sensor).ok())
        .map(|s| s.len)
        .sum();
    let mut out = Vec::new();
    let mut at = 0;
    for signal in &session.signals {
        let Ok(sensor) = session.model.layout().sensor(&signal.sensor) else {
            continue;
        };
        let range = log.channel(&signal.sensor);
        let entries: Vec<usize> = if sensor.len == 4 {
            vec![0]
        } else {
            (0..sensor.len).collect()
        };
        for i in entries {
            let value = |row: &[f64], from: usize| {
                if sensor.len == 4 {
                    yaw(&row[from..from + 4])
                } else {
                    row[from + i]
                }
            };
            let series = |data: &[f64]| {
                unwrapped(
                    data.chunks_exact(width).map(|row| value(row, at)).collect(),
                    sensor.len == 4,
                )
            };
            let readings: Vec<f64> = (0..log.rows())
                .map(|k| {
                    range
                        .as_ref()
                        .map_or(f64::NAN, |r| value(log.reading(k), r.start))
                })
                .collect();
            let replay = |data: &[f64]| r::Replay {
                time: log.time.clone(),
                value: series(data),
                band95: Vec::new(),
            };
            out.push(r::Signal {
                name: match sensor.len {
                    4 => format!("{} (heading)", signal.sensor),
                    1 => signal.sensor.clone(),
                    _ => format!("{}.{i}", signal.sensor),
                },
                unit: if sensor.len == 4 {
                    "rad".into()
                } else {
                    sensor.unit().into()
                },
                noise_std: Some(signal.noise),
                time: log.time.clone(),
                readings: unwrapped(readings, sensor.len == 4),
                before: replays.map(|(b, _)| replay(b)),
                after: replays.map(|(_, a)| replay(a)),
            });
        }
        at += sensor.len;
    }
    out
}

/// Angles without jumps of a turn.
fn unwrapped(mut values: Vec<f64>, angle: bool) -> Vec<f64> {
    if angle {
        let turn = 2.0 * std::f64::consts::PI;
        for i in 1..values.len() {
            let jump = ((values[i] - values[i - 1]) / turn).round();
            if jump.is_finite() {
                values[i] -= jump * turn;
            }
        }
    }
    values
}

/// Predicted tracked readings of a log at these values.
pub fn replay(
    session: &Session,
    log: &asid_core::Episode,
    theta: &[f64],
    start: &[f64],
) -> Result<Vec<f64>> {
    let problem = session.problem();
    let names: Vec<String> = session.signals.iter().map(|s| s.sensor.clone()).collect();
    let mut replay = Replayed::new(session.model.layout(), log, &names)?;
    let mut batch = problem.batch(1)?;
    batch.set_parameters(&[0], theta)?;
    batch.place(&*session.task, &[0], start)?;
    let mut out = vec![0.0; replay.rows() * replay.width()];
    replay.run(&mut *batch.simulator, &[0], &mut out)?;
    Ok(out)
}

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
        form: "trajectory".into(),
        time: (1..=rest.len()).map(|k| k as f64 * step).collect(),
        gained: information.reward.clone(),
        gained_unit: "prior variance".into(),
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
