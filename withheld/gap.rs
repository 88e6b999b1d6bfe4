//! The excess gap: how far a world is from the study's model.
//!
//! The excess gap is the root mean square difference between a world's readings without noise and
//! those of the study's model. It runs over all readings of all episodes; each difference is in
//! units of its sensor's noise. The study's parameters are *refitted* first, so what a parameter
//! absorbs is no gap. The model runs at the world's own time step here, so that the gap is one of
//! physics and not of integration. The gap of integration is measured separately. With white noise
//! the gap that a diagnosis sees is `sqrt(1 + excess²)`.

use nalgebra::{DMatrix, DVector};

use crate::anatomy::{Anatomy, Sensor};
use crate::error::Result;
use crate::motion::Motion;
use crate::simulate::{Record, Typical, simulate};
use crate::world::World;

/// Step of a finite difference, as a share of a parameter's range.
const STEP: f64 = 0.01;
/// Gauss-Newton iterations of the refit by replays; the Jacobian is computed once.
const ROUNDS: usize = 3;
/// The refit ends after an iteration that reduces the gap by less than this share.
const ENOUGH: f64 = 0.02;

/// The episodes of a case, and the machine's readings in them without a cause.
pub struct Bench<'a> {
    /// The machine.
    pub anatomy: &'a Anatomy,
    /// True values of the study's parameters.
    pub truth: Vec<f64>,
    /// The episodes.
    pub motions: &'a [Motion],
    /// Time step of the world, s.
    pub timestep: f64,
    /// Integrator of the world, or [`crate::engine::RAPIER`].
    pub integrator: &'static str,
    /// Readings without a cause, in units of the noise.
    pub clean: Vec<f64>,
    /// Typical motion and forces of the machine without a cause.
    pub typical: Typical,
    /// QR decomposition of the Jacobian of the readings with respect to the parameters: Q and R.
    basis: Option<(DMatrix<f64>, DMatrix<f64>)>,
}

/// Result of a refit.
#[derive(Clone, Debug)]
pub struct Refit {
    /// Values of the parameters.
    pub values: Vec<f64>,
    /// Excess gap at these values.
    pub excess: f64,
    /// Residual of each reading, in units of the noise.
    pub residual: Vec<f64>,
}

impl<'a> Bench<'a> {
    /// Runs the machine without a cause, and once more for each parameter.
    ///
    /// # Errors
    /// If a simulation fails.
    pub fn new(
        anatomy: &'a Anatomy,
        truth: &[f64],
        motions: &'a [Motion],
        timestep: f64,
        integrator: &'static str,
    ) -> Result<Self> {
        let mut bench = Self {
            anatomy,
            truth: truth.to_vec(),
            motions,
            timestep,
            integrator,
            clean: Vec::new(),
            typical: Typical::default(),
            basis: None,
        };
        let record = simulate(anatomy, &mut bench.world(truth)?, motions)?;
        bench.clean = bench.rows(&record, &[]);
        bench.typical = record.typical;
        if truth.is_empty() {
            return Ok(bench);
        }
        let mut jacobian = DMatrix::zeros(bench.clean.len(), truth.len());
        for (i, parameter) in anatomy.machine.parameters.iter().enumerate() {
            let step = STEP * (parameter.range[1] - parameter.range[0]);
            let mut values = truth.to_vec();
            values[i] += step;
            let moved = bench.run(&mut bench.world(&values)?)?;
            for ((to, a), b) in jacobian
                .column_mut(i)
                .iter_mut()
                .zip(&moved)
                .zip(&bench.clean)
            {
                *to = (a - b) / step;
            }
        }
        let qr = jacobian.qr();
        bench.basis = Some((qr.q(), qr.r()));
        Ok(bench)
    }

    /// The machine without a cause, at these parameter values.
    ///
    /// # Errors
    /// If a parameter's target is not in the model.
    pub fn world(&self, values: &[f64]) -> Result<World> {
        World::new(self.anatomy, values, self.timestep, self.integrator)
    }

    /// Readings of a world at all rows, in units of the noise.
    ///
    /// # Errors
    /// If the simulation fails.
    pub fn run(&self, world: &mut World) -> Result<Vec<f64>> {
        let record = simulate(self.anatomy, world, self.motions)?;
        Ok(self.rows(&record, &world.steps))
    }

