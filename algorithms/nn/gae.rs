//! Generalised advantage estimation (Schulman et al. 2016, "High-dimensional
//! continuous control using generalized advantage estimation", equation 16).
//!
//! ```text
//! delta_t = r_t + gamma * V(s_{t+1}) - V(s_t)
//! A_t     = delta_t + gamma * lambda * A_{t+1}
//! ```
//!
//! Both ways in which an episode can end cut the sum. They differ in the value of the state
//! reached: it is zero for a terminal state, and the critic's value for a truncated one. Treating
//! truncation as termination would teach the critic that time limits are disasters.

/// Results of a rollout of `steps` steps of `n` environments, each array `steps x n`.
#[derive(Clone, Copy, Debug)]
pub struct Outcome<'a> {
    /// Rewards.
    pub reward: &'a [f64],
    /// Values of the states in which the actions were taken.
    pub value: &'a [f64],
    /// Values of the states reached, before any reset.
    pub next_value: &'a [f64],
    /// Whether the state reached is terminal.
    pub terminated: &'a [bool],
    /// Whether the episode was cut by its time limit.
    pub truncated: &'a [bool],
}

/// Advantages, `steps x n`; added to the values they are the critic's targets.
///
/// # Panics
/// When the arrays differ in length or `n` does not divide it.
#[must_use]
pub fn advantages(outcome: Outcome<'_>, n: usize, gamma: f64, lambda: f64) -> Vec<f64> {
    let len = outcome.reward.len();
    assert!(
        n > 0 && len.is_multiple_of(n),
        "{len} samples of {n} environments"
    );
    let mut advantage = vec![0.0; len];
    for i in (0..len).rev() {
        // The value of the state reached counts unless it is terminal.
        let reached = if outcome.terminated[i] {
            0.0
        } else {
            outcome.next_value[i]
        };
        let delta = outcome.reward[i] + gamma * reached - outcome.value[i];
        // Later advantages belong to this episode only if it continued.
        let ended = outcome.terminated[i] || outcome.truncated[i];
        let later = match advantage.get(i + n) {
            Some(&later) if !ended => later,
            _ => 0.0,
        };
        advantage[i] = delta + gamma * lambda * later;
    }
    advantage
}

#[cfg(test)]
mod tests {
    use super::*;

    const REWARD: [f64; 3] = [1.0, 2.0, 3.0];
    const VALUE: [f64; 3] = [0.5, 1.0, 1.5];
    const NEXT: [f64; 3] = [1.0, 1.5, 2.0];
    const NO: [bool; 3] = [false; 3];
    const SECOND: [bool; 3] = [false, true, false];

    fn estimate(terminated: &[bool], truncated: &[bool]) -> Vec<f64> {
        let outcome = Outcome {
            reward: &REWARD,
            value: &VALUE,
            next_value: &NEXT,
            terminated,
            truncated,
        };
        advantages(outcome, 1, 0.9, 0.8)
    }

    /// Tolerance: rounding of a few operations on numbers of order one.
    fn assert_close(found: &[f64], expected: &[f64]) {
        for (f, e) in found.iter().zip(expected) {
            assert!((f - e).abs() < 1e-12, "{found:?} should be {expected:?}");
        }
    }

    /// By hand: deltas 1.4, 2.35 and 3.3, and gamma lambda = 0.72, so
    /// A_2 = 3.3, A_1 = 2.35 + 0.72 * 3.3, A_0 = 1.4 + 0.72 * 4.726.
    #[test]
    fn an_episode_that_goes_on_sums_discounted_deltas() {
        assert_close(&estimate(&NO, &NO), &[4.80272, 4.726, 3.3]);
    }

    /// By hand: the second delta is 2 - 1 = 1 and nothing follows it.
    #[test]
    fn a_terminal_state_is_worth_nothing() {
        assert_close(&estimate(&SECOND, &NO), &[2.12, 1.0, 3.3]);
    }

    /// By hand: the second delta keeps its value 2.35 and nothing follows it.
    #[test]
    fn a_truncated_state_is_worth_what_the_critic_says() {
        assert_close(&estimate(&NO, &SECOND), &[3.092, 2.35, 3.3]);
    }

    /// With lambda 1, gamma 1 and a critic of zeros the advantage is the return to go.
    #[test]
    fn without_a_critic_it_is_the_return_to_go_of_each_environment() {
        let reward = [1.0, 10.0, 2.0, 20.0, 3.0, 30.0];
        let zeros = [0.0; 6];
        let ended = [false, false, false, false, true, true];
        let outcome = Outcome {
            reward: &reward,
            value: &zeros,
            next_value: &zeros,
            terminated: &ended,
            truncated: &[false; 6],
        };
        let expected = [6.0, 60.0, 5.0, 50.0, 3.0, 30.0];
        assert_close(&advantages(outcome, 2, 1.0, 1.0), &expected);
    }
}
