//! What the scorer's own replays say: whether a verdict is the same physics as the truth, and how much of the gap that
//! could be closed it closed.
//!
//! Nothing here searches. A set of effects that somebody names is put into the study's model and fitted, from the
//! values that its author gives: the label's for the truth, the diagnosis' own for its verdict.

pub(crate) mod fit;
pub(crate) mod logs;
pub(crate) mod model;
pub(crate) mod start;
mod study;

use std::path::Path;
use std::sync::Arc;

use asid_core::{Backend, Error, Result};
use asid_effects::EffectSpec;
use serde::Serialize;

use crate::answer::Answer;
use crate::catalogue::parameters_of;
use crate::judge::Judge;
use crate::label::{Label, name_of, site_of};
use crate::sites::Sites;
pub use study::Study;

use fit::{Fit, robust_deviation};
use logs::{Logs, head_rows};
use model::{Engine, Point, World};
use start::{State, first_state, open_coordinates};

/// Difference of noise-free predictions, root mean square in units of the noise, below which two sets of effects are
/// the same physics: a likelihood ratio could tell them apart from some 400 readings on, were the noise white and
/// the model otherwise exact, which it is not.
pub const SAME: f64 = 0.1;
/// Share of a log on which a start that it does not give is fitted, and which then does not count.
const HEAD: f64 = 0.1;
/// Residual, in robust deviations of the best model's, from which on a reading is an outlier of the log and counts for
/// no model: a normal reading in half a thousand million is.
const OUTLIER: f64 = 6.0;
/// Excess, in units of the noise, below which there is no gap to close: the contract's 1.05 of the whole gap.
const NO_GAP: f64 = 0.32;

/// Gaps on the logs held out, root mean square in units of the noise, all by the same replays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Gaps {
    /// With the study's parameters fitted.
    pub identified: f64,
    /// As the diagnosis left the model: its parameters, its effects, its values.
    pub refined: f64,
    /// With the true effects fitted.
    pub best: f64,
    /// Share of what the true effects close that the diagnosis closed; null where they close nothing.
    pub closed_of_possible: Option<f64>,
}

/// What replays say of a case.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Physics {
    /// Whether the verdict's effects are the same physics as the truth; null where that was not asked: the names agree,
    /// or one of both is no set of effects.
    pub same_as_truth: Option<bool>,
    /// Root mean square difference of their noise-free predictions, in units of the noise.
    pub distance: Option<f64>,
    /// Gaps; null where the truth cannot be fitted.
    pub gaps: Option<Gaps>,
    /// Why there are no replays, where there are none.
    pub skipped: Option<String>,
}

impl Physics {
    /// Of a case without replays, with the reason.
    #[must_use]
    pub fn skipped(why: impl ToString) -> Self {
        Self {
            skipped: Some(why.to_string()),
            ..Self::default()
        }
    }
}

/// What the machine of the study in a folder says of names.
///
/// # Errors
/// When the study cannot be read.
pub fn sites_of(folder: &Path) -> Result<Sites> {
    Ok(Sites::of(&Study::read(folder)?.plant))
}

/// Replays a case whose study lies in `folder`.
#[must_use]
pub fn examine(
    backend: Arc<dyn Backend>,
    folder: &Path,
    judge: &Judge<'_>,
    answer: &Answer,
) -> Physics {
    let examined = Study::read(folder).and_then(|study| {
        let logs = Logs::of(&study, judge.label, Some(answer))?;
        let mut bench = Bench {
            engine: Engine::new(backend, &study)?,
            study: &study,
            logs,
        };
        bench.examine(judge, answer)
    });
    examined.unwrap_or_else(Physics::skipped)
}

/// Sizes from which an effect without values is fitted, as shares of the way from where it is off to an end of a range.
const SIZES: [f64; 3] = [1e-3, 1e-2, 1e-1];

/// A study on an engine, with its logs.
struct Bench<'a> {
    engine: Engine,
    study: &'a Study,
    /// To fit to, and held out.
    logs: [Logs; 2],
}

/// Effects with values, and values of the study's parameters, as somebody names them.
struct Named<'a> {
    effects: Vec<EffectSpec>,
    parameters: Box<dyn Fn(&str) -> Option<f64> + 'a>,
}

