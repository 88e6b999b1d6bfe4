//! Sums of squares of explanations, in units of the final noise.

use asid_core::Result;

use crate::bench::{Bench, Explanation, Trial};
use crate::candidate::Candidate;
use crate::findings::{Findings, trials};
use crate::fit::cost;
use crate::prepare::plain_residuals;
use crate::study::Study;

/// Takes the noise from the residuals of the best explanation, which hide least of it, and
/// computes all sums of squares with it.
pub(super) fn final_noise(
    bench: &mut Bench,
    study: &Study,
    candidates: &[Candidate],
    mut findings: Findings,
) -> Result<Findings> {
    let best = findings
        .found
        .iter()
        .min_by(|a, b| a.explanation.fit.cost.total_cmp(&b.explanation.fit.cost))
        .filter(|f| f.explanation.fit.cost < findings.none.fit.cost);
    let (members, explanation) = match best {
        Some(f) => (
            trials(candidates, &f.candidates, &f.explanation),
            &f.explanation,
        ),
        None => (Vec::new(), &findings.none),
    };
    let residuals = plain_residuals(bench, &bench.train, &members, &explanation.fit.point)?;
    let estimated = crate::noise::estimate(&bench.train.logs, &residuals);
    let noise: Vec<f64> = bench
        .train
        .logs
        .sensors
        .iter()
        .zip(estimated)
        .map(|(s, x)| match study.noise.get(&s.name) {
            Some(given) => *given,
            None => x.min(s.noise),
        })
        .collect();
    bench.set_noise(&noise);
    rescore(bench, &[], &mut findings.none)?;
    for found in &mut findings.found {
        let trials = trials(candidates, &found.candidates, &found.explanation);
        rescore(bench, &trials, &mut found.explanation)?;
    }
    Ok(findings)
}

/// Computes the residuals of an explanation and their sum of squares anew.
fn rescore(bench: &Bench, trials: &[Trial<'_>], of: &mut Explanation) -> Result<()> {
    let mut predictor = bench.predictor(trials, &bench.train)?;
    let mut residuals = predictor.residuals(std::slice::from_ref(&of.fit.point))?;
    of.fit.residuals = residuals.pop().unwrap_or_default();
    of.fit.cost = cost(&of.fit.residuals);
    Ok(())
}
