//! Every effect of the catalogue at every site, with the start values of its fit.

use asid_core::registry::all;
use asid_effects::{Acts, Effect, EffectEntry, EffectSpec, Reference, Start};
use asid_mjcf::Plant;

use crate::physics::Study;

/// Maximum number of start values that are tried for one candidate.
const MOST_STARTS: usize = 6;

/// Motion of the machine: commands of the logs, and states of the study's model along them.
pub struct Shown {
    /// Commands, `rows x nu`.
    pub ctrl: Vec<f64>,
    /// Positions, `rows x nq`.
    pub qpos: Vec<f64>,
    /// Velocities, `rows x nv`.
    pub qvel: Vec<f64>,
}

fn column(all: &[f64], width: usize, at: usize) -> impl Iterator<Item = f64> + '_ {
    all.iter()
        .skip(at)
        .step_by(width)
        .copied()
        .filter(|x| x.is_finite())
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a: f64, x| a.max(x.abs()))
}

impl Shown {
    fn of(&self, study: &Study, site: &str, reference: Reference) -> f64 {
        let plant = &study.plant;
        let layout = &plant.layout;
        let actuator = layout.actuators.iter().position(|a| a.name == site);
        let joint = layout.joints.iter().position(|j| j.name == site);
        let driven = joint.or_else(|| plant.drives[actuator?].map(|d| d.joint));
        match (reference, actuator, driven) {
            (Reference::Command, Some(a), _) => largest(column(&self.ctrl, layout.nu(), a)),
            (Reference::Speed, _, Some(j)) => {
                largest(column(&self.qvel, layout.nv, layout.joints[j].qvel))
            }
            (Reference::Force, _, Some(j)) => self.force(plant, j),
            (Reference::Travel, _, Some(j)) => self.travel(plant, j),
            (Reference::Give, _, Some(j)) => {
                self.travel(plant, j) / self.force(plant, j).max(f64::MIN_POSITIVE)
            }
            (Reference::Reading, ..) => spread(study, site),
            _ => 1.0,
        }
    }

    /// Range of a joint's positions along the logs, rad or m.
    fn travel(&self, plant: &Plant, joint: usize) -> f64 {
        let layout = &plant.layout;
        let places = || column(&self.qpos, layout.nq, layout.joints[joint].qpos);
        let low = places().fold(f64::INFINITY, f64::min);
        let high = places().fold(f64::NEG_INFINITY, f64::max);
        (high - low).max(0.0)
    }

    /// Largest force of the drives on a joint along the logs, N or N m.
    fn force(&self, plant: &Plant, joint: usize) -> f64 {
        let layout = &plant.layout;
        let place = &layout.joints[joint];
        let rows = self
            .qpos
            .chunks_exact(layout.nq)
            .zip(self.qvel.chunks_exact(layout.nv));
        let forces = rows.enumerate().map(|(k, (q, v))| {
            let one = |(i, d): (usize, &asid_mjcf::plant::Drive)| {
                d.force(self.ctrl[k * layout.nu() + i], q[place.qpos], v[place.qvel])
            };
            plant.drives_of(joint).map(one).sum::<f64>()
        });
        largest(forces.filter(|f| f.is_finite()))
    }

    /// Quantiles of the position of the first free body along a world axis, m.
    fn places(&self, plant: &Plant, axis: usize, quantiles: &[f64]) -> Vec<f64> {
        let layout = &plant.layout;
        let free = |b: &usize| plant.free_joint(*b);
        let Some(joint) = (0..plant.bodies.len()).find_map(|b| free(&b)) else {
            return Vec::new();
        };
        let mut all: Vec<f64> =
            column(&self.qpos, layout.nq, layout.joints[joint].qpos + axis).collect();
        all.sort_by(f64::total_cmp);
        let at = |q: &f64| {
            all.get((q * (all.len().max(1) - 1) as f64) as usize)
                .copied()
        };
        quantiles.iter().filter_map(at).collect()
    }
}

/// Standard deviation of a sensor's readings.
fn spread(study: &Study, sensor: &str) -> f64 {
    let values = study.train.iter().filter_map(|e| {
        let range = e.channel(sensor)?;
        Some((0..e.rows()).flat_map(move |k| e.reading(k)[range.clone()].to_vec()))
    });
    let all: Vec<f64> = values.flatten().filter(|x| x.is_finite()).collect();
    let n = all.len().max(1) as f64;
    let mean = all.iter().sum::<f64>() / n;
    (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// All candidates but those left out, each as the specifications at which its fits begin.
#[must_use]
pub fn candidates(study: &Study, shown: &Shown, without: &[String]) -> Vec<Vec<EffectSpec>> {
    let mut found = Vec::new();
    for entry in all::<EffectEntry>() {
        if without.iter().any(|name| name == entry.name) {
            continue;
        }
        let effect = (entry.make)();
        for site in effect.sites(&study.plant) {
            let unread = !study.train.iter().any(|e| e.channel(&site).is_some());
            if effect.acts() == Acts::Measurement && unread {
                continue;
            }
            let spec = |values: Vec<(String, f64)>| EffectSpec {
                name: entry.name.to_owned(),
                site: site.clone(),
                values,
            };
            let label = spec(Vec::new()).label();
            if study.model.effects.iter().any(|e| e.label() == label) {
                continue;
            }
            let starts = starts(&*effect, study, &site, shown);
            found.push(starts.into_iter().map(spec).collect());
        }
    }
    found
}

/// Combinations of the parameters' start values.
///
/// A parameter to which the effect is proportional starts at its null value.
fn starts(
    effect: &dyn Effect,
    study: &Study,
    site: &str,
    shown: &Shown,
) -> Vec<Vec<(String, f64)>> {
    let mut all: Vec<Vec<(String, f64)>> = vec![Vec::new()];
    for p in effect.parameters() {
        let values = match p.start {
            Start::Slope | Start::Given => vec![p.null],
            Start::Values(v) | Start::Choice(v) => v.to_vec(),
            Start::Set(reference, multiple) => vec![multiple * shown.of(study, site, reference)],
            Start::Multiples(reference, v) => {
                let unit = shown.of(study, site, reference);
                v.iter().map(|x| x * unit).collect()
            }
            Start::Places(quantiles) => shown.places(&study.plant, 0, quantiles),
        };
        let values = if values.is_empty() {
            vec![p.null]
        } else {
            values
        };
        all = all
            .iter()
            .flat_map(|row| {
                values.iter().map(|x| {
                    let mut row = row.clone();
                    row.push((p.name.to_owned(), x.clamp(p.range[0], p.range[1])));
                    row
                })
            })
            .collect();
    }
    // Select evenly among the combinations.
    let stride = all.len().div_ceil(MOST_STARTS);
    all.into_iter().step_by(stride).collect()
}