    /// Readings of a record at the rows of its episodes, in units of the noise.
    ///
    /// The record may hold only the first episodes.
    #[must_use]
    pub fn rows(&self, record: &Record, steps: &[(usize, f64)]) -> Vec<f64> {
        let mut rows = Vec::new();
        let episodes = self.motions.iter().take(record.episodes.len());
        for (episode, motion) in episodes.enumerate() {
            for row in 0..motion.rows {
                let time = row as f64 * motion.period;
                for sensor in &self.anatomy.sensors {
                    for column in sensor.address..sensor.address + sensor.len {
                        let value = in_steps(record.at(episode, time, column), column, steps);
                        rows.push(value / sensor.noise);
                    }
                }
            }
        }
        rows
    }

    /// Root mean square difference of two runs.
    #[must_use]
    pub fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let sum: f64 = a.iter().zip(b).map(|(x, y)| (x - y).powi(2)).sum();
        (sum / a.len().max(1) as f64).sqrt()
    }

    /// Excess gap of readings after a linear refit: the span of the Jacobian's columns is projected
    /// out.
    #[must_use]
    pub fn excess(&self, readings: &[f64]) -> f64 {
        let difference = self.difference(readings);
        let mut square = difference.norm_squared();
        if let Some((q, _)) = &self.basis {
            square -= (q.transpose() * difference).norm_squared();
        }
        (square.max(0.0) / readings.len().max(1) as f64).sqrt()
    }

    fn difference(&self, readings: &[f64]) -> DVector<f64> {
        let pairs = readings.iter().zip(&self.clean);
        DVector::from_iterator(readings.len(), pairs.map(|(a, b)| a - b))
    }

    /// Excess gap of readings after a refit by replays, within the parameters' ranges.
    ///
    /// # Errors
    /// If a simulation fails.
    pub fn refit(&self, readings: &[f64]) -> Result<Refit> {
        let mut best = Refit {
            values: self.truth.clone(),
            excess: self.distance(readings, &self.clean),
            residual: self.difference(readings).as_slice().to_vec(),
        };
        let Some((q, r)) = &self.basis else {
            return Ok(best);
        };
        let mut residual = self.difference(readings);
        for _ in 0..ROUNDS {
            let Some(step) = r.solve_upper_triangular(&(q.transpose() * &residual)) else {
                break;
            };
            let before = best.excess;
            // A step that increases the gap is halved up to twice, then dropped.
            for shrink in [1.0, 0.5, 0.25] {
                let parameters = self.anatomy.machine.parameters.iter();
                let values: Vec<f64> = parameters
                    .zip(best.values.iter().zip(step.iter()))
                    .map(|(p, (v, s))| (v + shrink * s).clamp(p.range[0], p.range[1]))
                    .collect();
                let Ok(model) = self.run(&mut self.world(&values)?) else {
                    continue;
                };
                let excess = self.distance(readings, &model);
                if excess < best.excess {
                    let pairs = readings.iter().zip(&model);
                    best = Refit {
                        values,
                        excess,
                        residual: pairs.map(|(a, b)| a - b).collect(),
                    };
                    residual = DVector::from_column_slice(&best.residual);
                    break;
                }
            }
            if best.excess > (1.0 - ENOUGH) * before {
                break;
            }
        }
        Ok(best)
    }
}

impl Refit {
    /// Share of the squared excess in each column of a log.
    #[must_use]
    pub fn shares(&self, anatomy: &Anatomy) -> Vec<(String, f64)> {
        let columns: Vec<String> = anatomy.sensors.iter().flat_map(Sensor::columns).collect();
        let mut shares = vec![0.0; columns.len()];
        for (i, x) in self.residual.iter().enumerate() {
            shares[i % columns.len()] += x * x;
        }
        let sum: f64 = shares.iter().sum();
        let all = columns.into_iter().zip(shares);
        all.map(|(name, s)| (name, s / sum.max(f64::MIN_POSITIVE)))
            .collect()
    }
}

/// Rounds a reading to its sensor's quantisation step, if the sensor has one.
#[must_use]
pub fn in_steps(value: f64, column: usize, steps: &[(usize, f64)]) -> f64 {
    let mut all = steps.iter();
    match all.find(|(c, _)| *c == column) {
        Some((_, step)) if *step > 0.0 => (value / step).round() * step,
        _ => value,
    }
}
