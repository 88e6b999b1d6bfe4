//! Trains the explorer `max`; its settings and play are in [`asid_learned::max`].
//!
//! ```text
//! warm-up: episodes of random actions
//! repeat for each round
//!     the ensemble learns from all transitions so far              (ensemble.rs)
//!     a new policy is trained in imagination: PPO in the ensemble, each step paid by the
//!         divergence of its members
//!     the policy plays episodes in the world
//! ```

mod imagination;

use std::time::Instant;

use asid_core::environment::BatchEnvironment;
use asid_core::explore::CurvePoint;
use asid_core::registry::{self, Settings};
use asid_core::{Error, Problem, Result};
use asid_learned::learning::{LearnedExplorer, Trainer, Training};
use asid_learned::max::{Max, Motion, round_name};
use asid_learned::play::POLICY;
use asid_learned::tensorboard::Scalars;
use asid_learned::{Policy, Tensors};
use rand::{Rng as _, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::ensemble::{Ensemble, Widths};
use crate::ppo::{PpoProgress, train as ppo};
use crate::tracked::{Nothing, TrackedEnvironment};
use crate::training::wall_time;
use imagination::{Experience, Imagination};

inventory::submit! {
    Trainer { algorithm: Max::NAME, train }
}

/// Layout of an observation.
///
/// It has `places` entries that move; disagreement about the first `paid` of them is rewarded. With
/// `changes` as many entries with their changes since the last step follow. Then comes, for each of
/// `relations` (first entries of an object and of the hand), the hand's position relative to the
/// object. The last entry is the elapsed share of the episode.
#[derive(Clone, Debug)]
pub struct Shape {
    pub places: usize,
    pub paid: usize,
    pub changes: bool,
    pub relations: Vec<[usize; 2]>,
    pub horizon: usize,
}

impl Shape {
    /// Number of entries of a state: an observation without the clock.
    fn state(&self) -> usize {
        self.moving() + 3 * self.relations.len()
    }

    /// Number of these entries that are places and changes; relations follow.
    fn moving(&self) -> usize {
        self.places * if self.changes { 2 } else { 1 }
    }
}

/// Results of one round.
pub struct Round {
    pub policy: Policy,
    /// Mean divergence that the trained policy collects in an imagined episode, nats.
    pub utility: f64,
    /// Standard deviation of this divergence.
    pub utility_std: f64,
    /// Mean divergence that its episodes in the world collect, before the ensemble learns from
    /// them, nats.
    pub utility_real: f64,
    /// Prediction error of the ensemble on the same episodes; see [`Ensemble::error`].
    pub model_error: f64,
    /// Control steps in the world so far.
    pub steps: usize,
}

/// Runs the rounds of MAX in a world whose observations have this shape; the world's own rewards
/// are ignored.
///
/// `told` receives every round and may end the work with an error.
///
/// # Errors
/// Those of the world and of the learner.
pub fn explore(
    world: &mut dyn BatchEnvironment,
    shape: Shape,
    settings: &Max,
    seed: u64,
    told: &mut dyn FnMut(usize, &Round) -> Result<()>,
) -> Result<Vec<Round>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let widths = Widths {
        state: shape.state(),
        action: world.action_len(),
        places: shape.places,
    };
    let mut ensemble = Ensemble::new(&settings.ensemble, widths, &mut rng)?;
    let mut experience = Experience::new(shape.clone());
    let mut random = ChaCha8Rng::seed_from_u64(rng.random());
    experience.play(world, settings.warm_up, &mut |_, actions| {
        actions.fill_with(|| random.random_range(-1.0..=1.0));
        Ok(())
    })?;
    let mut rounds = Vec::new();
    for number in 1..=settings.rounds {
        ensemble.fit(&experience.transitions, &settings.ensemble, &mut rng);
        let chance = ChaCha8Rng::seed_from_u64(rng.random());
        let (size, actions) = (settings.imagined, widths.action);
        let mut imagination = Imagination::new(&ensemble, &experience, size, actions, chance);
        let (mut utility, mut utility_std) = (f64::NAN, f64::NAN);
        let carry_on = &mut |p: &PpoProgress| {
            utility = p.mean_return.unwrap_or(utility);
            utility_std = p.return_std.unwrap_or(utility_std);
            std::ops::ControlFlow::Continue(())
        };
        let trained = ppo(&mut imagination, &settings.ppo, rng.random(), carry_on)?;
        let policy = trained.policy;
        let known = experience.transitions.clone();
        let mut noise = ChaCha8Rng::seed_from_u64(rng.random());
        experience.play(world, settings.environments, &mut |seen, actions| {
            policy.sample(seen, actions, &mut noise)
        })?;
        let new = experience.transitions.after(&known, widths);
        let round = Round {
            policy,
            utility,
            utility_std,
            utility_real: ensemble.utility(&new, shape.paid).unwrap_or(f64::NAN)
                * shape.horizon as f64,
            model_error: ensemble.error(&new).unwrap_or(f64::NAN),
            steps: experience.steps,
        };
        told(number, &round)?;
        rounds.push(round);
    }
    Ok(rounds)
}

