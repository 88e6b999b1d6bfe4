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
    let fit = &none.fit;
    // Without the parameters of two values: replays choose these, and no fit moves them.
    let p = fit.free.len();
    if p == 0 {
        return vec![check(
            "excitation",
            true,
            "the study fits no parameter".into(),
        )];
    }
    // Per share of the range.
    let scale = |fit: &Fit, k: usize| {
        let i = fit.free[k];
        slope(&parameters[i], fit.point.theta[i]).abs()
    };
    let deviation = |k: usize| fit.covariance[(k, k)].max(0.0).sqrt() / scale(fit, k);
    // The covariance says nothing of combinations that the logs do not show at all.
    let is_loose = |k: usize| fit.unresolved[k] || deviation(k) > PINNED;
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
        .filter(|&k| information(k) * PINNED >= 1.0 && is_loose(k))
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

#[cfg(test)]
mod tests {
    use asid_core::parameter::Scale;
    use nalgebra::DMatrix;

    use super::*;
    use crate::normal::{inverse, left_out};

    fn parameter(name: &str) -> Parameter {
        Parameter {
            name: name.to_owned(),
            targets: Vec::new(),
            range: [0.0, 1.0],
            scale: Scale::Linear,
            unit: String::new(),
        }
    }

    /// An explanation without effects, fitted to logs with some information on parameters whose
    /// ranges are of length 1.
    fn explanation(parameters: &[Parameter], information: &DMatrix<f64>) -> Explanation {
        let covariance = inverse(information, 1e-14);
        let mut explanation = Explanation::of_parameters(parameters, covariance, 0);
        let shows = information.diagonal().map(f64::sqrt);
        explanation.fit.shows = shows.as_slice().to_vec();
        explanation.fit.unresolved = left_out(information, 1e-14);
        explanation
    }

    /// Symptom: of a cart with `m a = g u`, the logs were said to determine every combination of
    /// the mass `m` and the gain `g`. Cause: the pseudo-inverse gives a combination that does not
    /// show no variance, which is as if it were known.
    #[test]
    fn a_mass_and_a_gain_that_only_show_as_their_ratio_are_told() {
        let parameters = ["mass", "gain", "damping"].map(parameter);
        let told = |information: &DMatrix<f64>| {
            let none = explanation(&parameters, information);
            let all = identifiability(&parameters, &none, &none);
            let found = all
                .into_iter()
                .find(|c| c.check == "identifiability")
                .unwrap();
            (found.ok, found.detail)
        };
        let of = |coupling: f64| {
            let rows = [
                [400.0, coupling, 0.0],
                [coupling, 400.0, 0.0],
                [0.0, 0.0, 400.0],
            ];
            DMatrix::from_row_slice(3, 3, &rows.concat())
        };
        let (ok, detail) = told(&of(-400.0));
        assert!(
            !ok && detail.contains("mass, gain only in combination"),
            "{detail}"
        );
        let (ok, detail) = told(&of(-399.0));
        assert!(
            !ok && detail.contains("mass, gain only in combination"),
            "{detail}"
        );
        let (ok, detail) = told(&of(-100.0));
        assert!(ok, "{detail}");
    }
}
