//! Experience of the world, and episodes that an ensemble imagines from it.

use asid_core::environment::{BatchEnvironment, Transition};
use asid_core::{Error, Result};
use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tch::Tensor;

use super::Shape;
use crate::actor_critic::to_vec;
use crate::ensemble::{Ensemble, Transitions, divergence};

/// Writes the actions of the whole batch for its observations.
type Act<'a> = &'a mut dyn FnMut(&[f64], &mut [f64]) -> Result<()>;

/// All transitions, and the states from which imagined episodes start.
pub struct Experience {
    shape: Shape,
    /// Training data of the ensemble.
    pub transitions: Transitions,
    /// First states of episodes, `n x state`.
    starts: Vec<f32>,
    /// Lowest and highest value of each place so far.
    seen: Vec<[f32; 2]>,
    /// Control steps played so far.
    pub steps: usize,
}

impl Experience {
    /// Empty experience.
    pub fn new(shape: Shape) -> Self {
        Self {
            seen: vec![[f32::INFINITY, f32::NEG_INFINITY]; shape.places],
            shape,
            transitions: Transitions::default(),
            starts: Vec::new(),
            steps: 0,
        }
    }

    /// Plays at least `episodes` whole episodes, with actions from `act`.
    pub fn play(
        &mut self,
        world: &mut dyn BatchEnvironment,
        episodes: usize,
        act: Act<'_>,
    ) -> Result<()> {
        let (n, len) = (world.batch_size(), world.observation_len());
        let state = self.shape.state();
        let mut transition = Transition::new(n, len);
        let mut actions = vec![0.0; n * world.action_len()];
        world.reset(&mut transition.observation)?;
        for step in 0..episodes.div_ceil(n) * self.shape.horizon {
            let before = transition.observation.clone();
            act(&before, &mut actions)?;
            world.step(&actions, &mut transition)?;
            let single = |row: &[f64]| row.iter().map(|&x| x as f32).collect::<Vec<f32>>();
            let rows = before.chunks_exact(len);
            let after = transition.final_observation.chunks_exact(len);
            let done = actions.chunks_exact(world.action_len());
            for ((from, to), action) in rows.zip(after).zip(done) {
                if from.iter().chain(to).any(|x| !x.is_finite()) {
                    continue;
                }
                let change = (0..self.shape.places).map(|i| (to[i] - from[i]) as f32);
                self.transitions.change.extend(change);
                self.transitions.state.extend(single(&from[..state]));
                let clipped: Vec<f64> = action.iter().map(|a| a.clamp(-1.0, 1.0)).collect();
                self.transitions.action.extend(single(&clipped));
                for (seen, x) in self.seen.iter_mut().zip(to) {
                    *seen = [seen[0].min(*x as f32), seen[1].max(*x as f32)];
                }
                if step % self.shape.horizon == 0 {
                    self.starts.extend(single(&from[..state]));
                }
            }
            self.steps += n;
        }
        if self.starts.is_empty() {
            return Err(Error::Failed("every episode of `max` diverged".into()));
        }
        Ok(())
    }
}

/// Environment of episodes that the ensemble imagines.
pub struct Imagination<'a> {
    ensemble: &'a Ensemble,
    experience: &'a Experience,
    /// Present states, `size x state`.
    state: Vec<f32>,
    size: usize,
    actions: usize,
    step: usize,
    rng: ChaCha8Rng,
}

impl<'a> Imagination<'a> {
    /// `size` simultaneous episodes with `actions` entries per action; they start at start states
    /// of the world.
    pub fn new(
        ensemble: &'a Ensemble,
        experience: &'a Experience,
        size: usize,
        actions: usize,
        rng: ChaCha8Rng,
    ) -> Self {
        Self {
            ensemble,
            experience,
            state: Vec::new(),
            size,
            actions,
            step: 0,
            rng,
        }
    }

