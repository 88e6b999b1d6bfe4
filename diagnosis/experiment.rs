//! The next experiment: commands under which the predictions of rival explanations differ most.
//!
//! The models of the rivals replay the commands of a training episode faster or slower, larger or
//! smaller (`variation`). Motions that differ most are tried first. A motion counts only if the
//! machine may play it (`limits`). It is rated by the difference that remains once both rivals are
//! fitted again (`apart`): how well one such episode would distinguish them.

mod apart;
mod limits;
mod variation;

use asid_core::registry::find;
use asid_core::{Episode, Result};
use asid_effects::{Confusion, EffectEntry};

use crate::bench::{Bench, Explanation, Trial};
use crate::data::Logs;
use crate::predict::{Point, State};
use crate::record::Record;
use crate::result::NextExperiment;

use apart::apart;
use limits::Limits;
use variation::{VARIATIONS, Variation};

/// Divergence per episode, as a difference of log-likelihoods times two, from which on one episode
/// is enough.
///
/// Its square root is 4.5 standard deviations, which chance does not reach.
const ENOUGH: f64 = 20.0;
/// Divergence below which a motion is not worth playing: the predictions differ by less than one
/// standard deviation, as any two do by noise.
const TELLS: f64 = 1.0;
/// Text for the case that no motion is worth playing.
const NONE_TELLS: &str = "none of these motions tells more: refitted, the two predictions differ by less than one standard deviation of \
                          the noise over an episode; a motion of another kind is needed";
/// Number of motions that are examined more closely: one of each variation, at the cost of some
/// replays of a single episode each.
const CLOSER: usize = VARIATIONS.len();

/// Name of the file with the proposed commands.
const FILE: &str = "next.csv";

/// An explanation, and the trials from which it was fitted.
type Rival<'r> = (&'r [Trial<'r>], &'r Explanation);

/// The proposed next experiment, with the commands to play.
#[derive(Clone, Debug, Default)]
pub struct Proposed {
    /// What it would distinguish, and how.
    pub told: NextExperiment,
    /// Its commands, without readings; `None` if there are none.
    pub commands: Option<Episode>,
}

/// A training episode with varied commands.
///
/// `apart` is the difference between the rivals' predictions, a sum of squares in units of the
/// noise.
struct Motion {
    episode: usize,
    variation: Variation,
    apart: f64,
}

/// Finds the motion that would best distinguish two explanations.
///
/// # Errors
/// When a rollout fails.
pub fn next(bench: &Bench, one: Rival<'_>, other: Rival<'_>) -> Result<Proposed> {
    let name = |e: &Explanation| match e.labels() {
        labels if labels.is_empty() => "none".to_owned(),
        labels => labels.join(" + "),
    };
    let mut told = NextExperiment {
        separates: vec![name(one.1), name(other.1)],
        ..NextExperiment::default()
    };
    let commands = match best(bench, one, other)? {
        None => {
            "no variation of the recorded commands could be simulated within the machine's limits"
                .clone_into(&mut told.how);
            None
        }
        Some(best) if !tells(best.apart) => {
            NONE_TELLS.clone_into(&mut told.how);
            told.how += &hint(one.1, other.1);
            None
        }
        Some(best) => {
            let commands = repeat(bench, &best, &mut told);
            told.how += &differ(best.apart);
            told.how += &hint(one.1, other.1);
            commands
        }
    };
    Ok(Proposed { told, commands })
}

/// Whether a motion is worth playing; `apart` is a sum of squares in units of the noise.
fn tells(apart: f64) -> bool {
    apart >= TELLS
}

/// Describes how a motion repeats an episode, and names the file of its commands.
///
/// Returns these commands; `None` for a machine without actuators.
fn repeat(bench: &Bench, motion: &Motion, told: &mut NextExperiment) -> Option<Episode> {
    let episode = &bench.train.logs.episodes[motion.episode];
    let layout = bench.layout();
    told.how = format!("repeat {}", episode.name);
    if layout.nu() == 0 {
        told.how += " (there are no commands: vary the start)";
        return None;
    }
    told.how += &motion.variation.words();
    FILE.clone_into(&mut told.file);
    Some(Episode {
        channels: Vec::new(),
        readings: Vec::new(),
        ..motion.variation.of(&episode.episode, layout)
    })
}

/// Describes how far two predictions differ, and how many episodes are needed where one is too few.
fn differ(apart: f64) -> String {
    let deviations = apart.sqrt();
    let mut text = format!(
        ": refitted, the two predictions then differ by {deviations:.1} standard deviations of the noise over the episode"
    );
    if apart < ENOUGH {
        let episodes = (ENOUGH / apart).ceil();
        text += &format!(
            "; that is little, so {episodes} such episodes are needed, or a motion of another kind"
        );
    }
    text
}

