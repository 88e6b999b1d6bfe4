//! Memoryless errors of a reading: bias, scale, drift, trend over episodes, quantisation.
//!
//! Sites are sensors that read numbers or vectors. Orientations and unit vectors are not sites:
//! adding a number to them means nothing.

use crate::{Acting, Acts, Effect, EffectParameter, Reference, Site, Start};
use asid_core::Result;
use asid_mjcf::Plant;

use super::{at_least, values};

crate::register!(EffectEntry {
    name: "sensor-bias",
    about: "a reading is shifted",
    make: || Box::new(Reading::Bias),
});

crate::register!(EffectEntry {
    name: "sensor-scale",
    about: "a reading is scaled",
    make: || Box::new(Reading::Scale),
});

crate::register!(EffectEntry {
    name: "sensor-drift",
    about: "a reading is off by more and more",
    make: || Box::new(Reading::Drift),
});

crate::register!(EffectEntry {
    name: "sensor-trend",
    about: "a reading is off by more and more from episode to episode",
    make: || Box::new(Reading::Trend),
});

crate::register!(EffectEntry {
    name: "sensor-quantization",
    about: "a reading comes in steps",
    make: || Box::new(Reading::Quantization),
});

/// The error of a reading `r`.
///
/// - `Bias`: `r + bias` for a number, `r + (x, y, z)` for a vector; the other parameters do
///   nothing.
/// - `Scale`: `scale r`, every entry of a vector.
/// - `Drift`: `r + rate t` for a number, `r + (x, y, z) t` for a vector, `t` since the episode
///   began.
/// - `Trend`: `r + step n` for a number, `r + (x, y, z) n` for a vector, `n` the number of the
///   episode among all logs.
/// - `Quantization`: the nearest multiple of `step`, every entry of a vector.
#[derive(Clone, Copy)]
enum Reading {
    Bias,
    Scale,
    Drift,
    Trend,
    Quantization,
}

struct ReadingAt {
    law: Reading,
    /// One value for each entry of the reading.
    values: [f64; 3],
}

impl Acting for ReadingAt {
    fn read(&mut self, time: f64, reading: &mut [f64]) {
        for (r, value) in reading.iter_mut().zip(self.values) {
            match self.law {
                Reading::Bias | Reading::Trend => *r += value,
                Reading::Scale => *r *= value,
                Reading::Drift => *r += value * time,
                Reading::Quantization if value > 0.0 => *r = (*r / value).round() * value,
                Reading::Quantization => {}
            }
        }
    }
}

/// Names of the sensors that read numbers or vectors, unit vectors excepted.
pub(super) fn sensors(plant: &Plant) -> Vec<String> {
    let sensors = plant.layout.sensors.iter();
    sensors
        .filter(|s| matches!(s.len, 1 | 3) && !s.kind.ends_with("axis") && s.kind != "normal")
        .map(|s| s.name.clone())
        .collect()
}

impl Effect for Reading {
    fn acts(&self) -> Acts {
        Acts::Measurement
    }

    fn remembers_readings(&self) -> bool {
        false
    }

    fn shifts_readings(&self) -> bool {
        matches!(self, Self::Bias)
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        const UNIT: &str = "unit of the reading";
        const RATE: &str = "units of the reading per second";
        const STEP: &str = "units of the reading per episode";
        match self {
            Self::Bias => {
                const {
                    &[
                        EffectParameter::new("bias", UNIT, [-10.0, 10.0], 0.0),
                        EffectParameter::new("x", UNIT, [-10.0, 10.0], 0.0),
                        EffectParameter::new("y", UNIT, [-10.0, 10.0], 0.0),
                        EffectParameter::new("z", UNIT, [-10.0, 10.0], 0.0),
                    ]
                }
            }
            Self::Scale => const { &[EffectParameter::new("scale", "1", [0.3, 3.0], 1.0)] },
            Self::Drift => {
                const {
                    &[
                        EffectParameter::new("rate", RATE, [-1.0, 1.0], 0.0),
                        EffectParameter::new("x", RATE, [-1.0, 1.0], 0.0),
                        EffectParameter::new("y", RATE, [-1.0, 1.0], 0.0),
                        EffectParameter::new("z", RATE, [-1.0, 1.0], 0.0),
                    ]
                }
            }
            Self::Trend => {
                const {
                    &[
                        EffectParameter::new("step", STEP, [-1.0, 1.0], 0.0),
                        EffectParameter::new("x", STEP, [-1.0, 1.0], 0.0),
                        EffectParameter::new("y", STEP, [-1.0, 1.0], 0.0),
                        EffectParameter::new("z", STEP, [-1.0, 1.0], 0.0),
                    ]
                }
            }
            Self::Quantization => {
                const {
                    &[EffectParameter::new("step", UNIT, [0.0, 10.0], 0.0)
                        .starting(Start::Multiples(Reference::Reading, &[0.03, 0.1, 0.3]))]
                }
            }
        }
    }

    fn rounds(&self) -> bool {
        matches!(self, Self::Quantization)
    }

    fn counts_episodes(&self) -> bool {
        matches!(self, Self::Trend)
    }

    fn sites(&self, plant: &Plant) -> Vec<String> {
        sensors(plant)
    }

    fn attach(&self, site: &Site<'_>) -> Result<Box<dyn Acting>> {
        let scalar = site.plant.layout.sensor(site.name)?.len == 1;
        let values = match self {
            Self::Bias | Self::Drift | Self::Trend => {
                let [alone, x, y, z] = values(site)?;
                let each = if scalar { [alone, 0.0, 0.0] } else { [x, y, z] };
                let times = match self {
                    Self::Trend => site.episode as f64,
                    _ => 1.0,
                };
                each.map(|value| value * times)
            }
            Self::Scale => {
                let [scale] = values(site)?;
                [scale; 3]
            }
            Self::Quantization => {
                let [step] = values(site)?;
                [at_least(site, "step", step, 0.0)?; 3]
            }
        };
        Ok(Box::new(ReadingAt { law: *self, values }))
    }
}
