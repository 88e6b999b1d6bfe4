//! A sensor zero that is new in each episode.
//!
//! Examples are an encoder that is homed, and a gyroscope whose bias differs each time that it is
//! switched on. The shifts of different episodes are independent, so that each is a value of its
//! own. Episodes beyond the last value are not shifted.

use crate::{Acting, Acts, Confusion, Effect, EffectParameter, Site};
use asid_core::Result;
use asid_mjcf::Plant;

use super::values;

crate::register!(EffectEntry {
    name: "episode-offset",
    about: "a reading is shifted, in each episode otherwise",
    make: || Box::new(EpisodeOffset),
});

/// Number of episodes that have a value: each adds a column to a fit for each sensor.
const MOST: usize = 16;

/// Names of the values.
const NAMES: [&str; MOST] = [
    "e0", "e1", "e2", "e3", "e4", "e5", "e6", "e7", "e8", "e9", "e10", "e11", "e12", "e13", "e14",
    "e15",
];

/// `r + e_n`, `n` the number of the episode among all logs.
struct EpisodeOffset;

struct ShiftAt(f64);

impl Acting for ShiftAt {
    fn read(&mut self, _time: f64, reading: &mut [f64]) {
        reading.iter_mut().for_each(|r| *r += self.0);
    }
}

const fn parameters() -> [EffectParameter; MOST] {
    let null = EffectParameter::new("", "unit of the reading", [-10.0, 10.0], 0.0);
    let mut all = [null; MOST];
    let mut n = 0;
    while n < MOST {
        all[n].name = NAMES[n];
        all[n] = all[n].of_episode(n);
        n += 1;
    }
    all
}

impl Effect for EpisodeOffset {
    fn acts(&self) -> Acts {
        Acts::Measurement
    }

    fn remembers_readings(&self) -> bool {
        false
    }

    fn mistaken_for(&self) -> &'static [Confusion] {
        &[Confusion {
            with: &["sensor-bias", "sensor-trend", "sensor-drift"],
            told_apart_by: "begin each episode at one place that another instrument tells",
        }]
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        static ALL: [EffectParameter; MOST] = parameters();
        &ALL
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        let sensors = plant.layout.sensors.iter();
        let numbers = sensors.filter(|s| s.len == 1);
        numbers.map(|s| s.name.clone()).collect()
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let all: [f64; MOST] = values(site)?;
        let own = all.get(site.episode).copied().unwrap_or(0.0);
        Ok(Box::new(ShiftAt(own)))
    }
}
