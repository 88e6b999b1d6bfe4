//! Identifiability: which of the study's parameters show in the logs, alone and together.

use asid_core::Parameter;

use super::check;
use crate::bench::Explanation;
use crate::fit::Fit;
use crate::linearise::slope;
use crate::result::CheckResult;

/// Share of a parameter's range that its standard deviation must not exceed.
const PINNED: f64 = 0.25;

/// Checks whether each of the study's parameters shows, without effects or with those of the best
/// explanation, and which of their combinations do not.
#[must_use]
pub fn identifiability(
    parameters: &[Parameter],
    none: &Explanation,
    best: &Explanation,
) -> Vec<CheckResult> {
    if parameters.is_empty() {
        return vec![check(
            "excitation",
            true,
            "the study fits no parameter".into(),
        )];
    }
    let fit = &none.fit;
    let p = fit.free.len();
    // Per share of the range.
    let scale = |fit: &Fit, k: usize| {
        let i = fit.free[k];
        slope(&parameters[i], fit.point.theta[i]).abs()
    };
    let deviation = |k: usize| fit.covariance[(k, k)].max(0.0).sqrt() / scale(fit, k);
    // Far from the logs a replay may be so chaotic that it has no useful derivative. The best
    // explanation is closer.
    let information = |k: usize| {
        let of = |fit: &Fit| fit.shows[k] * scale(fit, k);
        of(fit).max(of(&best.fit))
    };
    let silent: Vec<&str> = (0..p)
        .filter(|&k| information(k) * PINNED < 1.0)
        .map(|k| &*parameters[fit.free[k]].name)
        .collect();
    let excitation = if silent.is_empty() {
        check(
            "excitation",
            true,
            "every parameter shows in the readings".into(),
        )
    } else {
        check(
            "excitation",
            false,
            format!(
                "{} hardly show in these logs: over a quarter of the range the readings change by less than the noise; move more",
                silent.join(", ")
            ),
        )
    };
    let loose: Vec<String> = (0..p)
        .filter(|&k| information(k) * PINNED >= 1.0 && deviation(k) > PINNED)
        .map(|k| parameters[fit.free[k]].name.clone())
        .collect();
    let together = if loose.is_empty() {
        check(
            "identifiability",
            true,
            "the logs determine every combination of parameters".into(),
        )
    } else {
        check(
            "identifiability",
            false,
            format!(
                "the logs see {} only in combination with each other: their values are not to be believed one by one",
                loose.join(", ")
            ),
        )
    };
    let correlations = correlated(parameters, none);
    let mut all = vec![excitation, together];
    if let Some(text) = correlations {
        all.push(check("correlation", true, text));
    }
    all
}

/// Describes the most correlated pair of parameters, if its correlation exceeds 0.95.
fn correlated(parameters: &[Parameter], none: &Explanation) -> Option<String> {
    let c = &none.fit.covariance;
    let p = c.nrows();
    let mut worst: Option<(f64, usize, usize)> = None;
    for i in 0..p {
        for j in 0..i {
            let r = c[(i, j)] / (c[(i, i)] * c[(j, j)]).sqrt();
            if r.abs() > 0.95 && worst.is_none_or(|(w, ..)| r.abs() > w.abs()) {
                worst = Some((r, i, j));
            }
        }
    }
    let name = |k: usize| &parameters[none.fit.free[k]].name;
    worst.map(|(r, i, j)| format!("{} and {} trade off: correlation {r:.3}", name(i), name(j)))
}