    fn observe(&self, observation: &mut [f64]) {
        let shape = &self.experience.shape;
        let share = self.step as f64 / shape.horizon as f64;
        let rows = observation.chunks_exact_mut(shape.state() + 1);
        for (row, state) in rows.zip(self.state.chunks_exact(shape.state())) {
            for (o, &s) in row.iter_mut().zip(state) {
                *o = f64::from(s);
            }
            row[shape.state()] = share;
        }
    }
}

/// How far imagined places may leave the range seen so far, as a share of that range.
const BEYOND: f32 = 0.25;

impl BatchEnvironment for Imagination<'_> {
    fn batch_size(&self) -> usize {
        self.size
    }

    fn observation_len(&self) -> usize {
        self.experience.shape.state() + 1
    }

    fn action_len(&self) -> usize {
        self.actions
    }

    fn reset(&mut self, observation: &mut [f64]) -> Result<()> {
        let len = self.experience.shape.state();
        let n = self.experience.starts.len() / len;
        self.state.clear();
        for _ in 0..self.size {
            let at = self.rng.random_range(0..n) * len;
            let start = &self.experience.starts[at..at + len];
            self.state.extend_from_slice(start);
        }
        self.step = 0;
        self.observe(observation);
        Ok(())
    }

    fn step(&mut self, actions: &[f64], transition: &mut Transition) -> Result<()> {
        let shape = &self.experience.shape;
        let (places, len) = (shape.places, shape.state());
        let single: Vec<f32> = actions.iter().map(|a| a.clamp(-1.0, 1.0) as f32).collect();
        let unfitted = || Error::Failed("imagination before a fit".into());
        let prediction = self
            .ensemble
            .predict(&self.state, &single)
            .ok_or_else(unfitted)?;
        let utility: Vec<f64> = to_vec(&divergence(&prediction.first(shape.paid)));
        transition.reward.copy_from_slice(&utility);
        // The next state is drawn from a randomly chosen member, that is, from the mixture.
        let models = prediction.mean.size()[0];
        let member: Vec<i64> = (0..self.size)
            .map(|_| self.rng.random_range(0..models))
            .collect();
        let noise: Vec<f32> = (0..self.size * places)
            .map(|_| StandardNormal.sample(&mut self.rng))
            .collect();
        let index = Tensor::from_slice(&member)
            .view([1, -1, 1])
            .expand([1, self.size as i64, places as i64], false);
        let pick = |all: &Tensor| all.gather(0, &index, false).squeeze_dim(0);
        let noise = Tensor::from_slice(&noise).view([self.size as i64, places as i64]);
        let drawn = pick(&prediction.mean) + pick(&prediction.variance).sqrt() * noise;
        let change: Vec<f32> = to_vec(&self.ensemble.unscale(&drawn));
        for (state, change) in self
            .state
            .chunks_exact_mut(len)
            .zip(change.chunks_exact(places))
        {
            let (now, rest) = state.split_at_mut(places);
            let (rest, seen_from) = rest.split_at_mut(shape.moving() - places);
            for (i, (x, d)) in now.iter_mut().zip(change).enumerate() {
                let [low, high] = self.experience.seen[i];
                let slack = BEYOND * (high - low);
                let to = (*x + d).clamp(low - slack, high + slack);
                if let Some(last) = rest.get_mut(i) {
                    *last = to - *x;
                }
                *x = to;
            }
            for (out, [object, hand]) in seen_from.chunks_exact_mut(3).zip(&shape.relations) {
                for (i, x) in out.iter_mut().enumerate() {
                    *x = now[hand + i] - now[object + i];
                }
            }
        }
        self.step += 1;
        self.observe(&mut transition.final_observation);
        let over = self.step == shape.horizon;
        transition.terminated.fill(over);
        transition.truncated.fill(false);
        if over {
            return self.reset(&mut transition.observation);
        }
        transition
            .observation
            .copy_from_slice(&transition.final_observation);
        Ok(())
    }
}
