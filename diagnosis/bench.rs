//! The bench on which explanations are tried: the machine, the logs, their noise, and the initial
//! states of the episodes.

pub mod held_out;

use asid_core::layout::Layout;
use asid_core::progress::Silent;
use asid_core::{Parameter, Progress, Result};
use asid_effects::EffectSpec;

use crate::candidate::Candidate;
use crate::fit::{Begin, Effort, Fit, cost, fit};
use crate::linearise::{Open, Unknown};
use crate::machine::Machine;
use crate::predict::{Point, Predictor, State};
use crate::record::Record;

/// Number of points that one batch takes.
pub const CAPACITY: usize = 8;

/// A set of effects, with all parameters fitted.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// Effects at their sites, with the values of all their parameters.
    pub effects: Vec<EffectSpec>,
    /// Which of the effects are ordinary tolerances, which are never named.
    pub is_tolerance: Vec<bool>,
    /// The study's parameters, followed by those of the effects.
    pub unknowns: Vec<Unknown>,
    /// The fit to the training logs.
    pub fit: Fit,
    /// Sum of squared residuals of the held-out logs.
    pub held_out: f64,
    /// Initial states of the held-out episodes under this explanation.
    pub held_starts: Vec<State>,
    /// Each unknown as estimated by a fit that allows for a missing force; `None` where there is
    /// none.
    pub local: Vec<Option<Local>>,
}

#[cfg(test)]
impl Explanation {
    /// Without effects: each parameter in the middle of its range, with a covariance, and all of
    /// so many residuals 0.
    pub(crate) fn of_parameters(
        parameters: &[Parameter],
        covariance: nalgebra::DMatrix<f64>,
        residuals: usize,
    ) -> Self {
        let n = parameters.len();
        let middle = |p: &Parameter| 0.5 * (p.range[0] + p.range[1]);
        Self {
            effects: Vec::new(),
            is_tolerance: Vec::new(),
            unknowns: parameters.iter().cloned().map(Unknown::free).collect(),
            fit: Fit {
                point: Point {
                    theta: parameters.iter().map(middle).collect(),
                    starts: Vec::new(),
                },
                cost: 0.0,
                residuals: vec![0.0; residuals],
                shows: vec![1.0; n],
                gains: nalgebra::DMatrix::zeros(n, residuals),
                covariance,
                unresolved: vec![false; n],
                free: (0..n).collect(),
                starts: std::sync::Arc::default(),
            },
            held_out: 0.0,
            held_starts: Vec::new(),
            local: vec![None; n],
        }
    }
}

/// A value as estimated by a fit that allows for a missing force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Mean of the posterior, in the value's unit.
    pub mean: f64,
    /// Variance of the posterior, in the square of the value's unit.
    pub variance: f64,
}

impl Explanation {
    /// Returns the labels of the effects that the explanation names, sorted; empty for none.
    #[must_use]
    pub fn labels(&self) -> Vec<String> {
        let all = self.effects.iter().zip(&self.is_tolerance);
        let named = all.filter(|(_, is_tolerance)| !**is_tolerance);
        let mut labels: Vec<String> = named.map(|(e, _)| e.label()).collect();
        labels.sort();
        labels
    }

    /// Returns the parameters, in the order of the fit's point.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        self.unknowns.iter().map(|u| u.parameter.clone()).collect()
    }
}

/// The bench.
pub struct Bench {
    /// The machine.
    pub machine: Machine,
    /// Logs that models are fitted to.
    pub train: Record,
    /// Held-out logs.
    pub test: Record,
    /// The study's parameters.
    pub parameters: Vec<Parameter>,
    /// Coordinates of the initial states that the logs do not give.
    pub open: Open,
    /// How far each of these may lie from its first guess, m or rad or per second
    /// (`starts::reach`).
    pub reach: Vec<f64>,
    /// The first tenth of the held-out logs, on which unknown initial states are fitted.
    pub head: Record,
}

/// An effect to be tried: a candidate, and values to start from.
pub type Trial<'a> = (&'a Candidate, Vec<f64>);

/// Widens the range of an effect's parameter so that it contains a value, to twice that value.
///
/// The steps of its finite differences are shares of the range.
fn around(mut parameter: Parameter, value: f64) -> Parameter {
    let [low, high] = &mut parameter.range;
    if value < *low {
        *low = 2.0 * value;
    }
    if value > *high {
        *high = 2.0 * value;
    }
    parameter
}

