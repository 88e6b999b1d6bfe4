//! Evaluates a policy without action noise.

use asid_core::{BatchEnvironment, Error, Result, Transition};
use serde::{Deserialize, Serialize};

use asid_learned::Policy;

/// Returns of episodes under the mean action.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Undiscounted return of each episode.
    pub returns: Vec<f64>,
    /// Their mean.
    pub mean: f64,
    /// Their standard deviation (divided by their number).
    pub std: f64,
    /// Environment steps of the evaluation, over the whole batch.
    pub env_steps: usize,
}

/// Steps of the batch after which an episode that has not ended is an error.
const MAX_STEPS: usize = 100_000;

/// Runs at least `episodes` episodes, the same number in each environment.
///
/// The numbers are equal because counting the episodes that end first would favour short ones.
///
/// # Errors
/// Those of the environment; [`Error::Shape`] where it does not fit the policy;
/// [`Error::Failed`] where episodes do not end.
pub fn evaluate(
    environment: &mut dyn BatchEnvironment,
    policy: &Policy,
    episodes: usize,
) -> Result<Evaluation> {
    let n = environment.batch_size();
    if n == 0 || episodes == 0 {
        return Err(Error::Shape("an evaluation of no episode".to_owned()));
    }
    let each = episodes.div_ceil(n);
    let mut transition = Transition::new(n, environment.observation_len());
    let mut action = vec![0.0; n * environment.action_len()];
    let mut running = vec![0.0; n];
    let mut returns: Vec<Vec<f64>> = vec![Vec::with_capacity(each); n];
    let mut steps = 0;
    environment.reset(&mut transition.observation)?;
    while returns.iter().any(|r| r.len() < each) {
        if steps == MAX_STEPS {
            let message = format!("an episode of the evaluation did not end in {MAX_STEPS} steps");
            return Err(Error::Failed(message));
        }
        policy.act(&transition.observation, &mut action)?;
        environment.step(&action, &mut transition)?;
        steps += 1;
        for i in 0..n {
            running[i] += transition.reward[i];
            if transition.terminated[i] || transition.truncated[i] {
                let ended = std::mem::take(&mut running[i]);
                if returns[i].len() < each {
                    returns[i].push(ended);
                }
            }
        }
    }
    let returns = returns.concat();
    let (mean, std) = mean_and_std(&returns);
    Ok(Evaluation {
        returns,
        mean,
        std,
        env_steps: steps * n,
    })
}

/// Mean and standard deviation; NaN for no values.
pub(crate) fn mean_and_std(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
    (mean, variance.sqrt())
}
