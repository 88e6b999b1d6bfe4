//! Fits a study's parameters to its logs: output-error identification over open-loop replays.
//!
//! Gauss-Newton steps from several starts minimise the residuals of replays
//! ([`asid_algorithms::optimise::gauss_newton`]). Initial states that a log leaves open are
//! marginalised. With their sensitivities `S` and a wide prior, residuals have the covariance
//! `1 + S S^T`. They are whitened by its root, `r - U (1 - (1 + σ²)^-1/2) U^T r` with
//! `S = U σ V^T`. As the prior widens this becomes variable projection (G. Golub, V. Pereyra, SIAM
//! J. Numer. Anal. 10, 1973). The sensitivities are computed anew at the point that the fit arrives
//! at. Where replays jump, as with contacts, the search continues among the valleys of their loss.

use asid_algorithms::identify::gauss_newton::posterior_of;
use asid_algorithms::optimise::gauss_newton::{Fit, GaussNewtonSettings, Space, minimise};
use asid_core::episode::InitialState;
use asid_core::error::{Error, Result};
use asid_core::{Model, Parameter, Posterior, Progress, Streams};
use nalgebra::DMatrix;

use crate::by_episodes::{parts, widened};
use crate::check_scales;
use crate::dataset::{Dataset, Replayer};
use crate::marginal::{marginal, values};
use crate::valleys::{Watched, confirmed};

/// Rounds, each of which computes open initial states and their sensitivities anew.
const ROUNDS: usize = 3;

/// Most simulations in a batch: enough for all cores of a large machine, few enough for memory.
const BATCH: usize = 256;

/// Half width of a later round's box about the last round's point, in prior standard deviations.
const NEAR: f64 = 0.7;

/// Draws of the posterior: their quantiles are accurate to 2 % of its width.
const DRAWS: usize = 4000;

/// Result of a fit.
pub struct Identified {
    /// Posterior of the parameters.
    pub posterior: Posterior,
    /// The best values, in the parameters' units.
    pub values: Vec<f64>,
    /// Root mean square of the residuals there, in units of the noise.
    pub residual: f64,
    /// Root mean square of the residuals there, in units of noise and roughness together.
    pub misfit: f64,
    /// Information about the parameters from the logs alone, in prior standard deviations.
    pub information: DMatrix<f64>,
    /// Physics steps of all replays.
    pub physics_steps: u64,
}

/// Settings for machines whose replays are smooth in the unknowns, as where nothing bounces.
///
/// They need fewer starting points, and fewer fits over the region of the posterior, than a task
/// with contacts.
#[must_use]
pub fn smooth() -> GaussNewtonSettings {
    GaussNewtonSettings {
        screened: 32,
        starts: 2,
        iterations: 8,
        rounds: 2,
        ..GaussNewtonSettings::default()
    }
}

/// Fits the parameters.
///
/// # Errors
/// When there is nothing to fit, nearly all replays diverge, or the engine fails.
pub fn fit(
    model: &dyn Model,
    parameters: &[Parameter],
    data: &Dataset,
    (settings, streams): (&GaussNewtonSettings, Streams),
    threads: usize,
    progress: &dyn Progress,
) -> Result<Identified> {
    if parameters.is_empty() {
        return Err(Error::Config {
            key: "parameter".into(),
            message: "there is nothing to fit: name what is unknown in [[parameter]] of the study"
                .into(),
        });
    }
    check_scales(parameters)?;
    let layout = model.layout();
    let open = data.trials.iter().map(|t| t.open.len()).max().unwrap_or(0);
    let size = settings
        .batch(parameters.len())
        .max(1 + 2 * open)
        .min(BATCH);
    let mut replayer = Replayer::new(model, parameters, size, threads)?;
    let bound = Parameter::scaled_bound();
    let mut box_ = (
        vec![-bound; parameters.len()],
        vec![bound; parameters.len()],
    );
    let mut z = vec![0.0; parameters.len()];
    let mut rng = streams.stream("identify");
    let rounds = if open == 0 { 1 } else { ROUNDS };
    progress.begin(
        "identify",
        (rounds * (settings.iterations + settings.rounds)) as u64,
    );
    let mut found: Option<Fit> = None;
    for _ in 0..rounds {
        let theta = values(parameters, &z);
        let marginals = data
            .trials
            .iter()
            .map(|trial| marginal(&mut replayer, layout, data, trial, &theta))
            .collect::<Result<Vec<_>>>()?;
        let present: usize = data.trials.iter().map(|t| data.present(t)).sum();
        let space = Space {
            low: &box_.0,
            high: &box_.1,
            sought: parameters.len(),
            readings: present.saturating_sub(data.trials.iter().map(|t| t.open.len()).sum()),
        };
        let mut residuals = |points: &[Vec<f64>]| -> Result<Vec<Option<Vec<f64>>>> {
            let thetas: Vec<Vec<f64>> = points.iter().map(|z| values(parameters, z)).collect();
            let mut all: Vec<Option<Vec<f64>>> = vec![Some(Vec::new()); points.len()];
            for (trial, marginal) in data.trials.iter().zip(&marginals) {
                let points: Vec<(&[f64], &InitialState)> =
                    thetas.iter().map(|t| (&t[..], &marginal.start)).collect();
                let rows = replayer.residuals(data, trial, &points)?;
                for (to, row) in all.iter_mut().zip(rows) {
                    match (to.as_mut(), row) {
                        (Some(to), Some(row)) => to.extend(marginal.apply(&row)),
                        _ => *to = None,
                    }
                }
            }
            Ok(all)
        };
        let mut watched = Watched::new(&mut residuals);
        if found.is_some() {
            watched.losses(std::slice::from_ref(&z))?;
        }
        let mut seen = |points: &[Vec<f64>]| watched.residuals(points);
        let fitted = minimise(settings, &mut seen, space, &mut rng, || progress.advance(1))?;
        let Some(fitted) = fitted else { break };
        let with = (&mut rng, progress);
        let fitted = confirmed(&mut watched, fitted, settings, space, with)?;
        z.clone_from(&fitted.point);
        for (i, x) in z.iter().enumerate() {
            box_.0[i] = (x - NEAR).max(-bound);
            box_.1[i] = (x + NEAR).min(bound);
        }
        found = Some(fitted);
    }
    progress.end();
    let Some(mut found) = found else {
        return Err(Error::Failed(
            "nearly every replay of the logs diverged; check the model, its time step and the first state".into(),
        ));
    };
    let at = (parameters, &found.point[..]);
    let parts = parts(&mut replayer, layout, data, at, &found.information)?;
    found.information = widened(&found.information, &parts);
    Ok(Identified {
        posterior: posterior_of(&found, parameters, DRAWS, &mut rng),
        values: values(parameters, &found.point),
        residual: found.residual,
        misfit: found.misfit,
        information: found.about(parameters.len()),
        physics_steps: replayer.steps(),
    })
}
