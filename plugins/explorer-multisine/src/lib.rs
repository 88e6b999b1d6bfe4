//! Multisine exploration: the classical input of system identification.
//!
//! Every entry of the action is a sum of sines with equal amplitudes and random phases. Their
//! frequencies are integer multiples of one over the episode's length. The sum is scaled so that
//! its peak is a share of the entry's range:
//!
//! `u(t) = center + amplitude / peak * half range * sum_k sin(2 pi k t / T + phase_k)`
//!
//! It excites a frequency band evenly and persistently (order twice the number of sines), knows
//! nothing of the task, and costs nothing. Of several draws of the phases it takes the one with the
//! smallest peak, so that the most power fits into the range. Source: Pintelon and Schoukens,
//! System Identification: A Frequency Domain Approach (2012), section 2.2.

use std::f64::consts::TAU;

use asid_core::explore::{Explored, Explorer, Policy};
use asid_core::rng::Rng;
use asid_core::task::{Coordinate, ExplorationProtocol};
use asid_core::{Error, Problem, Result, registry};
use rand::Rng as _;
use serde::{Deserialize, Serialize};

/// Settings: a section `[explorer]` of a configuration, with these defaults.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Multisine {
    /// Lowest frequency, in periods an episode.
    pub lowest: usize,
    /// Highest frequency, in periods an episode.
    pub highest: usize,
    /// Peak, as a share of half the action's range: above 0, at most 1.
    pub amplitude: f64,
    /// Draws of the phases.
    pub draws: usize,
}

impl Default for Multisine {
    fn default() -> Self {
        Self {
            lowest: 1,
            highest: 6,
            amplitude: 1.0,
            draws: 50,
        }
    }
}

asid_core::register!(ExplorerEntry {
    name: "multisine",
    about: "sums of sines with random phases",
    defaults: registry::defaults::<Multisine>,
    make: |settings| {
        let explorer: Multisine = registry::settings("explorer", settings)?;
        explorer.check()?;
        Ok(Box::new(explorer))
    },
});

asid_plugin::export_plugin!();

impl Multisine {
    fn check(&self) -> Result<()> {
        let wrong = |key: &str, message: String| Error::Config {
            key: format!("explorer.{key}"),
            message,
        };
        if self.lowest == 0 || self.lowest > self.highest {
            let message = format!("must be from 1 to explorer.highest, {}", self.highest);
            return Err(wrong("lowest", message));
        }
        if !(self.amplitude > 0.0 && self.amplitude <= 1.0) {
            return Err(wrong("amplitude", "must be above 0 and at most 1".into()));
        }
        if self.draws == 0 {
            return Err(wrong("draws", "must be at least 1".into()));
        }
        Ok(())
    }

    /// The actions of an episode, `horizon x action`, in the task's units.
    fn plan(&self, protocol: &ExplorationProtocol, rng: &mut Rng) -> Result<Vec<f64>> {
        let steps = protocol.horizon;
        // A sine with more periods than half the steps would alias to a slower one.
        if 2 * self.highest > steps {
            return Err(Error::Config {
                key: "explorer.highest".into(),
                message: format!("must be at most half of the task's {steps} control steps"),
            });
        }
        let signals: Vec<Vec<f64>> = protocol
            .action
            .iter()
            .map(|coordinate| self.signal(coordinate, steps, rng))
            .collect();
        Ok((0..steps)
            .flat_map(|step| signals.iter().map(move |signal| signal[step]))
            .collect())
    }

    /// One entry of the action over the episode.
    fn signal(&self, coordinate: &Coordinate, steps: usize, rng: &mut Rng) -> Vec<f64> {
        let mut best = (f64::INFINITY, Vec::new());
        for _ in 0..self.draws {
            let mut sum = vec![0.0; steps];
            for k in self.lowest..=self.highest {
                let phase = rng.random_range(0.0..TAU);
                for (step, x) in sum.iter_mut().enumerate() {
                    *x += (TAU * (k * step) as f64 / steps as f64 + phase).sin();
                }
            }
            let peak = sum.iter().fold(0.0, |peak: f64, x| peak.max(x.abs()));
            if peak < best.0 {
                best = (peak, sum);
            }
        }
        let (peak, sum) = best;
        let half_range = (coordinate.range[1] - coordinate.range[0]) / 2.0;
        let scale = self.amplitude * half_range / peak;
        sum.iter()
            .map(|x| coordinate.center() + scale * x)
            .collect()
    }
}

