//! The regressions that rank candidates, at several scales of the missing force's variances.
//!
//! Where a law is missing, the noise model counts its force as chance, and the smoother absorbs
//! most of it. A slow force, such as that of viscous friction, then hardly shows. With the law in
//! the model the variance is smaller. So each set of columns gets the scale at which it is most
//! likely. An effect at one joint lowers the variance there and leaves those of other joints as
//! they are: they contain the many small errors of every machine.

use asid_effects::Reach;
use nalgebra::DMatrix;

use crate::candidate::Candidate;

use super::columns::Columns;
use super::context::Context;
use super::estimate::Estimate;
use super::evidence::evidence;
use super::fit::{SCALES, regression, regression_at};
use super::smoother::Regression;
use super::step_map::LinearEpisode;

/// Factors of one joint's variance: a third, a tenth and a thirtieth of the force is left to
/// chance.
const AT_A_JOINT: [f64; 3] = [0.1, 0.01, 0.001];

/// Largest number of joints with scales of their own.
///
/// Each joint costs as many passes of the filter as there are factors, and two arms have sixteen
/// joints.
const JOINTS: usize = 6;

/// Regressions at several scales of the variance of one degree of freedom.
///
/// Their columns are those of the present model and those that reach no other degree of freedom.
struct AtJoint {
    /// Indices of the columns among all columns, in ascending order.
    columns: Vec<usize>,
    sums: Vec<Regression>,
}

/// Regressions at all scales.
pub struct Scales {
    /// At common scales of all variances, on all columns; the first has the variances as they are.
    pub common: Vec<Regression>,
    joints: Vec<AtJoint>,
    /// Columns that reach the only degree of freedom, in ascending order; `None` if there are more,
    /// or segments. Common scales are its own.
    alone: Option<Vec<usize>>,
}

/// One of the regressions, and the one at the next larger variance on the same columns.
pub struct OneScale<'s> {
    /// The regression.
    pub sum: &'s Regression,
    /// Indices of its columns among all columns, in ascending order.
    pub columns: Vec<usize>,
    /// Its variance, relative to that of the estimate.
    pub scale: f64,
    /// Variance and `X'X` of the one at the next larger variance; `None` at the largest.
    pub wider: Option<(f64, DMatrix<f64>)>,
}

impl Scales {
    /// Computes the regressions on the columns of some candidates along an estimate.
    #[must_use]
    pub fn of(
        context: &Context<'_>,
        estimate: &Estimate,
        (columns, candidates): (&Columns, &[Candidate]),
    ) -> Self {
        let m = columns.center.len();
        let at = |&scale: &f64| regression(context, estimate, &columns.linear, scale, m);
        let at_joint = |dof: usize| {
            let own = reaching(context, (columns, candidates), dof);
            let scaled = |&scale: &f64| {
                let linear = &columns.linear;
                regression_at(context, estimate, linear, (dof, scale), (m, &own))
            };
            (own.len() > columns.base).then(|| AtJoint {
                sums: AT_A_JOINT.iter().map(scaled).collect(),
                columns: own.clone(),
            })
        };
        let is_alone = context.plant().layout.nv == 1 && !context.has_segments();
        Self {
            alone: is_alone.then(|| reaching(context, (columns, candidates), 0)),
            common: SCALES.iter().map(at).collect(),
            joints: lacking(context, estimate)
                .into_iter()
                .filter_map(at_joint)
                .collect(),
        }
    }

    /// Whether some columns, apart from the present model's, all reach one degree of freedom alone.
    #[must_use]
    pub fn at_one_joint(&self, columns: &[usize]) -> bool {
        let holds = |own: &Vec<usize>| columns.iter().all(|c| own.binary_search(c).is_ok());
        let joints = self.joints.iter().map(|joint| &joint.columns);
        joints.chain(&self.alone).any(holds)
    }