/// The true effects. A fit begins at the label's values; where it has none that the catalogue knows, at those of the
/// answer, if it names the same effect.
fn truth<'a>(label: &'a Label, answer: &Answer, sites: &Sites) -> Named<'a> {
    let values = |effect: &String| -> Vec<(String, f64)> {
        let known = parameters_of(name_of(effect)).unwrap_or_default();
        let labelled = known
            .iter()
            .filter_map(|p| Some((p.name.to_owned(), label.value(effect, p.name)?)));
        let labelled: Vec<(String, f64)> = labelled.collect();
        let said = || {
            answer
                .effects
                .iter()
                .find(|e| sites.same(&e.label(), effect))
        };
        match (labelled.is_empty(), said()) {
            (true, Some(said)) => said.parameters.clone().into_iter().collect(),
            _ => labelled,
        }
    };
    let spec = |effect: &String| EffectSpec {
        name: name_of(effect).to_owned(),
        site: site_of(effect).to_owned(),
        values: values(effect),
    };
    Named {
        effects: label.effects.iter().map(spec).collect(),
        parameters: Box::new(|name| label.parameters.get(name).copied()),
    }
}

fn verdict<'a>(answer: &'a Answer) -> Named<'a> {
    let spec = |effect: &String| EffectSpec {
        name: name_of(effect).to_owned(),
        site: site_of(effect).to_owned(),
        values: answer
            .values(effect)
            .map(|v| v.parameters.clone().into_iter().collect())
            .unwrap_or_default(),
    };
    let estimate = |name: &str| {
        let found = answer.parameters.iter().find(|p| p.name == name)?;
        Some(found.estimate)
    };
    Named {
        effects: answer.verdict.effects.iter().map(spec).collect(),
        parameters: Box::new(estimate),
    }
}

