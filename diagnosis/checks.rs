//! Checks before any diagnosis: whether the logs and the study's parameters are fit for it.

mod identifiability;
mod missing;
mod missing_force;
mod motion;
mod rows;
mod units;

use asid_core::Result;
use asid_mjcf::memory::{OwnMemory, own_memory};

use crate::bench::{Bench, Explanation};
use crate::data::Logs;
use crate::findings::{LEAST_GAP, Repeats};
use crate::fit::cost;
use crate::machine::Machine;
use crate::predict::Predictor;
use crate::result::CheckResult;

pub use identifiability::identifiability;
pub use missing_force::{missing_force, windows};
pub use motion::motion;
pub use rows::rows;
pub use units::units;

/// Largest share of missing readings that passes the check.
const MISSING: f64 = 0.2;
/// Fewest readings of the training logs per unknown coordinate of an initial state.
///
/// With fewer than three per fitted number there are hardly any degrees of freedom left for
/// residuals (a regression needs ten, Harrell 2015, section 4.4).
const READINGS: usize = 3;
/// Ratio of an engine's own error to the change at half the time step.
///
/// It holds for errors of first order in the step (Richardson 1911), the worst among engines.
pub const RICHARDSON: f64 = 2.0;
/// Root mean square change at half the time step that does not matter, in units of the noise.
const FINE: f64 = 0.5;

/// Correlation of noise from one reading to the next from which on it is reported: below it an
/// estimate from a few hundred rows scatters about 0.
const COLOURED: f64 = 0.2;

/// Makes the result of a check.
fn check(name: &str, ok: bool, detail: String) -> CheckResult {
    CheckResult {
        check: name.into(),
        ok,
        detail,
    }
}

/// Counts readings and lengths, and checks whether they are enough for initial states with `open`
/// unknown coordinates.
#[must_use]
pub fn data(train: &Logs, test: &Logs, open: usize) -> CheckResult {
    let readings = |logs: &Logs| logs.present().iter().filter(|p| **p).count();
    let present: usize = [train, test].map(readings).iter().sum();
    let all = train.len() + test.len();
    let missing = 1.0 - present as f64 / all.max(1) as f64;
    let episodes = || train.episodes.iter().chain(&test.episodes);
    let seconds: f64 = episodes()
        .map(|e| e.episode.time[e.episode.rows() - 1] - e.episode.time[0])
        .sum();
    let (fitted, unknown) = (readings(train), open * train.episodes.len());
    let few = fitted < READINGS * unknown;
    let sound = missing <= MISSING;
    let named = if sound {
        String::new()
    } else {
        missing::named([train, test])
    };
    let too_little = if few {
        format!(
            "; {fitted} readings to fit to, with {unknown} unknown coordinates of starts, are too little to tell: log longer episodes"
        )
    } else {
        String::new()
    };
    check(
        "data",
        sound && !few,
        format!(
            "episodes: {} + {}, {seconds:.1} s, {present} readings, {:.1} % missing{named}{too_little}",
            train.episodes.len(),
            test.episodes.len(),
            100.0 * missing
        ),
    )
}

/// Checks whether the filters and delays that the model's own actuators and sensors have are kept.
///
/// The smoother places the machine at each row. What a sensor remembers is lost there, and what an
/// actuator remembers is lost on some engines. Effects keep theirs.
#[must_use]
pub fn memory(machine: &Machine) -> Option<CheckResult> {
    let is_lost = |m: &OwnMemory| m.of_sensor || !machine.remembers_commands();
    let own = own_memory(machine.scene.xml()).into_iter();
    let lost: Vec<String> = own.filter(is_lost).map(|m| m.what).collect();
    (!lost.is_empty()).then(|| {
        check(
            "memory",
            false,
            format!(
                "the model itself has a filter or a delay, which this engine forgets at each row of the logs: {}; take it out of the model and give it as an effect of a refined model (`asid list` has lags, filters and delays of drives and sensors)",
                lost.join(", ")
            ),
        )
    })
}

/// Describes whether each sensor's noise is white: where it was filtered, its deviation is larger
/// than neighbouring readings show.
#[must_use]
pub fn whiteness(logs: &Logs, residuals: &[Vec<f64>]) -> CheckResult {
    let noise = crate::noise::describe(logs, residuals);
    let each = logs.sensors.iter().zip(noise);
    let coloured: Vec<String> = each
        .filter(|(_, n)| n.correlation > COLOURED)
        .map(|(s, n)| format!("`{}` by {:.2}", s.name, n.correlation))
        .collect();
    let detail = if coloured.is_empty() {
        "no correlation from reading to reading is seen: it is taken for white".into()
    } else {
        format!(
            "the noise is correlated from reading to reading, which its deviation takes into account: of {}",
            coloured.join(", of ")
        )
    };
    check("noise", true, detail)
}