    /// Returns all regressions, at common scales first and in the order of [`Scales::common`].
    #[must_use]
    pub fn each(&self) -> Vec<OneScale<'_>> {
        let mut all: Vec<OneScale<'_>> = Vec::new();
        let n = self.common.first().map_or(0, |sum| sum.gram.nrows());
        for (sum, scale) in self.common.iter().zip(SCALES) {
            let wider = all.last().map(|w| (w.scale, w.sum.gram.clone()));
            all.push(OneScale {
                sum,
                columns: (0..n).collect(),
                scale,
                wider,
            });
        }
        for joint in &self.joints {
            let own = |sum: &Regression| {
                let rows = sum.gram.select_rows(&joint.columns);
                rows.select_columns(&joint.columns)
            };
            let mut wider = self.common.first().map(|sum| (1.0, own(sum)));
            for (sum, scale) in joint.sums.iter().zip(AT_A_JOINT) {
                let next = Some((scale, sum.gram.clone()));
                all.push(OneScale {
                    sum,
                    columns: joint.columns.clone(),
                    scale,
                    wider: std::mem::replace(&mut wider, next),
                });
            }
        }
        all
    }

    /// Regressions at common scales, and those on some columns at the scales of one joint.
    #[cfg(test)]
    pub fn known(common: Vec<Regression>, joints: Vec<(Vec<usize>, Vec<Regression>)>) -> Self {
        let joints = joints.into_iter();
        let joints = joints.map(|(columns, sums)| AtJoint { columns, sums });
        Self {
            common,
            joints: joints.collect(),
            alone: None,
        }
    }

    /// Regressions at common scales for a machine with one degree of freedom, and the columns that
    /// reach it.
    #[cfg(test)]
    pub fn of_the_only_joint(common: Vec<Regression>, alone: Vec<usize>) -> Self {
        Self {
            alone: Some(alone),
            ..Self::known(common, Vec::new())
        }
    }

    /// Returns the evidence of some columns at the scale where it is largest, with coefficients.
    ///
    /// The columns `which` contain those of the present model.
    #[must_use]
    pub fn best(&self, columns: &Columns, which: &[usize]) -> (f64, Vec<f64>) {
        let (center, bounds) = (&columns.center, &columns.bounds);
        let common = self.common.iter().map(|sum| {
            let found = evidence(&sum.gram, &sum.moment, which, center, bounds);
            (sum.log_likelihood + found.gain, found.coefficients)
        });
        let at_joints = self.joints.iter().flat_map(|joint| {
            let place = |c: &usize| joint.columns.binary_search(c).ok();
            let own: Option<Vec<usize>> = which.iter().map(place).collect();
            let of = |all: &[f64]| joint.columns.iter().map(|&c| all[c]).collect::<Vec<f64>>();
            let all_bounds = joint.columns.iter().map(|&c| bounds[c]);
            let priors = own.map(|own| (own, of(center), all_bounds.collect::<Vec<_>>()));
            priors.into_iter().flat_map(|(own, center, bounds)| {
                let at_scale = move |sum: &Regression| {
                    let found = evidence(&sum.gram, &sum.moment, &own, &center, &bounds);
                    (sum.log_likelihood + found.gain, found.coefficients)
                };
                joint.sums.iter().map(at_scale)
            })
        });
        let none = (f64::NEG_INFINITY, Vec::new());
        common
            .chain(at_joints)
            .fold(none, |best, next| if next.0 > best.0 { next } else { best })
    }
}

/// An estimate whose variances, joint by joint, make the present model's own columns most likely.
///
/// Otherwise a candidate's scale at one joint would be credited with what the model without it also
/// gains there, and candidates at other joints would not.
#[must_use]
pub fn at_own_scales(context: &Context<'_>, estimate: &Estimate, columns: &Columns) -> Estimate {
    let base: Vec<usize> = (0..columns.base).collect();
    let prior = (&columns.center[..], &columns.bounds[..]);
    settled(context, estimate, (&columns.linear, &base), prior)
}

/// An estimate whose variances, joint by joint, make some columns of a linearisation most likely.
///
/// All columns have a center and bounds.
#[must_use]
pub fn settled(
    context: &Context<'_>,
    estimate: &Estimate,
    (linear, which): (&[LinearEpisode], &[usize]),
    (center, bounds): (&[f64], &[[f64; 2]]),
) -> Estimate {
    let m = center.len();
    let mut own = estimate.clone();
    let mut stands = None;
    for dof in lacking(context, estimate) {
        let likelihood = |own: &Estimate, scale: f64| {
            let sum = regression_at(context, own, linear, (dof, scale), (m, which));
            let found = evidence(&sum.gram, &sum.moment, which, center, bounds);
            sum.log_likelihood + found.gain
        };
        let mut best = (1.0, stands.unwrap_or_else(|| likelihood(&own, 1.0)));
        for scale in AT_A_JOINT {
            let found = likelihood(&own, scale);
            if found > best.1 {
                best = (scale, found);
            }
        }
        own.noise = own.noise.scaled_at(dof, best.0, &own.least_white);
        stands = Some(best.1);
    }
    own
}

/// The degrees of freedom that lack the most force relative to their inertial force, among those of
/// whose force readings tell.
///
/// Returns none if there is only one, since common scales do the same. Returns none if there are
/// segments, since their replays have no missing force.
fn lacking(context: &Context<'_>, estimate: &Estimate) -> Vec<usize> {
    let nv = context.plant().layout.nv;
    if context.has_segments() || nv < 2 {
        return Vec::new();
    }
    let share = |d: usize| estimate.missing_power(context, d);
    let mut dofs: Vec<usize> = (0..nv).filter(|&d| estimate.told[d]).collect();
    dofs.sort_by(|a, b| share(*b).total_cmp(&share(*a)));
    dofs.truncate(JOINTS);
    dofs
}

/// Columns of the present model, and of candidates that reach one degree of freedom alone;
/// ascending.
fn reaching(
    context: &Context<'_>,
    (columns, candidates): (&Columns, &[Candidate]),
    dof: usize,
) -> Vec<usize> {
    let own = Reach::Dofs([dof].into());
    let reaches = |candidate: &Candidate| {
        candidate
            .effect
            .reach(context.plant(), &candidate.spec.site)
            == own
    };
    let forms = columns.forms.iter();
    let forms = forms.filter(|f| reaches(&candidates[f.candidate]));
    let mut places: Vec<usize> = (0..columns.base).collect();
    places.extend(forms.flat_map(|f| f.columns()));
    places.sort_unstable();
    places
}
