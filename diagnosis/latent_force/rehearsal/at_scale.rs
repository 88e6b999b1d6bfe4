//! Drawn logs as a screening sees them at one scale of the missing force's variances.
//!
//! A screening takes the largest evidence over scales, and so do the draws. Logs are drawn at the
//! most likely scale `s*`, with the covariance `S* = R + s* Q` of the readings, and are screened at
//! a scale `s` with `S = R + s Q`. There `X' S^-1 y` has the covariance `X' S^-1 S* S^-1 X`, and not
//! the information `X' S^-1 X`: below `s*` the force of the drawn logs exceeds what that scale
//! allows. `S* = S + (s* - s) Q` makes the covariance `G - (s* - s) dG / ds`. Along one direction the
//! information is `g = x^2 / (r + s q)`, and with `g'` that at another scale `s'`
//!
//! ```text
//! -s dg / ds = g k      k = s q / (r + s q) = (g / g' - 1) / (s' / s - 1)
//! ```
//!
//! So a deviation is `sqrt(1 + (s* / s - 1) k)` times that of logs of the scale itself.

use nalgebra::{DMatrix, DVector};

use crate::latent_force::columns::{Columns, Form};
use crate::latent_force::evidence::evidence;
use crate::latent_force::scales::OneScale;

use super::{projected, root};

/// Largest square of a standard normal in all draws of all columns, once in a hundred screenings:
/// 199 draws of 600 columns.
const LARGEST_SQUARE: f64 = 30.0;

/// A form with the quantities that its evidence needs.
pub(super) struct Ranked<'a> {
    form: &'a Form,
    /// Logarithm of its prior odds.
    odds: f64,
    /// Its columns, as places among those of the regression.
    places: Vec<usize>,
    /// Inverse of `G + 1`, and half the logarithm of its determinant.
    inverse: DMatrix<f64>,
    half_log: f64,
    /// Bounds of the coefficient, if there is only one.
    bounds: Option<[f64; 2]>,
}

impl<'a> Ranked<'a> {
    /// A form by the information `gram` of some `columns`; `None` if its own are not among them.
    fn of(
        (form, odds): (&'a Form, f64),
        (gram, columns): (&DMatrix<f64>, &[usize]),
        bounds: &[[f64; 2]],
    ) -> Option<Self> {
        let place = |c: usize| columns.binary_search(&c).ok();
        let places: Vec<usize> = form.columns().map(place).collect::<Option<_>>()?;
        let n = places.len();
        let own = DMatrix::from_fn(n, n, |i, j| {
            gram[(places[i], places[j])] + f64::from(u8::from(i == j))
        });
        let factor = own.cholesky()?;
        let half_log = factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum();
        Some(Self {
            form,
            odds,
            bounds: (n == 1).then(|| bounds[form.first]),
            places,
            inverse: factor.inverse(),
            half_log,
        })
    }

    /// Evidence for the form if `X'y` is `moment`, with its prior odds.
    fn gain(&self, moment: &DVector<f64>) -> f64 {
        let b = DVector::from_fn(self.places.len(), |i, _| moment[self.places[i]]);
        let c = &self.inverse * &b;
        if let Some([low, high]) = self.bounds {
            let c = c[0].clamp(low, high);
            return self.odds + b[0] * c - 0.5 * c * c / self.inverse[(0, 0)] - self.half_log;
        }
        self.odds + 0.5 * b.dot(&c) - self.half_log
    }
}

/// Drawn logs at one scale.
pub(super) struct AtScale<'a> {
    columns: Vec<usize>,
    /// The information of the columns, the present model projected out, and its factor.
    pub(super) gram: DMatrix<f64>,
    root: DMatrix<f64>,
    /// Deviation of each entry of `X'y` relative to that of logs of this scale.
    excess: DVector<f64>,
    forms: Vec<Ranked<'a>>,
    /// Evidence of the present model alone at this scale, less that at its best scale.
    behind: f64,
}

impl<'a> AtScale<'a> {
    /// Logs drawn at a scale `drawn` as seen at another one; `none` is the evidence of the present
    /// model alone at its best scale.
    ///
    /// `None` if no draw reaches the evidence `found` there, or if the columns have no information.
    pub(super) fn of(
        at: &OneScale<'_>,
        (columns, odds): (&'a Columns, &[f64]),
        (drawn, none): (f64, f64),
        found: f64,
    ) -> Option<Self> {
        let gram = projected(&at.sum.gram, columns.base);
        let excess = excess(at, (&gram, columns.base), drawn);
        let behind = behind(at, columns) - none;
        let widest = columns.forms.iter().map(|f| f.slopes.len()).max();
        let largest = 0.5 * LARGEST_SQUARE * excess.amax().powi(2) * widest? as f64;
        if behind + largest < found {
            return None;
        }
        let ranked =
            columns.forms.iter().zip(odds).filter_map(|(f, odds)| {
                Ranked::of((f, *odds), (&gram, &at.columns), &columns.bounds)
            });
        Some(Self {
            forms: ranked.collect(),
            root: root(&gram)?,
            columns: at.columns.clone(),
            gram,
            excess,
            behind,
        })
    }

    /// `X'y` of a draw, which has a standard normal for each column of the screening.
    pub(super) fn moment(&self, draw: &DVector<f64>) -> DVector<f64> {
        let own = DVector::from_fn(self.columns.len(), |i, _| draw[self.columns[i]]);
        (&self.root * own).component_mul(&self.excess)
    }

    /// Largest evidence of all forms if `X'y` is `moment`, relative to that of the present model at
    /// its best scale, and the form's candidate.
    pub(super) fn best(&self, moment: &DVector<f64>) -> (f64, usize) {
        let forms = self.forms.iter();
        let gains = forms.map(|f| (self.behind + f.gain(moment), f.form.candidate));
        let none = (f64::NEG_INFINITY, 0);
        gains.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or(none)
    }
}

/// Evidence of the present model alone at a scale.
pub(super) fn behind(at: &OneScale<'_>, columns: &Columns) -> f64 {
    let base: Vec<usize> = (0..columns.base).collect();
    let (center, bounds) = (&columns.center[..], &columns.bounds[..]);
    let sum = at.sum;
    sum.log_likelihood + evidence(&sum.gram, &sum.moment, &base, center, bounds).gain
}

/// Deviation of each entry of `X'y` of logs drawn at a scale, relative to that of logs of the scale
/// at which they are screened.
///
/// `gram` is the information there, with the `base` columns of the present model projected out.
fn excess(at: &OneScale<'_>, (gram, base): (&DMatrix<f64>, usize), drawn: f64) -> DVector<f64> {
    let beyond = (drawn / at.scale - 1.0).max(0.0);
    let Some((scale, wider)) = at.wider.as_ref().filter(|_| beyond > 0.0) else {
        return DVector::from_element(gram.nrows(), 1.0);
    };
    let wider = projected(wider, base);
    DVector::from_fn(gram.nrows(), |i, _| {
        let (own, other) = (gram[(i, i)], wider[(i, i)]);
        let share = (own / other - 1.0) / (scale / at.scale - 1.0);
        // A column without information has none at any scale.
        let share = if share.is_finite() {
            share.clamp(0.0, 1.0)
        } else {
            0.0
        };
        (1.0 + beyond * share).sqrt()
    })
}
