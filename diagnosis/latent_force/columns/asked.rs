//! Which columns are requested: one per parameter of the present model, and those of each way to
//! take a candidate.

use crate::candidate::Candidate;
use crate::latent_force::fit::Hypothesis;
use crate::latent_force::step_error::StepError;
use crate::latent_force::step_map::Variation;

use super::form::Form;
use super::source::Wanted;
use super::{BASE_SHARE, MOST, SECANT, SHARE};

/// A parameter that acts in proportion, at one start of its candidate: candidate, start values,
/// parameter.
pub(super) type Trial = (usize, Vec<f64>, usize);

/// The requested columns.
#[derive(Default)]
pub(super) struct Asked {
    /// Prior's center relative to the present point, in standard deviations; one per column.
    pub(super) center: Vec<f64>,
    /// Bounds about the present point, in standard deviations.
    pub(super) bounds: Vec<[f64; 2]>,
    /// Number of columns of the present model's own unknowns, which come first.
    pub(super) base: usize,
    /// The candidates' values behind the other columns.
    pub(super) wanted: Vec<Wanted>,
    /// The ways to take the candidates.
    pub(super) forms: Vec<Form>,
}

/// Bounds of a derivative's coefficient with a prior standard deviation `size`, in those units
/// about its null.
pub(super) fn bounds(candidate: &Candidate, parameter: usize, size: f64) -> [f64; 2] {
    let [low, high] = candidate.limits(parameter);
    let null = candidate.parameters()[parameter].null;
    [
        ((low - null) / size).max(-MOST),
        ((high - null) / size).min(MOST),
    ]
}

/// Returns every start of every candidate, with the parameters that act in proportion there.
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
    /// Returns the columns of a model's own unknowns at `theta`, and the points of their finite
    /// differences.
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

    /// Adds the engine's own error to the columns of the present model.
    pub(super) fn add_step_error(&mut self, error: &StepError) {
        self.base += error.columns();
        self.center.extend(error.center());
        self.bounds
            .resize(self.base, [f64::NEG_INFINITY, f64::INFINITY]);
    }

    /// Adds the columns of all candidates.
    ///
    /// `sizes` are the priors' standard deviations of their [`trials`], 0 for a parameter without
    /// effect. Where segments are `replayed`, large values are secants in addition to the
    /// derivatives: a replay in which a joint moves has no derivative that shows one held by
    /// friction.
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

    /// Returns the values at which each derivative begins, `None` for a secant; one per column
    /// beyond the present model's.
    pub(super) fn begins(&self) -> Vec<Option<&[f64]>> {
        let mut begins = Vec::new();
        for form in &self.forms {
            debug_assert_eq!(form.first - self.base, begins.len());
            let slopes = form.slopes.iter();
            begins.extend(slopes.map(|s| s.map(|_| &form.begin[..])));
        }
        begins
    }

    /// Adds the effect of a candidate at given values.
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