/// Observation layout of a problem's exploration: the tracked parts are rewarded, the hand is not.
fn shape(problem: &Problem<'_>) -> Result<Shape> {
    let motion = Motion::new(problem)?;
    Ok(Shape {
        places: motion.places(),
        paid: motion.tracked(),
        changes: true,
        relations: motion.relations(),
        horizon: problem.task.exploration().horizon,
    })
}

fn train(problem: &Problem<'_>, settings: &Settings) -> Result<Training> {
    let explorer: Max = registry::settings("explorer", settings)?;
    let observation = explorer.observation(problem)?;
    let len = observation.iter().map(|e| e.len).sum();
    let sights = (0..explorer.environments)
        .map(|_| Motion::new(problem))
        .collect::<Result<Vec<_>>>()?;
    let shape = shape(problem)?;
    let mut world = TrackedEnvironment::new(problem, sights, len, Nothing, "max episodes")?;
    let seed = problem.streams.stream("max").random();
    let (mut tensors, mut curve, mut events) = (Tensors::new(), Vec::new(), Vec::new());
    let started = Instant::now();
    problem
        .progress
        .begin("explore: rounds", explorer.rounds as u64);
    let done = explore(&mut world, shape, &explorer, seed, &mut |number, round| {
        round.policy.to_tensors(&round_name(number), &mut tensors);
        curve.push(CurvePoint {
            x: round.steps as f64,
            mean: round.utility,
            std: round.utility_std,
        });
        let rate = round.steps as f64 / started.elapsed().as_secs_f64().max(1e-9);
        events.push(Scalars {
            step: round.steps as i64,
            wall_time: wall_time(),
            values: vec![
                ("charts/episodic_return", round.utility as f32),
                ("charts/SPS", rate as f32),
                ("charts/utility_real", round.utility_real as f32),
                ("losses/model_error", round.model_error as f32),
            ],
        });
        let note = format!(
            "utility {:.2} nats imagined, {:.2} in the world, error {:.2}",
            round.utility, round.utility_real, round.model_error
        );
        problem.progress.note(&note);
        problem.progress.advance(1);
        Ok(())
    });
    problem.progress.end();
    let rounds = done?;
    let last = rounds
        .last()
        .ok_or_else(|| Error::Failed("`max` played no round".into()))?;
    last.policy.to_tensors(POLICY, &mut tensors);
    Ok(Training {
        tensors,
        observation,
        steps: last.steps as u64,
        figures: vec![
            ("utility_nats", last.utility),
            ("utility_real_nats", last.utility_real),
            ("model_error_over_still", last.model_error),
        ],
        curve,
        events,
    })
}

#[cfg(test)]
mod tests;
