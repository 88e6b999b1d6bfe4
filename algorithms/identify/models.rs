//! Binary unknowns: one model per combination of their values, each fitted separately, and the
//! probability of each.
//!
//! The evidence of a model is `exp(-loss / c)` at its best point times the share of the prior that
//! its posterior takes (Laplace's approximation, per unknown). `c`, at least 1, is the misfit of
//! the best model relative to the sensors' noise. A misfit that no model explains then supports
//! none of them.

use asid_core::identify::Identified;
use asid_core::{Error, Parameter, Posterior, Result};

use super::sampling::Evidence;

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

/// Scale of loss differences between models.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    best: f64,
    mismatch: f64,
}

impl Scale {
    /// Scale from the losses of all models and the number of reading entries that are present.
    #[must_use]
    pub fn new(losses: impl Iterator<Item = f64>, present: usize) -> Self {
        let best = losses.fold(f64::INFINITY, f64::min);
        Self {
            best,
            mismatch: (2.0 * best / present.max(1) as f64).max(1.0),
        }
    }

    /// Nats by which a model is behind the best.
    fn behind(self, loss: f64) -> f64 {
        (loss - self.best) / self.mismatch
    }

    /// Whether a model is too far behind to be considered further.
    #[must_use]
    pub fn is_hopeless(self, loss: f64) -> bool {
        self.behind(loss) > HOPELESS
    }
}

/// The posterior over all models, each weighted by its probability; all else is that of the most
/// probable model.
///
/// # Errors
/// When there is no model.
pub fn average(
    parameters: &[Parameter],
    mut found: Vec<(Identified, Evidence)>,
    present: usize,
) -> Result<Identified> {
    if found.len() > 1 {
        let scale = Scale::new(found.iter().map(|f| f.1.loss), present);
        let mut log_evidence: Vec<f64> = found
            .iter()
            .map(|(_, e)| e.narrowing - scale.behind(e.loss))
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
        .map(|(identified, _)| identified)
        .ok_or_else(|| Error::Failed("no model explains the episode".into()))
}

#[cfg(test)]
mod tests {
    use super::*;
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
        (identified, Evidence { loss, narrowing })
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
        let found = vec![model(0.0, 25.0 + 3.0_f64.ln(), 0.0), model(1.0, 25.0, 0.0)];
        let identified = average(&parameters(), found, 50).unwrap();
        assert!((identified.posterior.marginals[0].estimate - 0.75).abs() < 1e-9);
        assert_eq!(identified.starts, vec![vec![1.0]]);
        // A model is penalised for the unknowns that it had to find.
        let found = vec![model(0.0, 25.0, 0.0), model(1.0, 25.0, -(4.0_f64.ln()))];
        let identified = average(&parameters(), found, 50).unwrap();
        assert!((identified.posterior.marginals[0].estimate - 0.2).abs() < 1e-9);
        // With misfit that no model explains (4 times the loss), differences count for less.
        let found = vec![model(0.0, 104.0, 0.0), model(1.0, 100.0, 0.0)];
        let identified = average(&parameters(), found, 50).unwrap();
        let wanted = 1.0 / (1.0 + (-1.0_f64).exp());
        assert!((identified.posterior.marginals[0].estimate - wanted).abs() < 1e-9);
    }
}
