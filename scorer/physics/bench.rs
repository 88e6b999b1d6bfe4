//! A study on an engine: predictions of fitted sets of effects.

mod equivalence;
mod gaps;
mod named;

use std::sync::Arc;

use asid_core::{Backend, Error, Result};
use asid_effects::EffectSpec;

use super::Physics;
use super::fit::Fit;
use super::logs::Logs;
use super::model::{Engine, Point, World};
use super::start::{State, first_state, open_coordinates};
use super::study::Study;
use crate::answer::Answer;
use crate::judge::Judge;
use crate::label::Label;
use equivalence::SAME;
use named::{Named, truth, verdict};

/// Start sizes of the fit of an effect without values.
///
/// They are shares of the distance from the value at which the effect is off to an end of a range.
const SIZES: [f64; 3] = [1e-3, 1e-2, 1e-1];

/// A study on an engine, with its logs.
pub struct Bench<'a> {
    engine: Engine,
    study: &'a Study,
    /// Training logs and held-out logs.
    logs: [Logs; 2],
}

impl<'a> Bench<'a> {
    /// Compiles the study's model and reads its logs.
    ///
    /// # Errors
    /// If the engine refuses the model, or if the logs cannot be replayed.
    pub fn new(
        backend: Arc<dyn Backend>,
        study: &'a Study,
        label: &Label,
        answer: &Answer,
    ) -> Result<Self> {
        Ok(Self {
            logs: Logs::of(study, label, Some(answer))?,
            engine: Engine::new(backend, study)?,
            study,
        })
    }

    /// Judges an answer by replays.
    ///
    /// # Errors
    /// If a set of effects cannot be put into the model, or if the cause is in no catalogue.
    pub fn examine(&mut self, judge: &Judge<'_>, answer: &Answer) -> Result<Physics> {
        let label = judge.label;
        if label.is_unknown() {
            return Err(Error::Failed("the cause is in no catalogue".into()));
        }
        let (true_world, best) = self.fitted(&truth(label, answer, judge.sites))?;
        let mut physics = Physics::default();
        if !label.is_none() {
            physics.gaps = Some(self.gaps(label, answer, (&true_world, &best))?);
        }
        let set = answer.verdict.set();
        let names_agree = judge.of_set(&set, answer).is_right();
        let named = answer.verdict.kind != "unknown" && !answer.names_nothing();
        if !names_agree && !label.is_none() && named {
            let said = verdict(answer);
            let targets = self.predictions(&true_world, &best)?;
            let distance = self.distance(&said, &targets)?;
            // A set with superfluous effects can always imitate the truth, so each of its effects
            // must be needed.
            let same = distance < SAME && self.each_is_needed(&said, &targets)?;
            physics.distance = Some(distance);
            physics.same_as_truth = Some(same);
        }
        Ok(physics)
    }

    /// Initial states of some logs, and the coordinates that some log does not give.
    fn starts(&self, which: usize) -> (Vec<State>, Vec<usize>) {
        let episodes = || self.logs[which].logs.iter().map(|l| &l.episode);
        let first = |e| first_state(&self.study.plant, e);
        let open = open_coordinates(&self.study.plant.layout, episodes());
        (episodes().map(first).collect(), open)
    }

    /// A set fitted to the training logs: its world and its values.
    fn fitted(&mut self, named: &Named<'_>) -> Result<(World, Vec<f64>)> {
        let world = self
            .engine
            .world(self.study, &named.effects, &*named.parameters)?;
        let (starts, open) = self.starts(0);
        let mut fit = Fit::new(&self.study.plant.layout, &world, open)?;
        let values = world.unknowns.iter().map(|u| u.start).collect();
        let mut point = Point { values, starts };
        for effect in named.effects.iter().filter(|e| e.values.is_empty()) {
            point = self.first_size(&mut fit, &world, effect, point)?;
        }
        let point = fit.run(&mut self.logs[0], point)?;
        Ok((world, point.values))
    }

    /// Start point of the fit of an effect whose values nobody gives.
    ///
    /// It is the size with the smallest residuals, among sizes over three decades of the
    /// parameters' ranges and the off value.
    fn first_size(
        &mut self,
        fit: &mut Fit<'_>,
        world: &World,
        effect: &EffectSpec,
        off: Point,
    ) -> Result<Point> {
        let label = effect.label();
        let mut best = off.clone();
        let (mut least, _) = fit.squares(&mut self.logs[0], &off)?;
        let own = world
            .unknowns
            .iter()
            .enumerate()
            .filter(|(_, u)| u.is_of(&label));
        for (i, unknown) in own {
            for (share, end) in SIZES.iter().flat_map(|s| unknown.range.map(|end| (s, end))) {
                let mut point = off.clone();
                point.values[i] += share * (end - off.values[i]);
                let (squares, _) = fit.squares(&mut self.logs[0], &point)?;
                if squares < least {
                    (least, best) = (squares, point);
                }
            }
        }
        Ok(best)
    }
}

/// Root mean square of the residuals that count; infinite if one is missing because its simulation
/// diverged.
fn gap(residuals: &[Vec<f64>], counts: &[bool]) -> f64 {
    let all = residuals.iter().flatten().zip(counts);
    let (mut sum, mut n) = (0.0, 0_usize);
    for (r, _) in all.filter(|(_, counts)| **counts) {
        sum += if r.is_nan() { f64::INFINITY } else { r * r };
        n += 1;
    }
    (sum / n.max(1) as f64).sqrt()
}
