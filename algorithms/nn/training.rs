//! Common part of the explorers' trainings: PPO on an environment, with its curves.

use std::ops::ControlFlow;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use asid_core::explore::CurvePoint;
use asid_core::{BatchEnvironment, Problem, Result};
use asid_learned::file::ObservationEntry;
use asid_learned::learning::Training;
use asid_learned::play::POLICY;
use asid_learned::tensorboard::Scalars;
use asid_learned::{Policy, PpoConfig, Tensors};

use crate::ppo::{PpoProgress, train};

/// A trained policy and its curves.
pub struct Learned {
    pub policy: Policy,
    pub curve: Vec<CurvePoint>,
    pub events: Vec<Scalars>,
    /// Mean return of the last update in which an episode ended.
    pub last_return: f64,
}

impl Learned {
    /// Converts to a training, with the policy among its tensors and its return among its figures.
    pub fn training(self, observation: Vec<ObservationEntry>) -> Training {
        let mut tensors = Tensors::new();
        self.policy.to_tensors(POLICY, &mut tensors);
        Training {
            tensors,
            observation,
            steps: self.curve.last().map_or(0, |p| p.x as u64),
            figures: vec![("return", self.last_return)],
            curve: self.curve,
            events: self.events,
        }
    }
}

/// Seconds since 1970.
pub fn wall_time() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0.0, |d| d.as_secs_f64())
}

/// A point of the learning curve under CleanRL's names; values that are not finite are left out.
pub fn scalars(p: &PpoProgress, started: Instant) -> Scalars {
    let seconds = started.elapsed().as_secs_f64().max(1e-9);
    let values = [
        ("charts/episodic_return", p.mean_return.unwrap_or(f64::NAN)),
        ("charts/learning_rate", p.learning_rate),
        ("charts/SPS", p.env_steps as f64 / seconds),
        ("losses/value_loss", p.value_loss),
        ("losses/policy_loss", p.policy_loss),
        ("losses/entropy", p.entropy),
        ("losses/approx_kl", p.approx_kl),
        ("losses/clipfrac", p.clip_fraction),
        (
            "losses/explained_variance",
            p.explained_variance.unwrap_or(f64::NAN),
        ),
    ];
    Scalars {
        step: p.env_steps as i64,
        wall_time: wall_time(),
        values: values
            .into_iter()
            .filter(|v| v.1.is_finite())
            .map(|(name, x)| (name, x as f32))
            .collect(),
    }
}

/// Runs PPO on an environment and reports its progress to the problem.
///
/// # Errors
/// Those of the environment and of the learner.
pub fn learn_policy(
    problem: &Problem<'_>,
    environment: &mut dyn BatchEnvironment,
    config: &PpoConfig,
    seed: u64,
) -> Result<Learned> {
    let started = Instant::now();
    let (mut curve, mut events, mut told) = (Vec::new(), Vec::new(), 0);
    let mut last_return = f64::NAN;
    let total = config.total_steps as u64;
    problem.progress.begin("explore: training", total);
    let trained = train(environment, config, seed, &mut |p: &PpoProgress| {
        problem.progress.advance((p.env_steps - told) as u64);
        told = p.env_steps;
        if let (Some(mean), Some(std)) = (p.mean_return, p.return_std) {
            let note = format!("return {mean:.2} ± {std:.2}");
            problem.progress.note(&note);
            last_return = mean;
            curve.push(CurvePoint {
                x: p.env_steps as f64,
                mean,
                std,
            });
        }
        events.push(scalars(p, started));
        ControlFlow::Continue(())
    });
    problem.progress.end();
    Ok(Learned {
        policy: trained?.policy,
        curve,
        events,
        last_return,
    })
}