/// Describes how well replays repeat where bodies touch.
#[must_use]
pub fn repeatability(repeats: Repeats) -> CheckResult {
    let segments = if repeats.duration.is_finite() {
        format!("segments of {} s", repeats.duration)
    } else {
        "whole logs or stretches of contact".into()
    };
    let lost = 100.0 * repeats.lost;
    let so = if repeats.scatters {
        "what longer replays miss there is no effect"
    } else {
        "longer replays tell effects there"
    };
    check(
        "repeatability",
        true,
        format!(
            "replays of {segments} from starts that the readings leave open scatter by more than the noise in {lost:.0} % of their rows: {so}"
        ),
    )
}

/// Returns the change of an explanation's predictions of the training logs at half the time step,
/// in units of the noise.
///
/// `halved` is the same machine with half of the step.
///
/// # Errors
/// When a rollout fails.
pub fn change_by_step(bench: &Bench, of: &Explanation, halved: &Machine) -> Result<Vec<f64>> {
    let (point, parameters) = (&of.fit.point, of.parameters());
    let read = |machine: &Machine| -> Result<Vec<f64>> {
        let model = machine.with(&of.effects)?;
        let logs = bench.train.logs.replanned(model.layout());
        let mut predictor = Predictor::new(&*model, &parameters, &logs, 1, machine.threads)?;
        let mut residuals = predictor.residuals(std::slice::from_ref(point))?;
        Ok(residuals.pop().unwrap_or_default())
    };
    let (here, there) = (read(&bench.machine)?, read(halved)?);
    Ok(here.iter().zip(&there).map(|(a, b)| a - b).collect())
}

/// Returns the gap after a change of the predictions, in standard deviations of the noise: that of
/// `residuals` less the change.
fn gap_after(residuals: &[f64], change: &[f64], readings: f64) -> f64 {
    let pairs = residuals.iter().zip(change);
    let left: Vec<f64> = pairs.map(|(r, c)| r - c).collect();
    (cost(&left) / readings).sqrt()
}

/// Whether a gap is due to the time step: half of the step changes the predictions by a good part
/// of the gap and brings them closer to the logs.
///
/// Logs that the present step reproduces, as those of the same simulation, are further from replays
/// at half of it.
fn is_of_the_step(change: f64, gap: f64, finer: f64) -> bool {
    let matters = change >= FINE && change >= 0.5 * gap && gap > LEAST_GAP;
    matters && finer < gap
}

/// Checks whether the gap depends on the time step; `halved` is the same machine with half of it.
///
/// # Errors
/// When a rollout fails.
pub fn time_step(bench: &Bench, none: &Explanation, halved: &Machine) -> Result<CheckResult> {
    let change = change_by_step(bench, none, halved)?;
    let readings = bench.train.readings.max(1) as f64;
    let [left, gap] = [cost(&change), none.fit.cost].map(|c| (c / readings).sqrt());
    if !(left.is_finite() && gap.is_finite()) {
        let diverged = "replays diverge, at the time step of the model or at half of it: whether the gap depends on it is not told";
        return Ok(check("time-step", false, diverged.into()));
    }
    let finer = gap_after(&none.fit.residuals, &change, readings);
    let ok = !is_of_the_step(left, gap, finer);
    Ok(check(
        "time-step",
        ok,
        format!(
            "halving the time step changes the predictions by {left:.2} standard deviations of the noise; the gap is {gap:.2}, and \
             {finer:.2} at half the time step{}",
            if ok {
                ""
            } else {
                ": make the model's time step smaller first"
            }
        ),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_of_the_time_step_only_where_half_of_it_is_nearer_to_the_logs() {
        // An error of first order: the logs are two changes away, and half of the step covers one
        // of them.
        let change = [1.5, -1.5, 1.5, -1.5];
        let away = change.map(|c| 2.0 * c);
        let gap = (cost(&away) / 4.0).sqrt();
        let finer = gap_after(&away, &change, 4.0);
        assert!((finer - 1.5).abs() < 1e-12);
        assert!(is_of_the_step(1.5, gap, finer));
        // Logs of the same simulation, with an error of their own that is unrelated to the step.
        let own = [1.2, 1.2, 1.2, 1.2];
        let gap = (cost(&own) / 4.0).sqrt();
        let finer = gap_after(&own, &change, 4.0);
        assert!(finer > gap && !is_of_the_step(1.5, gap, finer));
    }
}
