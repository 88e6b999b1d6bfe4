//! Checks the result of a plugin's identifier before anything is computed with it.

use asid_core::episode::Episode;
use asid_core::identify::Identified;
use asid_core::posterior::Posterior;
use asid_core::problem::Problem;

/// Largest difference from 1 of the sum of a posterior's weights. It is the rounding of some
/// thousand numbers, in single precision at worst.
const ROUNDING: f64 = 1e-4;

/// Checks that a result has the shapes and values that [`Identified`] states.
///
/// # Errors
/// When it has not; the text says what is wrong, with both numbers.
pub(super) fn check(
    found: &Identified,
    problem: &Problem<'_>,
    episodes: &[Episode],
) -> Result<(), String> {
    posterior(&found.posterior, problem)?;
    let coordinates = problem.task.exploration().start.len();
    counted("starts", found.starts.len(), "episodes", episodes.len())?;
    for start in &found.starts {
        counted(
            "entries of a start",
            start.len(),
            "coordinates",
            coordinates,
        )?;
        finite(start, "a start")?;
    }
    for iteration in &found.iterations {
        let (own, parameters) = (iteration.quantiles.len(), problem.parameters.len());
        counted("quantiles of an iteration", own, "unknowns", parameters)?;
    }
    for (value, what) in [
        (Some(found.residual), "the residual"),
        (found.misfit, "the misfit"),
        (Some(found.roughness), "the roughness"),
    ] {
        let Some(value) = value else { continue };
        finite(&[value], what)?;
        if value < 0.0 {
            return Err(format!("{what} is {value}, below 0"));
        }
    }
    Ok(())
}

/// Checks that a posterior is one over the unknowns of a problem.
fn posterior(posterior: &Posterior, problem: &Problem<'_>) -> Result<(), String> {
    let unknowns = problem.parameters.len();
    let marginals = &posterior.marginals;
    counted("marginals", marginals.len(), "unknowns", unknowns)?;
    for (marginal, parameter) in marginals.iter().zip(problem.parameters) {
        if marginal.name != parameter.name {
            return Err(format!(
                "the marginal of `{}` stands where that of `{}` belongs",
                marginal.name, parameter.name
            ));
        }
        let [low, high] = marginal.interval95;
        finite(
            &[marginal.estimate, marginal.std, low, high],
            "the posterior",
        )?;
        if marginal.std < 0.0 {
            return Err(format!(
                "the deviation of `{}` is {}, below 0",
                marginal.name, marginal.std
            ));
        }
    }
    let (samples, weights) = (&posterior.samples, &posterior.weights);
    if samples.is_empty() {
        return Err("the posterior has no samples".into());
    }
    counted("weights", weights.len(), "samples", samples.len())?;
    for sample in samples {
        counted("entries of a sample", sample.len(), "unknowns", unknowns)?;
        finite(sample, "a sample of the posterior")?;
    }
    finite(weights, "a weight of the posterior")?;
    if let Some(weight) = weights.iter().find(|w| **w < 0.0) {
        return Err(format!("a weight of the posterior is {weight}, below 0"));
    }
    let sum: f64 = weights.iter().sum();
    if (sum - 1.0).abs() > ROUNDING {
        return Err(format!(
            "the weights of the posterior sum to {sum}, not to 1"
        ));
    }
    Ok(())
}

/// Refuses a count that differs from the wanted one.
fn counted(what: &str, own: usize, of: &str, wanted: usize) -> Result<(), String> {
    if own == wanted {
        return Ok(());
    }
    Err(format!("returned {own} {what} for {wanted} {of}"))
}

/// Refuses numbers that are not finite.
fn finite(values: &[f64], what: &str) -> Result<(), String> {
    match values.iter().position(|x| !x.is_finite()) {
        Some(i) => Err(format!("{what} is {} (value {i})", values[i])),
        None => Ok(()),
    }
}
