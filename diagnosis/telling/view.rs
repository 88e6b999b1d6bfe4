//! The machine in 3-D: logs beside replays of their commands, and the missing force.

use asid_core::{Model, Result};
use asid_results::view::{Origin, View};
use asid_view::motion::Played;
use asid_view::{Motion, Stage, logged};

use super::{HeldOut, Telling};
use crate::bench::Explanation;
use crate::data::Logs;
use crate::predict::{Point, State};
use crate::trajectory::positions;

/// Number of held-out episodes that are shown.
const SHOWN: usize = 3;

/// A model whose replays are shown.
struct Seen<'a> {
    origin: Origin,
    label: &'a str,
    model: std::sync::Arc<dyn Model>,
    theta: &'a [f64],
}

impl Telling<'_> {
    /// Makes the view of the first held-out episodes and of the training episode whose missing
    /// force is shown.
    pub(super) fn view(
        &self,
        [nominal, identified, refined]: [&HeldOut; 3],
        best: &Explanation,
    ) -> Result<View> {
        let bench = self.bench;
        let machine = &bench.machine;
        let study = bench.parameters.len();
        let (given, with) = (machine.with(&[])?, machine.with(&best.effects)?);
        let none = &self.findings.none.fit.point;
        let mut models = vec![Seen {
            origin: Origin::Nominal,
            label: "nominal model",
            model: std::sync::Arc::clone(&given),
            theta: self.nominal,
        }];
        models.push(Seen {
            origin: Origin::Before,
            label: "identified model",
            model: given,
            theta: &none.theta[..study],
        });
        if !best.effects.is_empty() {
            models.push(Seen {
                origin: Origin::After,
                label: "refined model",
                model: with,
                theta: &best.fit.point.theta[..study],
            });
        }
        let mut unread = Vec::new();
        let mut told = Vec::new();
        for e in 0..bench.test.logs.episodes.len().min(SHOWN) {
            let starts = [nominal, identified, refined].map(|h| h.starts.get(e));
            let motions = self.motions(&bench.test.logs, e, &models, &starts, &mut unread)?;
            told.push((&bench.test.logs.episodes[e], "held out", motions, &[][..]));
        }
        let forces = &self.findings.forces;
        let trained = forces.first().and_then(|f| {
            let mut episodes = bench.train.logs.episodes.iter();
            episodes.position(|e| e.name == f.episode)
        });
        if let Some(e) = trained {
            let starts = [&bench.train.starts, &none.starts, &best.fit.point.starts];
            let starts = starts.map(|s| s.get(e));
            let motions = self.motions(&bench.train.logs, e, &models, &starts, &mut unread)?;
            told.push((
                &bench.train.logs.episodes[e],
                "fitted to, with the missing force",
                motions,
                forces.as_slice(),
            ));
        }
        let stage = Stage::of(&machine.scene, &machine.plant)?;
        let played: Vec<Played<'_>> = told
            .iter()
            .map(|(log, what, motions, missing)| Played {
                name: &log.name,
                what,
                time: &log.episode.time[..log.plan.rows()],
                motions,
                missing,
            })
            .collect();
        let mut view = stage.with(&played);
        unread.sort_unstable();
        unread.dedup();
        view.notes.extend(logged::remark(&unread));
        Ok(view)
    }

    /// Returns the motions of an episode: as logged, where a sensor reads a position, and as these
    /// models replay it.
    fn motions(
        &self,
        logs: &Logs,
        episode: usize,
        models: &[Seen<'_>],
        starts: &[Option<&State>; 3],
        unread: &mut Vec<String>,
    ) -> Result<Vec<Motion>> {
        let bench = self.bench;
        let log = &logs.episodes[episode];
        let mut motions = Vec::new();
        for (seen, start) in models.iter().zip(starts) {
            let Some(start) = start else { continue };
            let point = Point {
                theta: seen.theta.to_vec(),
                starts: vec![(*start).clone()],
            };
            let of_log = (&log.plan, log.number);
            let qpos = positions(&*seen.model, &bench.parameters, of_log, &point)?;
            motions.push(Motion::new(seen.origin, seen.label, qpos));
        }
        let of_log = motions.last().and_then(|last| {
            let rows = log.episode.rows().min(log.plan.rows());
            logged::positions(&bench.machine.plant, &log.episode.part(0..rows), &last.qpos)
        });
        if let Some((qpos, hidden)) = of_log {
            unread.extend(hidden);
            motions.insert(0, Motion::new(Origin::Real, "real, as logged", qpos));
        }
        Ok(motions)
    }
}
