//! The next experiment: commands under which rival explanations predict most differently.
//!
//! The commands of a training episode are played faster or slower, larger or smaller, in
//! the models of the rivals as they were fitted; the expected divergence of their readings,
//! in units of the noise, says how well one such episode would tell them apart.

use asid_core::registry::find;
use asid_core::{Episode, Result};
use asid_effects::{Confusion, EffectEntry};

use crate::bench::{Bench, Explanation, Trial};
use crate::data::Logs;
use crate::predict::Point;
use crate::record::Record;
use crate::result::NextExperiment;

/// Factors on the commands' size about their mean, and on time.
const VARIANTS: [(f64, f64); 6] = [
    (1.0, 1.0),
    (0.4, 1.0),
    (1.5, 1.0),
    (1.0, 0.5),
    (1.0, 2.0),
    (-1.0, 1.0),
];
/// Divergence per episode, in the likelihood's unit, from which on one episode is enough.
const ENOUGH: f64 = 20.0;

/// An episode with its commands scaled about their mean and stretched in time.
fn varied(episode: &Episode, layout: &asid_core::Layout, size: f64, stretch: f64) -> Episode {
    let nu = episode.actuators.len();
    let mut other = episode.clone();
    let start = other.time[0];
    for t in &mut other.time {
        *t = start + (*t - start) * stretch;
    }
    for a in 0..nu {
        let column = || episode.ctrl.iter().skip(a).step_by(nu);
        let n = column().count().max(1) as f64;
        let mean = column().sum::<f64>() / n;
        let range = layout.actuators[a].ctrl_range;
        for (k, u) in column().enumerate() {
            let x = mean + size * (u - mean);
            other.ctrl[k * nu + a] = range.map_or(x, |[low, high]| x.clamp(low, high));
        }
    }
    other.readings.fill(0.0);
    other
}

/// Finds what would tell two explanations apart.
///
/// # Errors
/// When a rollout fails.
pub fn next(
    bench: &Bench,
    (first, one): (&[Trial<'_>], &Explanation),
    (second, other): (&[Trial<'_>], &Explanation),
) -> Result<NextExperiment> {
    let layout = bench.layout();
    let train = &bench.train;
    let n = train.logs.episodes.len();
    let mut best: Option<(f64, usize, (f64, f64))> = None;
    let passive = layout.nu() == 0;
    let variants = if passive {
        &VARIANTS[..1]
    } else {
        &VARIANTS[..]
    };
    for &(size, stretch) in variants {
        let episodes = train
            .logs
            .episodes
            .iter()
            .map(|e| (e.name.clone(), varied(&e.episode, layout, size, stretch)))
            .collect();
        let mut logs = Logs::new(&bench.machine.plant, &train.logs.channels(), episodes)?;
        let noise: Vec<f64> = train.logs.sensors.iter().map(|s| s.noise).collect();
        logs.set_noise(&noise);
        let record = Record::new(logs, one.fit.point.starts.clone());
        let predict = |trials: &[Trial<'_>], e: &Explanation| -> Result<Vec<f64>> {
            let mut predictor = bench.predictor(trials, &record)?;
            let point = Point {
                theta: e.fit.point.theta.clone(),
                starts: one.fit.point.starts.clone(),
            };
            Ok(predictor.residuals(&[point])?.pop().unwrap_or_default())
        };
        let (a, b) = (predict(first, one)?, predict(second, other)?);
        for e in 0..n {
            let range = record.logs.offset(e)..record.logs.offset(e + 1);
            let pairs = a[range.clone()].iter().zip(&b[range]);
            let apart: f64 = pairs.map(|(x, y)| (x - y).powi(2)).sum();
            if apart.is_finite() && best.as_ref().is_none_or(|(d, ..)| apart > *d) {
                best = Some((apart, e, (size, stretch)));
            }
        }
    }
    let name = |e: &Explanation| match e.labels() {
        labels if labels.is_empty() => "none".to_owned(),
        labels => labels.join(" + "),
    };
    let separates = vec![name(one), name(other)];
    let Some((apart, e, (size, stretch))) = best else {
        return Ok(NextExperiment {
            separates,
            how: "no variation of the recorded commands could be simulated".into(),
        });
    };
    let mut how = format!("repeat {}", train.logs.episodes[e].name);
    if passive {
        how += " (there are no commands: vary the start)";
    }
    if size < 0.0 {
        how += " with the commands mirrored about their mean";
    } else if size != 1.0 {
        how += &format!(" with commands {size} times as large about their mean");
    }
    if stretch != 1.0 {
        how += if stretch < 1.0 {
            " at twice the speed"
        } else {
            " at half the speed"
        };
    }
    how += &format!(
        ": the two predictions then differ by {:.1} standard deviations of the noise over the episode",
        apart.sqrt()
    );
    if apart < ENOUGH {
        how += &format!(
            "; that is little, so {} such episodes are needed, or a motion of another kind",
            (ENOUGH / apart.max(0.01)).ceil().min(1000.0)
        );
    }
    how += &hint(one, other);
    Ok(NextExperiment { separates, how })
}

/// What is known of a pair of confounded effects.
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
