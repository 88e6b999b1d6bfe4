//! The real episode in the report: its picture from above and its signals with their replays.

use crate::pipeline::RunOutcome;
use anyhow::Result;
use asid_core::signal::yaw;
use asid_core::task::{Outline, TrackedObject};
use asid_readings::replay::Replay as Replayed;
use asid_report::run as r;

use super::super::session::Session;

pub fn shape(outline: &Outline, kind: r::ShapeKind) -> r::Shape {
    r::Shape {
        label: outline.label.clone(),
        kind,
        points: outline.corners.clone(),
        radius: None,
    }
}

/// The path of an object; `None` where its position in the plane is not tracked.
///
/// An object whose orientation is not tracked keeps its heading.
fn track(object: &TrackedObject, log: &asid_core::Episode) -> Option<r::ObjectTrack> {
    let position = log.channel(&object.position).filter(|p| p.len() >= 2)?;
    let orientation = object.orientation.as_ref().and_then(|o| log.channel(o));
    let orientation = orientation.filter(|q| q.len() == 4);
    // Rows between two readings of a slow tracker have nothing to draw.
    let rows = (0..log.rows()).filter(|&i| log.reading(i)[position.start].is_finite());
    let rows: Vec<usize> = rows.collect();
    let pose = |row: &[f64]| {
        let heading = orientation.clone().map_or(0.0, |q| yaw(&row[q]));
        [row[position.start], row[position.start + 1], heading]
    };
    Some(r::ObjectTrack {
        name: object.outline.label.clone(),
        outline: object.outline.corners.clone(),
        round: orientation.is_none(),
        time: rows.iter().map(|&i| log.time[i]).collect(),
        poses: rows.iter().map(|&i| pose(log.reading(i))).collect(),
    })
}

/// The real episode from above; `None` where no object's position is tracked.
pub fn episode(session: &Session, log: &asid_core::Episode) -> Option<r::Episode> {
    let view = &session.task.spec().top_view;
    let protocol = session.task.exploration();
    let objects = session.task.objects();
    let objects: Vec<r::ObjectTrack> = objects.iter().filter_map(|o| track(o, log)).collect();
    if objects.is_empty() {
        return None;
    }
    let effector = protocol
        .proprioception
        .first()
        .and_then(|name| log.channel(name))
        .filter(|range| range.len() >= 2);
    let every = protocol.frames_per_step.max(1);
    Some(r::Episode {
        objects,
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
    })
}

/// Real readings against replays at the prior's centre and at the estimate.
pub fn signals(session: &Session, outcome: &RunOutcome) -> Result<Vec<r::Signal>> {
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

/// Readings of the tracked signals with their replays; an orientation is shown as its heading.
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

/// Angles with jumps of a full turn removed.
pub fn unwrapped(mut values: Vec<f64>, angle: bool) -> Vec<f64> {
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
    let names: Vec<String> = session.signals.iter().map(|s| s.sensor.clone()).collect();
    replay_of(session, log, (theta, start), &names)
}

/// Simulated readings of the named channels at the rows of a log (`rows x width`).
///
/// `at` holds the values of the unknowns and the start.
pub fn replay_of(
    session: &Session,
    log: &asid_core::Episode,
    at: (&[f64], &[f64]),
    channels: &[String],
) -> Result<Vec<f64>> {
    let (theta, start) = at;
    let problem = session.problem();
    let mut replay = Replayed::new(session.model.layout(), log, channels)?;
    let mut batch = problem.batch(1)?;
    batch.set_parameters(&[0], theta)?;
    batch.place(&*session.task, &[0], start)?;
    let mut out = vec![0.0; replay.rows() * replay.width()];
    replay.run(&mut *batch.simulator, &[0], &mut out)?;
    Ok(out)
}
