//! How many rows of the logs are smoothed: as many as a budget of physics steps allows.
//!
//! A walk along the rows is simulated once for each coordinate and each column of a screening, and
//! the work can stop only between two of these. So the budget comes first, and logs whose rows are
//! so long that hardly any fits are refused: their stamps are in another unit, or the model's time
//! step is far too short for the machine.

use asid_core::{Episode, Error, Layout, Result};

use crate::data::row_time;

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
/// Fewest rows of a log, where it has them, that are worth a diagnosis: a first speed takes six.
const USABLE: usize = 6;
/// Fewest rows of all logs, where they have them, that are worth a diagnosis: with a reading in
/// each, three for each number of the least of models (two coordinates of a start, the force's
/// variances and an effect) are 18.
const USABLE_IN_ALL: usize = 20;

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

/// Refuses logs of whose rows the budget holds too few to tell anything.
///
/// # Errors
/// When it does; the message names a log and says how far its rows are apart.
pub fn check_rows(layout: &Layout, logs: &[(String, Episode)]) -> Result<()> {
    let timestep = layout.timestep;
    let substeps = |(_, e): &(String, Episode)| -> Vec<usize> {
        let apart = e.time.windows(2).map(|t| (t[1] - t[0]) / timestep);
        apart.map(|n| n.round() as usize).collect()
    };
    let each: Vec<Vec<usize>> = logs.iter().map(substeps).collect();
    let steps: usize = each.iter().flatten().sum();
    let share = (affordable(layout.nv) / steps.max(1) as f64).min(1.0);
    let used: Vec<usize> = each.iter().map(|n| rows(n, share)).collect();
    let all: usize = each.iter().map(|n| n.len() + 1).sum();
    let in_all: usize = used.iter().sum();
    let too_few = in_all < USABLE_IN_ALL.min(all);
    let short =
        |((_, e), used): (&(String, Episode), &usize)| too_few || *used < USABLE.min(e.rows());
    let Some((name, episode)) = logs
        .iter()
        .zip(&used)
        .find(|one| short(*one))
        .map(|one| one.0)
    else {
        return Ok(());
    };
    let apart = row_time(episode);
    Err(Error::Log {
        path: name.into(),
        message: format!(
            "its rows are {apart:.3} s apart, {:.0} time steps of the model each, and a diagnosis has time for {in_all} rows of all logs, too \
             few to tell anything: is its time in ms? `[[column]] name = \"time\"` with `unit = \"ms\"` says so; for a machine that is this \
             slow give the model a longer time step",
            apart / timestep
        ),
    })
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
        // A slow machine, read every second in seven logs, and a log of few rows.
        let slow: Vec<(String, Episode)> = (0..7).map(|_| log(400, 1.0)).collect();
        assert!(check_rows(&layout, &slow).is_ok());
        assert!(check_rows(&layout, &[log(3, 0.01)]).is_ok());
        assert!((row_time(&wrong[0].1) - 10.0).abs() < 1e-12);
    }
}
