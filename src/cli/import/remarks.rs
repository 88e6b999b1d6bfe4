//! What a user should know of the logs of an import before a diagnosis: how a single one is cut,
//! commands that are held out and fitted too, and clocks that may have another unit.

use anyhow::Result;
use asid_core::{Episode, Error};
use asid_diagnosis::diagnose::enough_rows;
use asid_diagnosis::study::Study;
use asid_logs::propose::Proposal;
use asid_mjcf::Plant;
use asid_report::number::significant;
use asid_results::naming::{count, joined};

use super::Imported;
use super::files::PARTS;

/// Time between rows, s, from which on the unit of the stamps is in doubt: controllers of robots run
/// at 10 Hz or faster, and ms that are read as seconds give 1 s from 1 kHz down.
const SLOW: f64 = 1.0;

/// Largest difference of two courses of commands that count as the same, as a share of their own
/// variation: loggers round, and clocks differ by less than a row.
const SAME: f64 = 0.02;

/// Largest relative difference of the numbers of rows of two plays of the same commands: a logger is
/// started and stopped by hand.
const AS_LONG: f64 = 0.1;

/// Refuses logs that are too short for a diagnosis; `study` has the episodes as they are written.
pub(super) fn refuse_short(study: &Study, plant: &Plant, imported: &[Imported]) -> Result<()> {
    let Err(error) = enough_rows(study, &plant.layout) else {
        return Ok(());
    };
    let (Error::Config { message, .. }, [first, ..]) = (&error, imported) else {
        return Err(error.into());
    };
    let cut = match imported {
        [_] => format!("a single log is cut into {PARTS} episodes; "),
        _ => String::new(),
    };
    Err(Error::Log {
        path: first.path.clone(),
        message: format!("{cut}{message}"),
    }
    .into())
}

/// The remarks, one sentence each.
pub(super) fn remarks(imported: &[Imported], proposal: &Proposal) -> Vec<String> {
    let mut all = Vec::new();
    if let [one] = imported {
        let rows = one.episode.rows() / PARTS;
        all.push(format!(
            "the log is cut into {PARTS} episodes of about {}, the last of which is held out; a log of another motion, given by --test, \
             tests the model better",
            count(rows, "row")
        ));
    }
    all.extend(played_twice(imported));
    let steps = imported.iter().map(|one| usual_step(&one.episode));
    let slowest = steps.fold(0.0, f64::max);
    if slowest >= SLOW {
        let stamps = proposal.time.as_ref().and_then(|m| m.from.as_deref());
        all.push(format!(
            "rows are {} s apart: are the stamps in column `{}` in ms? `[[column]] name = \"time\"` with `unit = \"ms\"` in study.toml would \
             read them so",
            significant(slowest, 3),
            stamps.unwrap_or("time")
        ));
    }
    let still = proposal.matches.iter().filter(|m| m.mapping.is_some());
    let still = still.filter(|m| m.rate == 0.0);
    all.extend(still.map(|m| format!("`{}` has no two values at different times", m.name)));
    all
}

/// Names the logs held out whose commands are also fitted.
fn played_twice(imported: &[Imported]) -> Option<String> {
    let (test, train): (Vec<_>, Vec<_>) = imported.iter().partition(|one| one.test);
    let twice = test.iter().filter(|held| {
        let same = |fitted: &&Imported| same_commands(&held.episode, &fitted.episode);
        train.iter().any(same)
    });
    let names: Vec<String> = twice
        .map(|held| format!("`{}`", held.path.display()))
        .collect();
    let has = match names.len() {
        0 => return None,
        1 => "has",
        _ => "have",
    };
    Some(format!(
        "{}, held out, {has} the commands of a log that is fitted: this tests how well the machine repeats a motion, not whether the model \
         holds for another one; hold out another motion by --test",
        joined(&names, "and")
    ))
}

/// Whether two episodes have the same commands, which move.
fn same_commands(a: &Episode, b: &Episode) -> bool {
    let nu = a.actuators.len();
    let (most, fewest) = (a.rows().max(b.rows()), a.rows().min(b.rows()));
    if nu == 0 || nu != b.actuators.len() || (most - fewest) as f64 > AS_LONG * most as f64 {
        return false;
    }
    let (a, b) = (&a.ctrl[..fewest * nu], &b.ctrl[..fewest * nu]);
    let (mut apart, mut varies) = (0.0, 0.0);
    for actuator in 0..nu {
        let own = || a.iter().skip(actuator).step_by(nu);
        let mean = own().sum::<f64>() / fewest.max(1) as f64;
        let other = b.iter().skip(actuator).step_by(nu);
        varies += own().map(|x| (x - mean).powi(2)).sum::<f64>();
        apart += own().zip(other).map(|(x, y)| (x - y).powi(2)).sum::<f64>();
    }
    varies > 0.0 && apart <= SAME * SAME * varies
}

/// Median time between rows, s; 0 for a single row.
fn usual_step(episode: &Episode) -> f64 {
    let mut steps: Vec<f64> = episode.time.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn episode(rows: u32, command: impl Fn(f64) -> f64) -> Episode {
        let time: Vec<f64> = (0..rows).map(|k| 0.01 * f64::from(k)).collect();
        Episode {
            ctrl: time.iter().map(|t| command(*t)).collect(),
            actuators: vec!["servo".into()],
            time,
            ..Episode::default()
        }
    }

    /// Symptom: a log held out that plays the fitted motion again was taken for a test of the model,
    /// without a word.
    #[test]
    fn a_motion_that_is_played_again_is_recognised_by_its_commands() {
        let sine = |t: f64| (6.0 * t).sin();
        let once = episode(300, sine);
        // Rounded, and stopped a little earlier.
        let again = episode(290, |t| (1e3 * sine(t)).round() / 1e3);
        assert!(same_commands(&once, &again));
        assert!(!same_commands(&once, &episode(300, |t| (5.0 * t).sin())));
        assert!(!same_commands(&once, &episode(200, sine)));
        // Commands that stand still say nothing of a motion.
        let still = episode(300, |_| 0.5);
        assert!(!same_commands(&still, &still));
    }

    /// Symptom: stamps in ms in a column `time_s` gave rows 10 s apart, "0 Hz" and no remark.
    #[test]
    fn the_usual_step_of_rows_is_not_moved_by_a_gap() {
        let mut log = episode(11, |t| t);
        log.time.iter_mut().skip(5).for_each(|t| *t += 100.0);
        assert!((usual_step(&log) - 0.01).abs() < 1e-9);
        assert_eq!(usual_step(&episode(1, |t| t)), 0.0);
    }
}
