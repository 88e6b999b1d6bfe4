//! Whether two explanations are the same physics: they predict the same held-out signals.

use asid_core::Result;

use crate::bench::{Explanation, Trial};
use crate::diagnose::Work;
use crate::fit::Effort;
use crate::predict::Point;
use crate::result::{DiagnosisResult, Kind};
use crate::score::Label;
use crate::screen::{Base, Proposal, propose, take};
use crate::search::trials;
use crate::whitening::Scattering;

/// Difference of noise-free predictions, root mean square in units of the noise, up to which
/// two explanations are the same physics.
const SAME: f64 = 0.1;

/// Whether two labels name the same effect at the same place: a contact effect may name
/// either geom of a pair.
fn same_label(work: &Work, a: &str, b: &str) -> bool {
    if a == b {
        return true;
    }
    let split = |s: &str| -> (String, String) {
        let (name, site) = s.split_once('@').unwrap_or((s, ""));
        (name.to_owned(), site.to_owned())
    };
    let ((name, site), (other, place)) = (split(a), split(b));
    let plant = &work.bench.machine.plant;
    let (Ok(g), Ok(h)) = (plant.geom(&site), plant.geom(&place)) else {
        return false;
    };
    name == other && (plant.contacts.contains(&[g, h]) || plant.contacts.contains(&[h, g]))
}

fn same_set(work: &Work, a: &[String], b: &[String]) -> bool {
    a.len() == b.len() && a.iter().all(|x| b.iter().any(|y| same_label(work, x, y)))
}

/// Whether the verdict's set predicts the same noise-free test signals as the label's after
/// its best refit; both explained by the machine and logs of the diagnosis.
///
/// # Errors
/// When a rollout fails.
pub fn same_physics(work: &Work, result: &DiagnosisResult, label: &Label) -> Result<bool> {
    let verdict = &result.verdict;
    if verdict.kind != Kind::Effects || label.effects.is_empty() || label.is_unknown() {
        return Ok(false);
    }
    if same_set(work, &verdict.effects, &label.effects) {
        return Ok(true);
    }
    let Some((members, truth)) = refit(work, &label.effects)? else {
        return Ok(false);
    };
    let of_verdict = work.findings.found.iter().find(|f| {
        let labels = f.explanation.labels();
        labels.len() == verdict.effects.len() && labels.iter().all(|l| verdict.effects.contains(l))
    });
    let Some(of_verdict) = of_verdict else {
        return Ok(false);
    };
    let ours = trials(
        &work.candidates,
        &of_verdict.candidates,
        &of_verdict.explanation,
    );
    let a = predictions(work, &ours, &of_verdict.explanation)?;
    let theirs = trials(&work.candidates, &members, &truth);
    let b = predictions(work, &theirs, &truth)?;
    let square: f64 = a.iter().zip(&b).map(|(x, y)| (x - y).powi(2)).sum();
    Ok((square / work.bench.test.readings.max(1) as f64).sqrt() < SAME)
}

/// Residuals of the held-out logs without whitening: they differ by predictions alone.
fn predictions(work: &Work, trials: &[Trial<'_>], of: &Explanation) -> Result<Vec<f64>> {
    let mut predictor = work.bench.predictor(trials, &work.bench.test)?;
    predictor.set_scattering(Scattering::default());
    let point = Point {
        theta: of.fit.point.theta.clone(),
        starts: of.held_starts.clone(),
    };
    Ok(predictor.residuals(&[point])?.pop().unwrap_or_default())
}

/// The label's effects, fitted as the diagnosis would have; `None` where the catalogue or
/// the engine lacks one.
fn refit(work: &Work, effects: &[String]) -> Result<Option<(Vec<usize>, Explanation)>> {
    let find = |label: &String| {
        let candidates = work.candidates.iter();
        candidates
            .enumerate()
            .find(|(_, c)| same_label(work, &c.label(), label))
            .map(|(i, _)| i)
    };
    let Some(wanted) = effects.iter().map(find).collect::<Option<Vec<_>>>() else {
        return Ok(None);
    };
    let known = work.findings.found.iter().find(|f| {
        f.candidates.len() == wanted.len() && wanted.iter().all(|w| f.candidates.contains(w))
    });
    if let Some(found) = known {
        return Ok(Some((found.candidates.clone(), found.explanation.clone())));
    }
    let bench = &work.bench;
    let mut members: Vec<usize> = Vec::new();
    let mut explanation = work.none[0].clone();
    let study = bench.parameters.len();
    for &candidate in &wanted {
        let before = trials(&work.candidates, &members, &explanation);
        let base = Base::new(bench, 0, &before, &explanation)?;
        let one = &work.candidates[candidate];
        let record = &bench.stages[0].record;
        let proposals = propose(bench, record, &base, (candidate, one))?;
        let proposals: Vec<&Proposal> = proposals.iter().collect();
        let starts = take(bench, record, &base, one, &proposals)?;
        let Some(start) = starts.first() else {
            return Ok(None);
        };
        let mut all = before.clone();
        all.push((one, start.values.clone()));
        let (theta, from) = (&start.theta[..study], &explanation.fit.point.starts);
        let fitted = bench.explain(0, &all, theta, from, Effort::FULL)?;
        members.push(candidate);
        explanation = fitted;
    }
    for stage in 1..bench.stages.len() {
        let all = trials(&work.candidates, &members, &explanation);
        let theta = explanation.fit.point.theta[..study].to_vec();
        let starts = explanation.fit.point.starts.clone();
        explanation = bench.explain(stage, &all, &theta, &starts, Effort::FULL)?;
    }
    Ok(Some((members, explanation)))
}
