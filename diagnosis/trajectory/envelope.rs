//! Envelope of the motion: largest commands, speeds and forces, spreads of the readings, and where
//! bodies meet.

use asid_mjcf::Plant;

use super::Trajectory;
use crate::data::Logs;

impl Trajectory {
    /// Returns the largest command of an actuator, relative to its mean if it is a position.
    #[must_use]
    pub fn command(&self, plant: &Plant, actuator: usize) -> f64 {
        let nu = plant.layout.nu();
        let all = || {
            let episodes = self.episodes.iter();
            episodes.flat_map(move |e| e.ctrl.iter().skip(actuator).step_by(nu))
        };
        let servo = plant.drives[actuator].is_some_and(|d| d.is_position_servo());
        let n = all().count().max(1) as f64;
        let mean = if servo { all().sum::<f64>() / n } else { 0.0 };
        all().map(|u| (u - mean).abs()).fold(0.0, f64::max)
    }

    /// Returns the largest speed of a hinge or slide.
    #[must_use]
    pub fn speed(&self, plant: &Plant, joint: usize) -> f64 {
        let (nv, at) = (plant.layout.nv, plant.layout.joints[joint].qvel);
        let episodes = self.episodes.iter();
        let speeds = episodes.flat_map(|e| e.qvel.iter().skip(at).step_by(nv));
        speeds
            .filter(|v| v.is_finite())
            .fold(0.0, |a, v| a.max(v.abs()))
    }

    /// Returns the travel of a hinge or slide from end to end, rad or m.
    #[must_use]
    pub fn travel(&self, plant: &Plant, joint: usize) -> f64 {
        let (nq, at) = (plant.layout.nq, plant.layout.joints[joint].qpos);
        let episodes = self.episodes.iter();
        let places = episodes.flat_map(|e| e.qpos.iter().skip(at).step_by(nq));
        let ends = places
            .filter(|q| q.is_finite())
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
                [low.min(*q), high.max(*q)]
            });
        (ends[1] - ends[0]).max(0.0)
    }

    /// Returns the largest force of the drives on a hinge or slide, N or N m.
    #[must_use]
    pub fn force(&self, plant: &Plant, joint: usize) -> f64 {
        let layout = &plant.layout;
        let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
        let place = &layout.joints[joint];
        let mut largest: f64 = 0.0;
        for e in &self.episodes {
            let rows = e.qpos.chunks_exact(nq).zip(e.qvel.chunks_exact(nv));
            for (k, (q, v)) in rows.enumerate() {
                let sum: f64 = plant
                    .drives_of(joint)
                    .map(|(i, d)| d.force(e.ctrl[k * nu + i], q[place.qpos], v[place.qvel]))
                    .sum();
                if sum.is_finite() {
                    largest = largest.max(sum.abs());
                }
            }
        }
        largest
    }

    /// Returns the standard deviation of a sensor's readings.
    #[must_use]
    pub fn reading(&self, sensor: &str) -> f64 {
        let found = self.readings.iter().find(|(name, _)| name == sensor);
        found.map_or(1.0, |(_, spread)| *spread)
    }

    /// Returns quantiles of the positions along a world axis, m, of the bodies that can touch a
    /// geom.
    #[must_use]
    pub fn places(&self, plant: &Plant, geom: &str, axis: usize, quantiles: &[f64]) -> Vec<f64> {
        let Ok(site) = plant.geom(geom) else {
            return Vec::new();
        };
        let mut values: Vec<f64> = Vec::new();
        for body in movers(plant, site) {
            let Some(joint) = plant.free_joint(body) else {
                continue;
            };
            let at = plant.layout.joints[joint].qpos + axis;
            for e in &self.episodes {
                let column = e.qpos.iter().skip(at).step_by(plant.layout.nq);
                // Rows at rest are skipped: a long rest would outweigh where the body passed.
                let mut last = f64::NAN;
                for &x in column.filter(|x| x.is_finite()) {
                    if (x - last).abs() < 1e-3 {
                        continue;
                    }
                    last = x;
                    values.push(x);
                }
            }
        }
        if values.is_empty() {
            return Vec::new();
        }
        values.sort_by(f64::total_cmp);
        let pick = |q: f64| values[((q * (values.len() - 1) as f64).round()) as usize];
        quantiles.iter().map(|&q| pick(q)).collect()
    }
}

/// Returns the bodies that can touch a geom, and its own if it moves.
fn movers(plant: &Plant, geom: usize) -> Vec<usize> {
    let mut bodies: Vec<usize> = plant
        .contacts
        .iter()
        .filter(|pair| pair.contains(&geom))
        .flatten()
        .map(|&g| plant.geoms[g].body)
        .filter(|&b| plant.moves(b))
        .collect();
    bodies.sort_unstable();
    bodies.dedup();
    bodies
}

/// Returns the standard deviation of the readings of each sensor, with its name.
pub(super) fn spreads(logs: &Logs) -> Vec<(String, f64)> {
    let width = logs.width();
    let mut at = 0;
    let mut out = Vec::new();
    for (i, sensor) in logs.sensors.iter().enumerate() {
        let own = logs.entries.iter().filter(|e| e.sensor == i).count();
        let len = if sensor.rotation { 4 } else { own };
        let mut values = Vec::new();
        for e in &logs.episodes {
            values.extend(
                e.readings
                    .iter()
                    .skip(at)
                    .step_by(width)
                    .filter(|x| x.is_finite()),
            );
        }
        let n = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        out.push((sensor.name.clone(), variance.sqrt()));
        at += len;
    }
    out
}