/// Returns the effects of trials at their sites.
#[must_use]
pub fn specs(trials: &[Trial<'_>]) -> Vec<EffectSpec> {
    trials.iter().map(|(c, _)| c.spec.clone()).collect()
}

impl Bench {
    /// Returns the layout of the machine: names and places.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.machine.plant.layout
    }

    /// Returns the study's parameters, followed by those of the effects.
    #[must_use]
    pub fn unknowns(&self, trials: &[Trial<'_>]) -> Vec<Unknown> {
        let mut all: Vec<Unknown> = self.parameters.iter().cloned().map(Unknown::free).collect();
        for (candidate, values) in trials {
            let own = candidate.unknowns().into_iter().zip(values);
            all.extend(own.map(|((parameter, free), value)| Unknown {
                parameter: around(parameter, *value),
                free,
            }));
        }
        all
    }

    /// Returns the parameters in the order of [`Bench::unknowns`].
    #[must_use]
    pub fn all_parameters(&self, trials: &[Trial<'_>]) -> Vec<Parameter> {
        let unknowns = self.unknowns(trials).into_iter();
        unknowns.map(|u| u.parameter).collect()
    }

    /// Returns a predictor of some logs for the model with some effects.
    ///
    /// # Errors
    /// When the engine refuses an effect or a parameter.
    pub fn predictor<'r>(&self, trials: &[Trial<'_>], record: &'r Record) -> Result<Predictor<'r>> {
        let model = self.machine.with(&specs(trials))?;
        let parameters = self.all_parameters(trials);
        let threads = self.machine.threads;
        Predictor::new(&*model, &parameters, &record.logs, CAPACITY, threads)
    }

    /// Fits the parameters of the study and of some effects to the training logs, and replays the
    /// held-out logs.
    ///
    /// # Errors
    /// As [`Bench::predictor`], and when a rollout fails.
    pub fn explain(
        &self,
        trials: &[Trial<'_>],
        begin: Begin<'_>,
        how: (Effort, &dyn Progress),
    ) -> Result<Explanation> {
        let unknowns = self.unknowns(trials);
        let mut predictor = self.predictor(trials, &self.train)?;
        let fit = fit(&mut predictor, (self.layout(), &unknowns), begin, how)?;
        let mut at = self.parameters.len();
        let effects = trials
            .iter()
            .map(|(candidate, _)| {
                let names = candidate.parameters().iter().map(|p| p.name.to_owned());
                let n = candidate.parameters().len();
                let values = fit.point.theta[at..at + n].iter().copied();
                at += n;
                EffectSpec {
                    values: names.zip(values).collect(),
                    ..candidate.spec.clone()
                }
            })
            .collect();
        let mut explanation = Explanation {
            effects,
            is_tolerance: trials.iter().map(|(c, _)| c.is_tolerance).collect(),
            local: vec![None; unknowns.len()],
            unknowns,
            fit,
            held_out: f64::NAN,
            held_starts: self.test.starts.clone(),
        };
        self.hold_out(trials, &mut explanation)?;
        Ok(explanation)
    }

    /// Sets the noise of each sensor in all records.
    pub fn set_noise(&mut self, noise: &[f64]) {
        for record in [&mut self.train, &mut self.test, &mut self.head] {
            record.logs.set_noise(noise);
        }
    }

    /// Sets over how many successive readings the noise of each sensor is alike, in all records.
    pub fn set_alike(&mut self, alike: &[f64]) {
        for record in [&mut self.train, &mut self.test, &mut self.head] {
            for (sensor, &alike) in record.logs.sensors.iter_mut().zip(alike) {
                sensor.alike = alike;
            }
        }
    }

    /// Replays the held-out logs at an explanation's parameters and stores the sum of squared
    /// residuals.
    ///
    /// Unknown initial states are fitted on the first tenth, which then does not count.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn hold_out(&self, trials: &[Trial<'_>], of: &mut Explanation) -> Result<()> {
        let theta = &of.fit.point.theta;
        let (point, residuals) = self.replay_held_out(trials, theta, &of.held_starts)?;
        let values = point.theta[self.parameters.len()..].iter();
        let own = of.effects.iter_mut().flat_map(|e| &mut e.values);
        own.zip(values).for_each(|((_, own), value)| *own = *value);
        of.fit.point.theta = point.theta;
        of.held_starts = point.starts;
        of.held_out = cost(&residuals);
        Ok(())
    }

    /// Recomputes an explanation's sum of squared residuals of the held-out logs with the present
    /// noise.
    ///
    /// The initial states stay as fitted.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn rescore_held_out(&self, trials: &[Trial<'_>], of: &mut Explanation) -> Result<()> {
        let point = Point {
            theta: of.fit.point.theta.clone(),
            starts: of.held_starts.clone(),
        };
        of.held_out = cost(&self.residuals_held_out(trials, &point)?);
        Ok(())
    }

    /// Returns the residuals of the held-out logs; the first tenth is zero where initial states
    /// were fitted to it.
    fn residuals_held_out(&self, trials: &[Trial<'_>], point: &Point) -> Result<Vec<f64>> {
        let mut predictor = self.predictor(trials, &self.test)?;
        let residuals = predictor.residuals(std::slice::from_ref(point))?.pop();
        let mut residuals = residuals.unwrap_or_default();
        self.mask_head(&mut residuals);
        Ok(residuals)
    }

    /// Replays the held-out logs at some values, with fits of initial states beginning at `from`.
    ///
    /// Returns the point, with the [own values](Bench::head_point) of these logs, and the
    /// residuals. The first tenth of the residuals is zero where initial states were fitted to it.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn replay_held_out(
        &self,
        trials: &[Trial<'_>],
        theta: &[f64],
        from: &[State],
    ) -> Result<(Point, Vec<f64>)> {
        let point = self.head_point(trials, theta, from)?;
        let residuals = self.residuals_held_out(trials, &point)?;
        Ok((point, residuals))
    }

    /// Fits what belongs to the held-out episodes alone on their first tenth.
    ///
    /// These are the initial states, where they are unknown, and the values of effects that hold in
    /// one of these episodes only.
    ///
    /// # Errors
    /// When a rollout fails.
    pub fn head_point(&self, trials: &[Trial<'_>], theta: &[f64], from: &[State]) -> Result<Point> {
        let mut unknowns = self.unknowns(trials);
        unknowns.iter_mut().for_each(|u| u.free = false);
        let of_effects = trials.iter().flat_map(|(c, _)| self.of_held_out(c));
        let own = unknowns[self.parameters.len()..].iter_mut();
        own.zip(of_effects).for_each(|(u, free)| u.free = free);
        let point = Point {
            theta: theta.to_vec(),
            starts: from.to_vec(),
        };
        if self.open.is_empty() && unknowns.iter().all(|u| !u.free) {
            return Ok(point);
        }
        let mut predictor = self.predictor(trials, &self.head)?;
        let fit = fit(
            &mut predictor,
            (self.layout(), &unknowns),
            Begin::at(point, (&self.open, &self.reach)),
            (Effort::START, &Silent),
        )?;
        Ok(fit.point)
    }

    /// Whether each parameter of a candidate is a value of a held-out episode alone.
    fn of_held_out(&self, candidate: &Candidate) -> Vec<bool> {
        let held = |number| self.test.logs.episodes.iter().any(|e| e.number == number);
        let parameters = candidate.parameters().iter();
        parameters.map(|p| p.episode.is_some_and(held)).collect()
    }

    /// Sets the residuals of the first tenth of the held-out episodes to zero, where initial states
    /// were fitted on it.
    pub fn mask_head(&self, residuals: &mut [f64]) {
        if self.open.is_empty() {
            return;
        }
        let n = self.test.logs.entries.len();
        for e in 0..self.test.logs.episodes.len() {
            let first = self.test.logs.offset(e);
            let rows = self.head.logs.episodes[e].plan.rows();
            residuals[first..first + rows * n].fill(0.0);
        }
    }

    /// Returns the number of readings of the held-out logs that count.
    #[must_use]
    pub fn held_readings(&self) -> f64 {
        if self.open.is_empty() {
            self.test.readings as f64
        } else {
            (self.test.readings - self.head.readings) as f64
        }
    }
}
