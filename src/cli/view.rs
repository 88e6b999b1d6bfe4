//! The 3-D view of a report: the episode of a task, or a designed motion.

use anyhow::Result;
use asid_core::{Episode, Parameter};
use asid_mjcf::Plant;
use asid_results::view::{Origin, View};
use asid_view::motion::Played;
use asid_view::{Motion, Stage, logged};

use super::machine::Subject;
use super::session::Session;
use super::trace::replay_of;
use crate::pipeline::RunOutcome;

/// The real episode of a run, as logged and as replayed at the prior's centre and at the estimate.
///
/// `None` where nothing was identified.
pub fn of_run(session: &Session, outcome: &RunOutcome) -> Result<Option<View>> {
    let (Some(real), Some(found)) = (&outcome.real, &outcome.identified) else {
        return Ok(None);
    };
    let center: Vec<f64> = session.parameters.iter().map(Parameter::center).collect();
    let replays = [
        (Origin::Before, "before, at the prior's centre", center),
        (
            Origin::After,
            "after, at the estimate",
            outcome.belief.mean(),
        ),
    ];
    of_episode(session, &real.episode, &found.starts[0], &replays, true)
}

/// The episode that the simulator predicts at these values.
pub fn of_prediction(
    session: &Session,
    log: &Episode,
    theta: &[f64],
    start: &[f64],
) -> Result<Option<View>> {
    let replays = [(
        Origin::Predicted,
        "as the simulator expects it",
        theta.to_vec(),
    )];
    of_episode(session, log, start, &replays, false)
}

/// Replays of a log, together with the log itself if it is real.
///
/// The last replay stands in where no sensor measures a coordinate.
fn of_episode(
    session: &Session,
    log: &Episode,
    start: &[f64],
    replays: &[(Origin, &str, Vec<f64>)],
    is_real: bool,
) -> Result<Option<View>> {
    let scene = session.task.scene();
    let plant = Plant::of(scene)?;
    // A user's model may have other joints than the task's scene, which is what is drawn.
    let names = |layout: &asid_core::Layout| -> Vec<String> {
        let joints = layout.joints.iter();
        joints.map(|j| format!("qpos.{}", j.name)).collect()
    };
    let channels = names(&plant.layout);
    if channels != names(session.model.layout()) || log.rows() < 2 {
        return Ok(None);
    }
    let mut motions = Vec::new();
    for (origin, label, theta) in replays {
        let qpos = replay_of(session, log, (theta, start), &channels)?;
        motions.push(Motion::new(*origin, label, qpos));
    }
    let mut unread = Vec::new();
    if let (true, Some(last)) = (is_real, motions.last())
        && let Some((qpos, hidden)) = logged::positions(&plant, log, &last.qpos)
    {
        motions.insert(0, Motion::new(Origin::Real, "real, as logged", qpos));
        unread = hidden;
    }
    let stage = Stage::of(scene, &plant)?;
    let mut view = stage.with(&[Played {
        name: "the real episode",
        what: "",
        time: &log.time,
        motions: &motions,
        missing: &[],
    }]);
    view.notes.extend(logged::remark(&unread));
    Ok(Some(view))
}

/// A designed motion: `qpos` at the ends of frames of `period` seconds. Its first row is the end of
/// the first frame.
pub fn of_motion(subject: &Subject, qpos: &[f64], period: f64) -> Result<Option<View>> {
    let nq = subject.plant.layout.nq.max(1);
    let time: Vec<f64> = (0..qpos.len() / nq).map(|k| k as f64 * period).collect();
    let stage = Stage::of(&subject.source.scene, &subject.plant)?;
    let motions = [Motion::new(
        Origin::Predicted,
        "as the simulator expects it",
        qpos.to_vec(),
    )];
    Ok(Some(stage.with(&[Played {
        name: "the motion",
        what: "",
        time: &time,
        motions: &motions,
        missing: &[],
    }])))
}