impl Bench<'_> {
    fn examine(&mut self, judge: &Judge<'_>, answer: &Answer) -> Result<Physics> {
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
        if !names_agree && !label.is_none() && answer.verdict.kind != "unknown" {
            let said = verdict(answer);
            let targets = self.predictions(&true_world, &best)?;
            let distance = self.distance(&said, &targets)?;
            // A set that holds more than it takes can always imitate the truth: each of its effects must be needed.
            let same = distance < SAME && self.each_is_needed(&said, &targets)?;
            physics.distance = Some(distance);
            physics.same_as_truth = Some(same);
        }
        Ok(physics)
    }

    /// First states of some logs, and the coordinates that some log leaves open.
    fn starts(&self, which: usize) -> (Vec<State>, Vec<usize>) {
        let episodes = || self.logs[which].logs.iter().map(|l| &l.episode);
        let first = |e| first_state(&self.study.plant, e);
        let open = open_coordinates(&self.study.plant.layout, episodes());
        (episodes().map(first).collect(), open)
    }

    /// A set fitted to the training logs: its world, and its values.
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

    /// Where the fit of an effect begins whose values nobody gives: at the size, of some over three decades of its
    /// parameters' ranges, that leaves the least, or where it is off.
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

    /// A point for the logs held out: the values given, and starts fitted to the heads where logs leave them open.
    fn held_out(&mut self, world: &World, values: &[f64]) -> Result<(Point, bool)> {
        let (starts, open) = self.starts(1);
        let fitted = !open.is_empty();
        let layout = &self.study.plant.layout;
        let mut fit = Fit::new(layout, world, open)?.starts_only();
        let point = Point {
            values: values.to_vec(),
            starts,
        };
        let mut heads = self.logs[1].heads(layout, HEAD)?;
        Ok((fit.run(&mut heads, point)?, fitted))
    }

    /// Residuals on the logs held out; NaN where a reading is missing or does not count.
    fn residuals(&mut self, world: &World, values: &[f64]) -> Result<Vec<Vec<f64>>> {
        let (point, fitted) = self.held_out(world, values)?;
        let mut fit = Fit::new(&self.study.plant.layout, world, Vec::new())?;
        let readings = fit.predict(&mut self.logs[1], &point)?;
        let logs = &self.logs[1];
        let n = logs.signals.whitened_len();
        let mut residuals = logs.residuals(&readings);
        if fitted {
            for (log, residuals) in logs.logs.iter().zip(&mut residuals) {
                let head = head_rows(log.episode.rows(), HEAD);
                residuals[..head * n].fill(f64::NAN);
            }
        }
        Ok(residuals)
    }

    fn gaps(
        &mut self,
        label: &Label,
        answer: &Answer,
        (true_world, best): (&World, &[f64]),
    ) -> Result<Gaps> {
        let none = Named {
            effects: Vec::new(),
            parameters: Box::new(|name| label.parameters.get(name).copied()),
        };
        let (world, values) = self.fitted(&none)?;
        let identified = self.residuals(&world, &values)?;
        let best = self.residuals(true_world, best)?;
        let said = verdict(answer);
        let refined = if answer.verdict.kind == "effects" {
            let world = self
                .engine
                .world(self.study, &said.effects, &*said.parameters)?;
            let values: Vec<f64> = world.unknowns.iter().map(|u| u.start).collect();
            self.residuals(&world, &values)?
        } else {
            identified.clone()
        };
        let bound = OUTLIER * robust_deviation(&best).max(1.0);
        let counts: Vec<bool> = best
            .iter()
            .flatten()
            .map(|r| r.is_finite() && r.abs() <= bound)
            .collect();
        let [identified, refined, best] =
            [identified, refined, best].map(|residuals| gap(&residuals, &counts));
        let possible = identified * identified - best * best;
        let closed = identified * identified - refined * refined;
        Ok(Gaps {
            identified,
            refined,
            best,
            closed_of_possible: (possible > NO_GAP * NO_GAP).then(|| closed / possible),
        })
    }

    /// What a fitted world predicts in the logs to fit to and in those held out, without noise.
    fn predictions(&mut self, world: &World, values: &[f64]) -> Result<[Vec<Vec<f64>>; 2]> {
        let (starts, open) = self.starts(0);
        let layout = &self.study.plant.layout;
        let mut fit = Fit::new(layout, world, open)?.starts_only();
        let point = Point {
            values: values.to_vec(),
            starts,
        };
        let point = fit.run(&mut self.logs[0], point)?;
        let train = fit.predict(&mut self.logs[0], &point)?;
        let (point, _) = self.held_out(world, values)?;
        let test = fit.predict(&mut self.logs[1], &point)?;
        Ok([train, test])
    }

    /// Root mean square difference of `targets` and what a set predicts at its best refit to them, on the logs held
    /// out, in units of the noise.
    fn distance(&mut self, named: &Named<'_>, targets: &[Vec<Vec<f64>>; 2]) -> Result<f64> {
        let world = self
            .engine
            .world(self.study, &named.effects, &*named.parameters)?;
        let layout = &self.study.plant.layout;
        let mut values: Vec<f64> = world.unknowns.iter().map(|u| u.start).collect();
        let mut distance = f64::INFINITY;
        // All to the training logs; then, with these values, the open starts of those held out.
        for which in 0..2 {
            let (starts, open) = self.starts(which);
            let mut fit = Fit::new(layout, &world, open)?;
            if which == 1 {
                fit = fit.starts_only();
            }
            let mut logs = self.logs[which]
                .like(layout)?
                .with_readings(&targets[which]);
            let point = fit.run(&mut logs, Point { values, starts })?;
            let readings = fit.predict(&mut logs, &point)?;
            let residuals = logs.residuals(&readings);
            let present = logs.residuals(&targets[which]);
            let counts: Vec<bool> = present.iter().flatten().map(|r| r.is_finite()).collect();
            distance = gap(&residuals, &counts);
            values = point.values;
        }
        Ok(distance)
    }

    /// Whether a set without any one of its effects predicts something else than `targets`.
    fn each_is_needed(&mut self, named: &Named<'_>, targets: &[Vec<Vec<f64>>; 2]) -> Result<bool> {
        for left_out in 0..named.effects.len() {
            let mut effects = named.effects.clone();
            effects.remove(left_out);
            let fewer = Named {
                effects,
                parameters: Box::new(|name| (named.parameters)(name)),
            };
            if self.distance(&fewer, targets)? < SAME {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Root mean square of the residuals that count; infinite where one of them is missing: that simulation diverged.
fn gap(residuals: &[Vec<f64>], counts: &[bool]) -> f64 {
    let all = residuals.iter().flatten().zip(counts);
    let (mut sum, mut n) = (0.0, 0_usize);
    for (r, _) in all.filter(|(_, counts)| **counts) {
        sum += if r.is_nan() { f64::INFINITY } else { r * r };
        n += 1;
    }
    (sum / n.max(1) as f64).sqrt()
}
