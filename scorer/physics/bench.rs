//! A study on an engine: what sets of effects predict once they are fitted.

use std::sync::Arc;

use asid_core::{Backend, Error, Result};
use asid_effects::EffectSpec;

use super::fit::{Fit, robust_deviation};
use super::logs::{Logs, head_rows};
use super::model::{Engine, Point, World};
use super::start::{State, first_state, open_coordinates};
use super::study::Study;
use super::{Gaps, Physics};
use crate::answer::Answer;
use crate::catalogue::parameters_of;
use crate::judge::Judge;
use crate::label::{Label, name_of, site_of};
use crate::sites::Sites;

/// Difference of noise-free predictions, root mean square in units of the noise, below which two sets of effects are
/// the same physics: a likelihood ratio could tell them apart from some 400 readings on, were the noise white and
/// the model otherwise exact, which it is not.
const SAME: f64 = 0.1;
/// Share of a log on which a start that it does not give is fitted, and which then does not count.
const HEAD: f64 = 0.1;
/// Residual, in robust deviations of the best model's, from which on a reading is an outlier of the log and counts for
/// no model: a normal reading in half a thousand million is.
const OUTLIER: f64 = 6.0;
/// Excess, in units of the noise, below which there is no gap to close: the contract's 1.05 of the whole gap.
const NO_GAP: f64 = 0.32;
/// Sizes from which an effect without values is fitted, as shares of the way from where it is off to an end of a range.
const SIZES: [f64; 3] = [1e-3, 1e-2, 1e-1];

/// A study on an engine, with its logs.
pub struct Bench<'a> {
    engine: Engine,
    study: &'a Study,
    /// To fit to, and held out.
    logs: [Logs; 2],
}

/// Value of a parameter of the study, by its name.
type Known<'a> = Box<dyn Fn(&str) -> Option<f64> + 'a>;

/// Effects with values, and values of the study's parameters, as somebody names them.
struct Named<'a> {
    effects: Vec<EffectSpec>,
    parameters: Known<'a>,
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

impl<'a> Bench<'a> {
    /// Compiles the study's model and reads its logs.
    ///
    /// # Errors
    /// When the engine refuses the model, or the logs cannot be replayed.
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

    /// What replays say of an answer.
    ///
    /// # Errors
    /// When a set of effects cannot be put into the model, or the cause is in no catalogue.
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