impl Explorer for Multisine {
    fn explore<'a>(
        &'a self,
        problem: &'a Problem<'a>,
        _start: Option<&[f64]>,
    ) -> Result<Explored<'a>> {
        let protocol = problem.task.exploration();
        let plan = self.plan(protocol, &mut problem.streams.stream("multisine"))?;
        Ok(Explored {
            policy: Box::new(OpenLoop {
                width: protocol.action.len(),
                plan,
            }),
            curve: Vec::new(),
            curve_label: "",
            objective: String::new(),
        })
    }
}

/// Plays a plan and ignores the readings.
struct OpenLoop {
    width: usize,
    plan: Vec<f64>,
}

impl Policy for OpenLoop {
    fn reset(&mut self) {}

    fn act(&mut self, step: usize, _reading: &[f64], action: &mut [f64]) -> Result<()> {
        action.copy_from_slice(&self.plan[step * self.width..][..self.width]);
        Ok(())
    }

    fn export(&self) -> serde_json::Value {
        let actions: Vec<&[f64]> = self.plan.chunks_exact(self.width).collect();
        serde_json::json!({"kind": "open-loop", "actions": actions})
    }
}

#[cfg(test)]
mod tests {
    use asid_core::Streams;

    use super::*;

    fn protocol() -> ExplorationProtocol {
        ExplorationProtocol {
            horizon: 20,
            frames_per_step: 1,
            frame_period: 0.1,
            action: vec![
                Coordinate::new("torque", "N m", [-0.5, 0.5]),
                Coordinate::new("speed", "m/s", [1.0, 2.0]),
            ],
            start: Vec::new(),
            signals: Vec::new(),
            proprioception: Vec::new(),
            contact: Vec::new(),
        }
    }

    /// Power of an entry at `k` periods per episode, relative to that of a sine with peak 1.
    fn power(plan: &[f64], entry: usize, k: usize) -> f64 {
        let (mut re, mut im) = (0.0, 0.0);
        for (step, row) in plan.chunks_exact(2).enumerate() {
            let angle = TAU * (k * step) as f64 / 20.0;
            re += row[entry] * angle.cos();
            im += row[entry] * angle.sin();
        }
        (re * re + im * im) / 100.0
    }

    #[test]
    fn power_is_even_within_the_band_and_zero_outside() {
        let explorer = Multisine {
            lowest: 2,
            ..Multisine::default()
        };
        let plan = explorer
            .plan(&protocol(), &mut Streams::new(1).stream("test"))
            .unwrap();
        for entry in 0..2 {
            let first = power(&plan, entry, 2);
            assert!(first > 0.005, "entry {entry}: power {first}");
            for k in 1..10 {
                let expected = if (2..=6).contains(&k) { first } else { 0.0 };
                let p = power(&plan, entry, k);
                assert!(
                    (p - expected).abs() < 1e-9,
                    "entry {entry}, {k} periods: {p}"
                );
            }
        }
    }

    #[test]
    fn the_range_is_used_and_kept() {
        let mut rng = Streams::new(2).stream("test");
        let plan = Multisine::default().plan(&protocol(), &mut rng).unwrap();
        for (entry, coordinate) in protocol().action.iter().enumerate() {
            let values = || plan.iter().skip(entry).step_by(2);
            let peak = values().fold(0.0, |peak: f64, x| {
                peak.max((x - coordinate.center()).abs())
            });
            assert!(
                (peak - 0.5).abs() < 1e-12,
                "{}: peak {peak}",
                coordinate.name
            );
        }
    }

    #[test]
    fn frequencies_beyond_half_the_steps_are_refused() {
        let explorer = Multisine {
            highest: 11,
            ..Multisine::default()
        };
        let error = explorer
            .plan(&protocol(), &mut Streams::new(0).stream("test"))
            .unwrap_err();
        assert!(error.to_string().contains("explorer.highest"), "{error}");
    }
}
