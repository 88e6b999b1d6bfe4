//! Which columns are asked for: one a parameter of the present model, and those of each way to take a candidate.

use crate::candidate::Candidate;
use crate::latent_force::fit::Hypothesis;
use crate::latent_force::step_error::StepError;
use crate::latent_force::step_map::Variation;

use super::form::Form;
use super::source::Wanted;
use super::{BASE_SHARE, MOST, SECANT, SHARE};

/// A parameter that acts in proportion, at one of the starts of its candidate: candidate, values to begin with, parameter.
pub(super) type Trial = (usize, Vec<f64>, usize);

/// Columns that are asked for.
#[derive(Default)]
pub(super) struct Asked {
    /// Where the prior's center lies from the present point, in deviations; one a column.
    pub(super) center: Vec<f64>,
    /// Bounds about the present point, in deviations.
    pub(super) bounds: Vec<[f64; 2]>,
    /// Columns of the present model's own unknowns, which come first.
    pub(super) base: usize,
    /// What stands behind the others.
    pub(super) wanted: Vec<Wanted>,
    /// The ways to take the candidates.
    pub(super) forms: Vec<Form>,
}

/// Bounds of a slope with a prior of deviation `size`, in deviations about its null.
pub(super) fn bounds(candidate: &Candidate, parameter: usize, size: f64) -> [f64; 2] {
    let [low, high] = candidate.limits(parameter);
    let null = candidate.parameters()[parameter].null;
    [
        ((low - null) / size).max(-MOST),
        ((high - null) / size).min(MOST),
    ]
}

/// Every start of every candidate, with the slopes at it.
pub(super) fn trials(candidates: &[Candidate]) -> Vec<Trial> {
    let mut trials = Vec::new();
    for (c, candidate) in candidates.iter().enumerate() {
        for begin in &candidate.starts {
            let slopes = candidate.slopes().into_iter();
            trials.extend(slopes.map(|p| (c, begin.clone(), p)));
        }
    }
    trials
}

impl Asked {
    /// Columns of a model's own unknowns at `theta`, and the points that they are taken at.
    pub(super) fn of_model(model: &Hypothesis, theta: &[f64]) -> (Self, Vec<Variation>) {
        let mut asked = Self::default();
        let free = model.free();
        let variation = |&i: &usize| {
            let u = &model.unknowns[i];
            let up = theta[i] + BASE_SHARE * u.deviation <= u.bounds[1];
            let share = if up { BASE_SHARE } else { -BASE_SHARE };
            let mut other = theta.to_vec();
            other[i] += share * u.deviation;
            asked.center.push(-u.distance(theta[i]));
            let bounds = u.bounds.map(|b| (b - theta[i]) / u.deviation);
            asked.bounds.push(bounds);
            Variation {
                theta: other,
                scale: share,
            }
        };
        let variations = free.iter().map(variation).collect();
        asked.base = free.len();
        (asked, variations)
    }

    /// Adds the engine's own error to those of the present model.
    pub(super) fn add_step_error(&mut self, error: &StepError) {
        self.base += error.columns();
        self.center.extend(error.center());
        self.bounds
            .resize(self.base, [f64::NEG_INFINITY, f64::INFINITY]);
    }

    /// Adds those of all candidates; `sizes` are the deviations of the priors of their [`trials`], 0 for what does nothing. Where segments are
    /// `replayed`, what is large is a secant beside its slopes: a replay in which a joint moves has no slope that tells of one that stands.
    pub(super) fn add(&mut self, candidates: &[Candidate], sizes: &[f64], replayed: bool) {
        let mut sizes = sizes.iter();
        for (c, candidate) in candidates.iter().enumerate() {
            for begin in &candidate.starts {
                let first = self.base + self.wanted.len();
                let mut slopes = Vec::new();
                if candidate.slopes().is_empty() {
                    self.push_secant(c, begin);
                    slopes.push(None);
                }
                for p in candidate.slopes() {
                    let size = sizes.next().copied().unwrap_or(0.0);
                    if size <= 0.0 {
                        continue;
                    }
                    let mut slope = Wanted::slope(candidates, c, begin, p, SHARE * size);
                    slope.scale /= size;
                    self.push(slope, bounds(candidate, p, size));
                    slopes.push(Some((p, size)));
                }
                if !slopes.is_empty() {
                    self.forms.push(Form {
                        candidate: c,
                        begin: begin.clone(),
                        slopes,
                        first,
                    });
                }
            }
            for begin in candidate.large.iter().filter(|_| replayed) {
                self.forms.push(Form {
                    candidate: c,
                    begin: begin.clone(),
                    slopes: vec![None],
                    first: self.base + self.wanted.len(),
                });
                self.push_secant(c, begin);
            }
        }
    }

    /// Values that each slope begins at, none of a secant; one a column beyond the present model's.
    pub(super) fn begins(&self) -> Vec<Option<&[f64]>> {
        let mut begins = Vec::new();
        for form in &self.forms {
            debug_assert_eq!(form.first - self.base, begins.len());
            let slopes = form.slopes.iter();
            begins.extend(slopes.map(|s| s.map(|_| &form.begin[..])));
        }
        begins
    }

    /// Adds what a candidate does at some values.
    fn push_secant(&mut self, candidate: usize, values: &[f64]) {
        let secant = Wanted {
            candidate,
            values: values.to_vec(),
            scale: 1.0,
        };
        self.push(secant, [0.0, SECANT]);
    }

    fn push(&mut self, wanted: Wanted, bounds: [f64; 2]) {
        self.wanted.push(wanted);
        self.center.push(0.0);
        self.bounds.push(bounds);
    }
}
