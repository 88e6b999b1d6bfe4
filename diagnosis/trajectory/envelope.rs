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

    /// Returns the spread of a sensor's readings: of the entry of a vector that moves most.
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

/// Returns the spread of the readings of each sensor, with its name: the standard deviation of the
/// entry that moves most.
///
/// A vector has one spread, and an entry that stands still does not tell how far the others move.
pub(super) fn spreads(logs: &Logs) -> Vec<(String, f64)> {
    let width = logs.width();
    let spread = |column: usize| {
        let rows = logs
            .episodes
            .iter()
            .flat_map(|e| e.readings.chunks_exact(width));
        deviation(rows.map(|row| row[column]).filter(|x| x.is_finite()))
    };
    let places = logs.places();
    let each = places.map(|(sensor, columns)| {
        let widest = columns.map(spread).fold(0.0, f64::max);
        (sensor.name.clone(), widest)
    });
    each.collect()
}

/// Returns the standard deviation of some values; 0 if there are none.
fn deviation(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    variance.sqrt()
}

#[cfg(test)]
mod tests {
    use asid_core::episode::ChannelColumns;
    use asid_core::{Episode, Scene};

    use super::*;

    /// Symptom: the steps of a tracker were searched for at the width of its noise. Cause: the
    /// spread of a vector was that of its first entry, along which the body did not move.
    #[test]
    fn the_spread_of_a_vector_is_that_of_the_entry_that_moves_most() {
        let scene = r#"<mujoco><worldbody><body name="b"><freejoint/><geom size="0.1"/>
            </body></worldbody><sensor><framepos name="place" objtype="xbody" objname="b"/>
            <framelinvel name="speed" objtype="xbody" objname="b"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("b", scene, &[]).unwrap()).unwrap();
        let channel = |name: &str| ChannelColumns {
            name: name.into(),
            len: 3,
        };
        // Equally often at either end: the deviation is half of the way.
        let row = |k: usize| {
            let end = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            let y = if k == 0 { f64::NAN } else { 0.01 * end };
            [0.5, y, 0.3 * end, 7.0 * end, 0.0, 0.0]
        };
        let episode = Episode {
            time: (0..40).map(|k| 0.01 * f64::from(k)).collect(),
            channels: ["place", "speed"].map(channel).into(),
            readings: (0..40).flat_map(row).collect(),
            ..Episode::default()
        };
        let sensors = ["place".to_owned(), "speed".to_owned()];
        let logs = Logs::new(&plant, &sensors, vec![("log".into(), episode)]).unwrap();
        let found = spreads(&logs);
        assert_eq!((&*found[0].0, &*found[1].0), ("place", "speed"));
        assert!((found[0].1 - 0.3).abs() < 1e-12, "{found:?}");
        assert!((found[1].1 - 7.0).abs() < 1e-12, "{found:?}");
    }
}
