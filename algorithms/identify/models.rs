//! Binary unknowns: one model per combination of their values, each fitted separately, and the
//! probability of each.
//!
//! The evidence of a model is `exp(-b)` times the share of the prior that its posterior takes
//! (Laplace's approximation, per unknown), where `b` is what its fit is [`behind`] the best in nats.

use asid_core::identify::Identified;
use asid_core::{Error, Parameter, Posterior, Result};

use super::evidence::{Evidence, behind};

/// Largest number of binary unknowns: each doubles the number of models to fit.
const MAX_BINARY: usize = 5;

/// A model this many nats behind the best after the search is dropped.
const HOPELESS: f64 = 100.0;

/// All combinations of the binary unknowns' values: one entry per unknown, `None` for those that
/// are not binary.
///
/// Without binary unknowns there is one model, with `None` for every unknown.
///
/// # Errors
/// When there are too many binary unknowns.
pub fn all(parameters: &[Parameter]) -> Result<Vec<Vec<Option<f64>>>> {
    let binary: Vec<usize> = (0..parameters.len())
        .filter(|&i| parameters[i].is_binary())
        .collect();
    if binary.len() > MAX_BINARY {
        return Err(Error::Failed(format!(
            "{} binary unknowns make too many models to compare; at most {MAX_BINARY}",
            binary.len()
        )));
    }
    Ok((0..1_usize << binary.len())
        .map(|bits| {
            let mut model = vec![None; parameters.len()];
            for (k, &i) in binary.iter().enumerate() {
                model[i] = Some(f64::from(u8::from(bits >> k & 1 == 1)));
            }
            model
        })
        .collect())
}

/// Whether a model is too far behind another to be considered further, by the residual of its best
/// simulation; see [`behind`] for `correlated`.
#[must_use]
pub fn is_hopeless(single: &[f64], other: &Evidence, correlated: bool) -> bool {
    let single = Evidence::of_single(single.to_vec(), other);
    behind(&[&single, other], correlated)[0] > HOPELESS
}

/// The posterior over all models, each weighted by its probability; all else, the evidence too, is
/// that of the most probable model. See [`behind`] for `correlated`.
///
/// # Errors
/// When there is no model.
pub fn average(
    parameters: &[Parameter],
    mut found: Vec<(Identified, Evidence)>,
    correlated: bool,
) -> Result<(Identified, Evidence)> {
    if found.len() > 1 {
        let models: Vec<&Evidence> = found.iter().map(|(_, evidence)| evidence).collect();
        let behind = behind(&models, correlated);
        let mut log_evidence: Vec<f64> = models
            .iter()
            .zip(behind)
            .map(|(model, behind)| model.narrowing - behind)
            .collect();
        let top = log_evidence.iter().copied().fold(f64::MIN, f64::max);
        for x in &mut log_evidence {
            *x = (*x - top).exp();
        }
        let total: f64 = log_evidence.iter().sum();
        let (mut samples, mut weights) = (Vec::new(), Vec::new());
        for ((identified, _), evidence) in found.iter().zip(&log_evidence) {
            let posterior = &identified.posterior;
            samples.extend(posterior.samples.iter().cloned());
            weights.extend(posterior.weights.iter().map(|w| w * evidence / total));
        }
        let best = (0..found.len())
            .max_by(|&i, &j| log_evidence[i].total_cmp(&log_evidence[j]))
            .unwrap_or(0);
        found.swap(0, best);
        found.truncate(1);
        let unseen = std::mem::take(&mut found[0].0.posterior.unseen);
        found[0].0.posterior =
            Posterior::from_samples(parameters, samples, &weights).with_unseen(unseen);
    }
    found
        .pop()
        .ok_or_else(|| Error::Failed("no model explains the episode".into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fisher::roughness::Roughness;
    use asid_core::parameter::Scale as Prior;

    fn parameters() -> Vec<Parameter> {
        [Prior::Binary([5.0, 0.1]), Prior::Linear]
            .map(|scale| Parameter {
                name: "p".into(),
                targets: vec!["geom/a/friction/0".parse().unwrap()],
                range: [0.0, 1.0],
                scale,
                unit: String::new(),
            })
            .into()
    }

    /// A model without roughness, with this loss over 50 readings.
    fn model(value: f64, loss: f64, narrowing: f64) -> (Identified, Evidence) {
        let samples = vec![vec![value, 0.5]; 10];
        let identified = Identified {
            posterior: Posterior::from_samples(&parameters(), samples, &[1.0; 10]),
            starts: vec![vec![value]],
            iterations: Vec::new(),
            residual: 1.0,
            misfit: Some(1.0),
            roughness: 0.0,
        };
        let evidence = Evidence {
            residual: vec![(2.0 * loss / 50.0).sqrt(); 50],
            present: 50,
            roughness: Roughness::none(50),
            scatter: 0.0,
            narrowing,
        };
        (identified, evidence)
    }

    fn averaged(found: Vec<(Identified, Evidence)>) -> Identified {
        average(&parameters(), found, false).unwrap().0
    }

    #[test]
    fn models_are_all_combinations_of_binary_values() {
        let found = all(&parameters()).unwrap();
        assert_eq!(found, vec![vec![Some(0.0), None], vec![Some(1.0), None]]);
        assert_eq!(all(&parameters()[1..]).unwrap(), vec![vec![None]]);
    }

    #[test]
    fn the_probability_is_the_ratio_of_the_evidences() {
        // 50 readings at noise level: a loss of 25; the other model is ln 3 behind.
        let identified = averaged(vec![
            model(0.0, 25.0 + 3.0_f64.ln(), 0.0),
            model(1.0, 25.0, 0.0),
        ]);
        assert!((identified.posterior.marginals[0].estimate - 0.75).abs() < 1e-9);
        assert_eq!(identified.starts, vec![vec![1.0]]);
        // A model is penalised for the unknowns that it had to find.
        let identified = averaged(vec![
            model(0.0, 25.0, 0.0),
            model(1.0, 25.0, -(4.0_f64.ln())),
        ]);
        assert!((identified.posterior.marginals[0].estimate - 0.2).abs() < 1e-9);
        // With misfit that no model explains (4 times the loss), differences count for less.
        let identified = averaged(vec![model(0.0, 104.0, 0.0), model(1.0, 100.0, 0.0)]);
        let wanted = 1.0 / (1.0 + (-1.0_f64).exp());
        assert!((identified.posterior.marginals[0].estimate - wanted).abs() < 1e-9);
    }
}
