//! A dynamics model learned from episodes, and its open-loop predictions: the learned counterpart
//! of a simulator.
//!
//! The ensemble is that of [`max`](asid_learned::max): its members predict, as a Gaussian, the
//! change of the places in a control step from the places, their last changes and the action. An
//! episode is predicted from its first state and its actions alone. Each step starts from the
//! previous prediction and uses the mean over the members' means.

use asid_core::{Error, Result};
use asid_learned::max::EnsembleSettings;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tch::Kind;

use crate::actor_critic::to_vec;
use crate::ensemble::{Ensemble, Transitions, Widths};

/// An episode as input of a dynamics model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Motion {
    /// Rows of the entries that move: at the start and after each control step, so one row more
    /// than actions.
    pub places: Vec<Vec<f64>>,
    /// Actions, each entry between -1 and 1.
    pub actions: Vec<Vec<f64>>,
}

/// A learned dynamics model.
pub struct MotionModel {
    ensemble: Ensemble,
}

impl MotionModel {
    /// Fits an ensemble to all control steps of the episodes.
    ///
    /// # Errors
    /// [`Error::Shape`] where the rows of the episodes differ in length, or an episode does not
    /// have one row more than actions. [`Error::Failed`] where there is nothing to learn from or
    /// libtorch fails.
    pub fn fit(settings: &EnsembleSettings, episodes: &[Motion], seed: u64) -> Result<Self> {
        let first = episodes.iter().find(|e| !e.actions.is_empty());
        let Some(first) = first else {
            return Err(Error::Failed("no episode to learn a motion from".into()));
        };
        let widths = Widths {
            state: 2 * first.places[0].len(),
            action: first.actions[0].len(),
            places: first.places[0].len(),
        };
        let mut data = Transitions::default();
        for episode in episodes {
            add(episode, widths, &mut data)?;
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut ensemble = Ensemble::new(settings, widths, &mut rng)?;
        ensemble.fit(&data, settings, &mut rng);
        Ok(Self { ensemble })
    }

    /// Predicted places of an episode that starts at rest at `start`: `start`, then one row after
    /// each action.
    ///
    /// # Errors
    /// [`Error::Failed`] where a prediction is not finite.
    pub fn predict(&self, start: &[f64], actions: &[Vec<f64>]) -> Result<Vec<Vec<f64>>> {
        let places = start.len();
        let mut rows = vec![start.to_vec()];
        let mut state: Vec<f32> = start.iter().map(|&x| x as f32).collect();
        state.resize(2 * places, 0.0);
        for action in actions {
            let action: Vec<f32> = action.iter().map(|&a| a as f32).collect();
            let unfitted = || Error::Failed("a model of the motion before a fit".into());
            let prediction = self
                .ensemble
                .predict(&state, &action)
                .ok_or_else(unfitted)?;
            let mean = prediction
                .mean
                .mean_dim(Some([0].as_slice()), false, None::<Kind>);
            let change: Vec<f32> = to_vec(&self.ensemble.unscale(&mean));
            let (now, last) = state.split_at_mut(places);
            for ((x, last), change) in now.iter_mut().zip(last).zip(&change) {
                *x += change;
                *last = *change;
            }
            if now.iter().any(|x| !x.is_finite()) {
                return Err(Error::Failed("the learned motion diverged".into()));
            }
            rows.push(now.iter().map(|&x| f64::from(x)).collect());
        }
        Ok(rows)
    }
}

/// Adds the control steps of an episode; steps with a missing reading are left out.
fn add(episode: &Motion, widths: Widths, data: &mut Transitions) -> Result<()> {
    let fits = episode.places.len() == episode.actions.len() + 1
        && episode.places.iter().all(|p| p.len() == widths.places)
        && episode.actions.iter().all(|a| a.len() == widths.action);
    if !fits {
        let message =
            "episodes of a motion have one row of places more than actions, all of one length";
        return Err(Error::Shape(message.into()));
    }
    let mut last = vec![0.0; widths.places];
    for (step, action) in episode.actions.iter().enumerate() {
        let (from, to) = (&episode.places[step], &episode.places[step + 1]);
        let change: Vec<f64> = to.iter().zip(from).map(|(b, a)| b - a).collect();
        let state = from.iter().chain(&last);
        if state.clone().chain(&change).all(|x| x.is_finite()) {
            data.state.extend(state.map(|&x| x as f32));
            data.action
                .extend(action.iter().map(|a| a.clamp(-1.0, 1.0) as f32));
            data.change.extend(change.iter().map(|&x| x as f32));
        }
        last = change;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use rand::Rng as _;

    use super::*;

    /// A cart whose velocity decays by a tenth per step and grows with the push: `d' = 0.9 d + 0.1
    /// a`. A stop at `x = 2` is never reached in training.
    fn cart(start: f64, actions: &[Vec<f64>]) -> Motion {
        let (mut x, mut d) = (start, 0.0);
        let mut places = vec![vec![x]];
        for action in actions {
            d = 0.9 * d + 0.1 * action[0];
            let free: f64 = x + d;
            d = free.min(2.0) - x;
            x += d;
            places.push(vec![x]);
        }
        Motion {
            places,
            actions: actions.to_vec(),
        }
    }

    fn error(model: &MotionModel, truth: &Motion) -> f64 {
        let found = model.predict(&truth.places[0], &truth.actions).unwrap();
        let last = truth.places.len() - 1;
        (found[last][0] - truth.places[last][0]).abs()
    }

    /// It predicts well where it was trained, and passes through a stop that it never met.
    #[test]
    fn it_predicts_what_it_has_seen_and_not_what_it_has_not() {
        let settings = EnsembleSettings {
            hidden: vec![32],
            epochs: 300,
            ..EnsembleSettings::default()
        };
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut episode = || {
            let start = rng.random_range(-1.0..0.0);
            let actions: Vec<Vec<f64>> =
                (0..10).map(|_| vec![rng.random_range(-1.0..1.0)]).collect();
            cart(start, &actions)
        };
        let learned: Vec<Motion> = (0..100).map(|_| episode()).collect();
        let model = MotionModel::fit(&settings, &learned, 1).unwrap();
        let inside = (0..10).map(|_| error(&model, &episode())).sum::<f64>() / 10.0;
        assert!(inside < 0.1, "{inside}");
        let push = vec![vec![1.0]; 20];
        let outside = error(&model, &cart(0.0, &push));
        assert!(outside > 5.0 * inside, "{outside} {inside}");
        // Equal seeds give equal models.
        let again = MotionModel::fit(&settings, &learned, 1).unwrap();
        let [a, b] = [&model, &again].map(|m| m.predict(&[0.0], &push).unwrap());
        assert_eq!(a, b);
    }

    #[test]
    fn episodes_that_do_not_fit_together_are_refused() {
        let settings = EnsembleSettings::default();
        let mut short = cart(0.0, &[vec![1.0], vec![0.5]]);
        short.places.pop();
        assert!(MotionModel::fit(&settings, &[short], 0).is_err());
        assert!(MotionModel::fit(&settings, &[], 0).is_err());
    }
}
