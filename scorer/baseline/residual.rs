//! A network that learns the residuals of replays, without a name for what is missing.
//!
//! The study's parameters are fitted first. A small network then predicts the residual of a row
//! from the replayed readings and the commands of this row and a few earlier ones. It never gets a
//! measured reading as input, so its prediction is as open-loop as a replay. Its answer holds its
//! predictions for the held-out logs, which the scorer subtracts there.

#[cfg(feature = "torch")]
mod network;

use asid_core::Result;

use super::work::{Fitted, Work};
use crate::answer::Answer;
#[cfg(feature = "torch")]
use crate::physics::logs::Logs;

/// Rows that the network sees, the present one included.
///
/// At the usual 100 Hz they reach 40 ms back, as far as delays and filters of drives.
#[cfg(feature = "torch")]
const WINDOW: usize = 5;

/// One log, as input of the network.
#[cfg_attr(not(feature = "torch"), allow(dead_code))]
pub struct Sequence {
    /// Inputs, `rows x width`.
    pub inputs: Vec<f64>,
    /// Number of inputs of a row.
    pub width: usize,
    /// Residuals in units of the noise, `rows x outputs`; NaN where a reading is missing.
    pub residuals: Vec<f64>,
}

/// Adds the network's predictions for the held-out logs to the answer with the study's fitted
/// parameters.
///
/// # Errors
/// If a log cannot be replayed.
#[cfg(feature = "torch")]
pub fn add(work: &mut Work<'_>, none: &Fitted, seed: u64, mut answer: Answer) -> Result<Answer> {
    let train = sequences(&work.replayed(none, work.training())?);
    let held_out = work.replayed(none, work.testing())?;
    let test = sequences(&held_out);
    let network = network::Network::trained(&train, seed);
    let noise = work.noise_by_entry();
    let said: Vec<Vec<f64>> = test.iter().map(|s| network.residuals(s)).collect();
    let gap = |left: &dyn Fn(usize, usize, f64) -> f64| {
        let logs = test.iter().enumerate();
        let all = logs.flat_map(|(log, s)| {
            let rows = s.residuals.iter().enumerate();
            rows.map(move |(i, r)| left(log, i, *r))
        });
        let present: Vec<f64> = all.filter(|r| r.is_finite()).collect();
        let sum: f64 = present.iter().map(|r| r * r).sum();
        (sum / present.len().max(1) as f64).sqrt()
    };
    answer.gap.identified = Some(gap(&|_, _, r| r));
    answer.gap.refined = Some(gap(&|log, i, r| r - said[log][i]));
    let in_units = |said: &Vec<f64>| -> Vec<f64> {
        let entries = noise.iter().cycle();
        said.iter().zip(entries).map(|(x, n)| x * n).collect()
    };
    answer.learned = said.iter().map(in_units).collect();
    answer.verdict.kind = crate::answer::RESIDUAL.to_owned();
    answer.verdict.probability = 0.0;
    answer.hypotheses.clear();
    Ok(answer)
}

/// Without libtorch there is no network.
///
/// # Errors
/// Always.
#[cfg(not(feature = "torch"))]
pub fn add(_work: &mut Work<'_>, _none: &Fitted, _seed: u64, _answer: Answer) -> Result<Answer> {
    Err(asid_core::Error::Failed(
        "`residual-network` trains a network: build with --features torch".into(),
    ))
}

/// Logs with their replays as inputs of the network.
#[cfg(feature = "torch")]
fn sequences((logs, predicted): &(Logs, Vec<Vec<f64>>)) -> Vec<Sequence> {
    let residuals = logs.residuals(predicted);
    let (width, all) = (logs.signals.width(), logs.logs.iter().zip(predicted));
    all.zip(residuals)
        .map(|((log, predicted), residuals)| {
            let episode = &log.episode;
            let (rows, nu) = (episode.rows(), episode.actuators.len());
            let at = |row: usize| {
                let replayed = predicted[row * width..(row + 1) * width].iter();
                replayed.chain(&episode.ctrl[row * nu..(row + 1) * nu])
            };
            let mut inputs = Vec::new();
            for row in 0..rows {
                inputs.extend(at(row));
                // Earlier rows enter as differences: the values themselves are nearly equal, and a
                // delay shows in the differences.
                for back in 1..WINDOW {
                    let before = at(row.saturating_sub(back));
                    inputs.extend(at(row).zip(before).map(|(now, then)| now - then));
                }
            }
            Sequence {
                inputs,
                width: WINDOW * (width + nu),
                residuals,
            }
        })
        .collect()
}
