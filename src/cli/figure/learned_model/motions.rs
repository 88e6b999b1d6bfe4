//! The motions that are predicted: recorded here, in the form a learned model sees, and as replayed
//! by the simulator.

use anyhow::Result;
use asid_core::registry::{IdentifierEntry, find};
use asid_core::{Policy, Task};
use asid_nn::Motion;
use asid_worlds::SimulatedWorld;

use super::super::Request;
use super::super::episodes::{Played, each, open, played, played_in};
use super::super::wanted::Wanted;
use super::{BALL, HAND};
use crate::cli::session::Session;

/// How the hand moves in an episode of the test.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Move {
    /// Straight at the ball at full speed, and on.
    Push,
    /// Not at all.
    Still,
}

/// A policy of a test. It needs neither network nor plan, so that no model's own explorer is
/// favoured.
struct Moving {
    kind: Move,
    /// First entries of ball and hand in a reading.
    ball: usize,
    hand: usize,
    /// Largest action along x and y.
    most: [f64; 2],
}

impl Moving {
    fn new(session: &Session, kind: Move) -> Result<Self> {
        let protocol = session.task.exploration();
        let names = protocol.channels();
        let recording = session.model.layout().recording(&names)?;
        let at = |name: &str| {
            let place = names.iter().position(|n| n == name);
            let unknown = || asid_core::Error::unknown("channel", name, names.iter().map(|n| &**n));
            Ok::<usize, asid_core::Error>(recording.range(place.ok_or_else(unknown)?).start)
        };
        Ok(Self {
            kind,
            ball: at(BALL)?,
            hand: at(HAND)?,
            most: [0, 1].map(|i| protocol.action[i].range[1]),
        })
    }
}

impl Policy for Moving {
    fn reset(&mut self) {}

    fn act(&mut self, _step: usize, reading: &[f64], action: &mut [f64]) -> asid_core::Result<()> {
        action.fill(0.0);
        let way = [0, 1].map(|i| reading[self.ball + i] - reading[self.hand + i]);
        let length = way[0].hypot(way[1]);
        // A missing reading leads to no motion.
        if self.kind == Move::Push && length > 0.0 {
            for i in 0..2 {
                action[i] = self.most[i] * way[i] / length;
            }
        }
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

/// Plays recorded actions.
struct Replay<'a>(&'a [f64]);

impl Policy for Replay<'_> {
    fn reset(&mut self) {}

    fn act(&mut self, step: usize, _reading: &[f64], action: &mut [f64]) -> asid_core::Result<()> {
        let n = action.len();
        action.copy_from_slice(&self.0[step * n..][..n]);
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        serde_json::Value::Null
    }
}

/// Episodes in which the hand moves in this way.
pub fn moved(request: &Request<'_>, wanted: Vec<Wanted>, kind: Move) -> Result<Vec<Played>> {
    each(&request.common, wanted, |wanted| {
        let session = open(&request.common, wanted, false)?;
        let mut policy = Moving::new(&session, kind)?;
        played(&session, wanted, &mut policy)
    })
}

/// The values of the unknowns that a simulator uses: the middle of the prior, and those identified
/// from one episode.
pub fn fitted(request: &Request<'_>, episode: &Played) -> Result<[Vec<f64>; 2]> {
    let session = open(&request.common, &episode.wanted, request.quick)?;
    let component = &session.config.identifier;
    let identifier = (find::<IdentifierEntry>(&component.name)?.make)(&component.settings)?;
    let found = identifier.identify(&session.problem(), std::slice::from_ref(&episode.log))?;
    let middle = session.parameters.iter().map(asid_core::Parameter::center);
    Ok([middle.collect(), found.posterior.mean()])
}

/// Replays of the same actions from the same starts in the method's simulator, with these values of
/// the unknowns.
pub fn simulated(request: &Request<'_>, episodes: &[Played], theta: &[f64]) -> Result<Vec<Path>> {
    let wanted = episodes.iter().map(|e| Wanted {
        start: Some(e.start.clone()),
        ..e.wanted.clone()
    });
    let find = |wanted: &Wanted| {
        let same =
            |e: &&Played| e.wanted.seed == wanted.seed && Some(&e.start) == wanted.start.as_ref();
        episodes.iter().find(same)
    };
    each(&request.common, wanted.collect(), |wanted| {
        let session = open(&request.common, wanted, false)?;
        let streams = session.problem().streams.child("predicted");
        let (task, model) = (&*session.task, &*session.model);
        let world = SimulatedWorld::new(
            task,
            model,
            &session.parameters,
            theta,
            &session.signals,
            streams,
        )?;
        let lost = || asid_core::Error::Failed("an episode to predict is lost".into());
        let actions = &find(wanted).ok_or_else(lost)?.actions;
        let repeated = played_in(world, wanted, &mut Replay(actions))?;
        path(task, &repeated)
    })
}

/// Positions of the ball in the plane, at the start and after each control step, m.
pub type Path = Vec<[f64; 2]>;

/// The ball's path in an episode.
pub fn path(task: &dyn Task, episode: &Played) -> Result<Path> {
    let frames = task.exploration().frames_per_step;
    let rows = episode.path(BALL)?;
    Ok(rows.into_iter().step_by(frames).collect())
}

/// An episode in the form a model of the motion sees: positions of ball and hand, actions scaled to
/// their ranges.
pub fn motion(task: &dyn Task, episode: &Played) -> Result<Motion> {
    let protocol = task.exploration();
    let (ball, hand) = (episode.channel(BALL)?, episode.channel(HAND)?);
    let rows = ball.iter().zip(&hand).step_by(protocol.frames_per_step);
    let scaled = |action: &[f64]| {
        let entries = action.iter().zip(&protocol.action);
        entries
            .map(|(a, c)| 2.0 * (a - c.center()) / (c.range[1] - c.range[0]))
            .collect()
    };
    Ok(Motion {
        places: rows.map(|(b, h)| [*b, *h].concat()).collect(),
        actions: episode
            .actions
            .chunks_exact(protocol.action.len())
            .map(scaled)
            .collect(),
    })
}