/// Returns the most informative motion among those that the machine may play.
fn best(bench: &Bench, one: Rival<'_>, other: Rival<'_>) -> Result<Option<Motion>> {
    let mut motions = all(bench, one, other)?;
    motions.sort_by(|a, b| b.apart.total_cmp(&a.apart));
    let limits = Limits::of(bench, one)?;
    let mut best: Option<Motion> = None;
    for motion in motions.into_iter().take(CLOSER) {
        if best.as_ref().is_some_and(|b| b.apart >= motion.apart) {
            // A new fit never increases the difference.
            break;
        }
        let record = varied(
            bench,
            &[motion.episode],
            motion.variation,
            &one.1.fit.point.starts,
        )?;
        let as_recorded = motion.variation == VARIATIONS[0];
        let may_play =
            as_recorded || limits.keeps(&record, one)? && limits.keeps(&record, other)?;
        if !may_play {
            continue;
        }
        let apart = apart(bench, &record, [one, other])?;
        if apart.is_finite() && best.as_ref().is_none_or(|b| apart > b.apart) {
            best = Some(Motion { apart, ..motion });
        }
    }
    Ok(best)
}

/// Returns for each variation the training episode whose predictions differ most, with the rivals
/// as fitted.
fn all(bench: &Bench, one: Rival<'_>, other: Rival<'_>) -> Result<Vec<Motion>> {
    let episodes: Vec<usize> = (0..bench.train.logs.episodes.len()).collect();
    let variations = if bench.layout().nu() == 0 {
        &VARIATIONS[..1]
    } else {
        &VARIATIONS[..]
    };
    let mut motions = Vec::with_capacity(variations.len());
    for &variation in variations {
        let starts = &one.1.fit.point.starts;
        let record = varied(bench, &episodes, variation, starts)?;
        let predict = |(trials, of): Rival<'_>| -> Result<Vec<f64>> {
            let point = Point {
                theta: of.fit.point.theta.clone(),
                starts: record.starts.clone(),
            };
            let mut predictor = bench.predictor(trials, &record)?;
            Ok(predictor.residuals(&[point])?.pop().unwrap_or_default())
        };
        let (a, b) = (predict(one)?, predict(other)?);
        let of_episode = |&episode: &usize| {
            let range = record.logs.offset(episode)..record.logs.offset(episode + 1);
            let pairs = a[range.clone()].iter().zip(&b[range]);
            let apart: f64 = pairs.map(|(x, y)| (x - y).powi(2)).sum();
            apart.is_finite().then_some(Motion {
                episode,
                variation,
                apart,
            })
        };
        let found = episodes.iter().filter_map(of_episode);
        motions.extend(found.max_by(|a, b| a.apart.total_cmp(&b.apart)));
    }
    Ok(motions)
}

/// Makes a record of some training episodes with varied commands, each as the log after all those
/// of the study.
fn varied(
    bench: &Bench,
    episodes: &[usize],
    variation: Variation,
    starts: &[State],
) -> Result<Record> {
    let logs = &bench.train.logs;
    let vary = |&e: &usize| {
        let log = &logs.episodes[e];
        (log.name.clone(), variation.of(&log.episode, bench.layout()))
    };
    let played = episodes.iter().map(vary).collect();
    let mut varied = Logs::new(&bench.machine.plant, &logs.channels(), played)?;
    let noise: Vec<f64> = logs.sensors.iter().map(|s| s.noise).collect();
    varied.set_noise(&noise);
    // What changes from log to log goes on changing.
    let next = logs.episodes.len() + bench.test.logs.episodes.len();
    varied.episodes.iter_mut().for_each(|e| e.number = next);
    let starts = episodes.iter().map(|&e| starts[e].clone()).collect();
    Ok(Record::new(varied, starts))
}

/// Returns the known way to distinguish a pair of confounded effects, as a part of a sentence;
/// empty if none is known.
fn hint(one: &Explanation, other: &Explanation) -> String {
    let of = |a: &Explanation, b: &Explanation| {
        a.effects.iter().find_map(|effect| {
            let confusions = (find::<EffectEntry>(&effect.name).ok()?.make)().mistaken_for();
            let names = |c: &&Confusion| b.effects.iter().any(|e| c.with.contains(&&*e.name));
            confusions.iter().find(names).map(|c| c.told_apart_by)
        })
    };
    let found = of(one, other).or_else(|| of(other, one));
    found.map_or_else(String::new, |text| format!("; {text}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: motions without information were proposed, to be repeated hundreds of times.
    #[test]
    fn a_motion_that_is_proposed_takes_no_more_than_twenty_plays() {
        assert!(!tells(0.99 * 0.99) && !tells(0.0) && !tells(f64::NAN));
        assert!(tells(1.0));
        assert!(differ(1.0).contains("differ by 1.0 standard deviations"));
        assert!(differ(1.0).contains("so 20 such episodes are needed"));
        assert!(differ(ENOUGH).ends_with("over the episode"));
    }
}
