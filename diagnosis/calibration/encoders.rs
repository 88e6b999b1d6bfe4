//! Encoders of simulated logs, which round last.

use std::collections::BTreeMap;

use crate::bench::Trial;

/// Steps in which sensors round their readings, by the sensor's name, in the unit of the reading.
pub(super) type Steps = BTreeMap<String, f64>;

/// Returns the values of an explanation without its rounding of readings, and the steps of that.
///
/// A real encoder rounds what it reads, with its noise, and a model what it predicts without noise.
/// `theta` holds `first` values before those of the members.
pub(super) fn unrounded(
    members: &[Trial<'_>],
    (theta, first): (&[f64], usize),
) -> (Vec<f64>, Steps) {
    let (mut theta, mut steps) = (theta.to_vec(), Steps::new());
    let mut at = first;
    for (candidate, values) in members {
        if candidate.effect.rounds() {
            steps.insert(candidate.spec.site.clone(), theta[at]);
            theta[at] = candidate.parameters()[0].null;
        }
        at += values.len();
    }
    (theta, steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::latent_force::search::by_hand::candidate;

    #[test]
    fn the_steps_of_an_encoder_are_left_to_the_end() {
        let [friction, steps] = ["coulomb-friction@slide", "sensor-quantization@place"];
        let [friction, steps] = [friction, steps].map(candidate);
        let of = friction.parameters().len();
        let members = [(&friction, vec![0.5; of]), (&steps, vec![0.01])];
        let theta = [vec![1.3], vec![0.5; of], vec![0.01]].concat();
        let (without, steps) = unrounded(&members, (&theta, 1));
        assert_eq!(without[..=of], theta[..=of]);
        assert_eq!(without[of + 1], 0.0);
        assert_eq!(steps, Steps::from([("place".to_owned(), 0.01)]));
    }
}
