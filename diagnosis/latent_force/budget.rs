//! How many rows of the logs are smoothed: as many as a budget of physics steps allows.
//!
//! A walk along the rows is simulated once for each coordinate and each column of a screening, and
//! the work can stop only between two of these. So the budget comes first, and logs whose rows are
//! so long that hardly any fits are refused: their stamps are in another unit, or the model's time
//! step is far too short for the machine.

use asid_core::{Episode, Error, Layout, Result};

use crate::noise::median;

use super::walk::Walk;

/// Most physics steps of one walk along all logs, times degrees of freedom.
///
/// A walk is simulated once for each coordinate and each candidate, and both numbers grow with the
/// degrees of freedom.
const BUDGET: f64 = 72_000.0;
/// Most physics steps times the square of the degrees of freedom.
///
/// From about six degrees of freedom on, the time of a step also grows with their number. A
/// screening of a machine with 22 takes 500 walks at 50 us a step.
const SQUARE_BUDGET: f64 = 432_000.0;
/// Rows of a log that are used even where the budget holds fewer.
const FEWEST: usize = 150;
/// Most physics steps of these rows: 40 a row, as of a log at 50 Hz with a time step of 0.5 ms.
const FEWEST_STEPS: usize = 6000;
/// Fewest rows of a log, where it has them, that are worth a diagnosis: a first speed takes six of
/// them, and a joint that moves and returns as many each way.
const USABLE: usize = 20;

/// Physics steps of one walk along all logs that the budget holds, for a machine with `nv` degrees
/// of freedom.
fn affordable(nv: usize) -> f64 {
    let nv = nv.max(1) as f64;
    (BUDGET / nv).min(SQUARE_BUDGET / (nv * nv))
}

/// Number of rows of a log that are used, by the physics steps of each row and the share of them
/// that the budget holds.
fn rows(substeps: &[usize], share: f64) -> usize {
    let all = substeps.len() + 1;
    let within = (share * all as f64).round() as usize;
    let mut steps = 0;
    let short = substeps.iter().take_while(|n| {
        steps += **n;
        steps <= FEWEST_STEPS
    });
    let least = (1 + short.count()).min(FEWEST);
    within.max(least).min(all)
}

/// The first rows of each walk, as many as the budget of physics steps allows.
///
/// At least two, which make a row that is stepped.
#[must_use]
pub fn within_budget(walks: Vec<Walk>, nv: usize) -> Vec<Walk> {
    let steps: usize = walks.iter().flat_map(|w| &w.substeps).sum();
    let share = affordable(nv) / steps.max(1) as f64;
    if share >= 1.0 {
        return walks;
    }
    let part = |w: &Walk| w.part(0..rows(&w.substeps, share).max(2).min(w.len()));
    walks.iter().map(part).collect()
}

/// Refuses logs of whose rows the budget holds fewer than `USABLE`.
///
/// # Errors
/// When there is one; the message names it and says how far its rows are apart.
pub fn check_rows(layout: &Layout, logs: &[(String, Episode)]) -> Result<()> {
    let timestep = layout.timestep;
    let seconds = |e: &Episode| e.time[e.rows() - 1] - e.time[0];
    let steps: f64 = logs.iter().map(|(_, e)| seconds(e) / timestep).sum();
    let share = affordable(layout.nv) / steps.max(1.0);
    for (name, episode) in logs {
        let substeps: Vec<usize> = (episode.time.windows(2))
            .map(|t| ((t[1] - t[0]) / timestep).round() as usize)
            .collect();
        let used = rows(&substeps, share.min(1.0));
        if used < USABLE.min(episode.rows()) {
            let apart = row_time(episode);
            return Err(Error::Log {
                path: name.into(),
                message: format!(
                    "its rows are {apart:.3} s apart, {:.0} time steps of the model each, and a diagnosis has time for {used} of them, fewer than \
                     {USABLE}: is its time in ms? `[[column]] name = \"time\"` with `unit = \"ms\"` says so; for a machine that is this slow give \
                     the model a longer time step",
                    apart / timestep
                ),
            });
        }
    }
    Ok(())
}

/// Median time between two rows of a log, s.
#[must_use]
pub fn row_time(episode: &Episode) -> f64 {
    let mut each: Vec<f64> = episode.time.windows(2).map(|t| t[1] - t[0]).collect();
    median(&mut each).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use asid_mjcf::Plant;

    use crate::data::tests::plant;

    use super::*;

    /// A log of some rows, each so many seconds after the one before.
    fn log(rows: usize, apart: f64) -> (String, Episode) {
        let episode = Episode {
            time: (0..rows).map(|k| apart * k as f64).collect(),
            ..Episode::default()
        };
        ("log.csv".into(), episode)
    }

    fn walk(rows: usize, substeps: usize) -> Walk {
        Walk {
            episode: 0,
            rows: (0..rows).collect(),
            time: (0..rows).map(|k| (k * substeps) as f64).collect(),
            substeps: vec![substeps; rows - 1],
            ctrl: Vec::new(),
            at_steps: Vec::new(),
            segment: None,
        }
    }

    /// Symptom: neither `--minutes` nor Ctrl-C ended a diagnosis of logs whose time in ms was read
    /// as s. Cause: at least 150 rows of a log were used, whatever the budget of physics steps
    /// holds, and the work stops only between two walks along them.
    #[test]
    fn a_walk_along_rows_that_are_far_apart_stays_within_the_budget() {
        for (nv, logs) in [(1, 1), (1, 6), (7, 2), (22, 4)] {
            for substeps in [1, 5, 40, 100, 5000] {
                let walks: Vec<Walk> = (0..logs).map(|_| walk(1000, substeps)).collect();
                let used = within_budget(walks, nv);
                let steps: usize = used.iter().flat_map(|w| &w.substeps).sum();
                // The rows that are used in any case, or two where each is longer than these.
                let floor = logs * FEWEST_STEPS.max(substeps);
                let most = affordable(nv) + floor as f64;
                assert!(steps as f64 <= most, "{nv} {logs} {substeps}: {steps}");
                let rows = used.iter().map(Walk::len).min().unwrap_or(0);
                assert!(substeps > 40 || rows >= FEWEST, "{substeps}: {rows}");
            }
        }
    }

    /// Symptom: as above. Cause: nothing asked whether the stamps are in ms.
    #[test]
    fn logs_whose_rows_exceed_the_budget_are_refused_in_one_line() {
        let Plant { layout, .. } = plant();
        // At 100 Hz, and the same stamps in ms.
        assert!(check_rows(&layout, &[log(2000, 0.01)]).is_ok());
        assert!(check_rows(&layout, &[log(2000, 10.0)]).is_err());
        let wrong = [log(2000, 10.0), log(2000, 10.0)];
        let said = check_rows(&layout, &wrong).unwrap_err().to_string();
        assert!(
            said.contains("log.csv") && said.contains("10.000 s apart"),
            "{said}"
        );
        assert!(said.contains("is its time in ms?"), "{said}");
        assert_eq!(said.lines().count(), 1);
        // A slow machine, read every two seconds, and a log of few rows.
        assert!(check_rows(&layout, &[log(200, 2.0)]).is_ok());
        assert!(check_rows(&layout, &[log(3, 0.01)]).is_ok());
        assert!((row_time(&wrong[0].1) - 10.0).abs() < 1e-12);
    }
}
