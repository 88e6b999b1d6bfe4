//! The likelihood of real episodes under a simulator.
//!
//! A point of the search space is `[z, s_1, s_2, …]`. `z` are the unknowns in prior-scaled
//! coordinates, without those held at a value. `s_k` is the start pose of episode `k`: an offset
//! from what its first reading shows, in standard deviations of that reading.
//!
//! The episode's commands are replayed from there. The difference from the readings, divided by
//! their noise, is the whitened residual. Systematic errors of the trackers are integrated out; see
//! [`asid_readings::systematic`].

use asid_core::problem::Batch;
use asid_core::tracker::TrackerPrior;
use asid_core::{Episode, Error, Parameter, Problem, Result};
use asid_readings::replay::Replay;
use asid_readings::{SignalSet, SystematicErrors};
use rand_distr::{Distribution, StandardNormal};

/// Largest offset of a start pose from its first reading, in standard deviations of that reading.
pub const START_BOUND: f64 = 6.0;

/// Number of draws that measure how the tracker's noise spreads the located start pose.
const LOCATE_DRAWS: usize = 256;

/// Standard deviation of the start pose that one reading of the tracked signals locates, by the
/// trackers' noise.
#[must_use]
pub fn start_deviation(problem: &Problem<'_>, signals: &SignalSet, reading: &[f64]) -> Vec<f64> {
    let start = problem.task.locate(reading);
    let mut rng = problem.streams.stream("locate");
    let mut squares = vec![0.0; start.len()];
    for _ in 0..LOCATE_DRAWS {
        let mut noisy = reading.to_vec();
        signals.add_noise(&mut noisy, || StandardNormal.sample(&mut rng));
        let located = problem.task.locate(&noisy);
        for (square, (a, b)) in squares.iter_mut().zip(located.iter().zip(&start)) {
            // Angles may jump by a full turn, which is no spread.
            let d = a - b;
            let turn = std::f64::consts::PI;
            let d = if d.abs() > turn {
                d - d.signum() * 2.0 * turn
            } else {
                d
            };
            *square += d * d;
        }
    }
    squares
        .iter()
        .map(|q| (q / LOCATE_DRAWS as f64).sqrt().max(1e-9))
        .collect()
}

struct Observed {
    replay: Replay,
    readings: Vec<f64>,
    /// Times of the rows, s, and whether each entry of a whitened difference is present.
    time: Vec<f64>,
    there: Vec<bool>,
    /// Start pose located by the first complete reading, and its standard deviation.
    start: Vec<f64>,
    start_std: Vec<f64>,
}

/// Likelihood of some episodes, evaluated for a whole population of points at once.
pub struct Likelihood<'a> {
    problem: &'a Problem<'a>,
    batch: Batch,
    size: usize,
    signals: SignalSet,
    tracker: TrackerPrior,
    episodes: Vec<Observed>,
    predicted: Vec<f64>,
    present: usize,
    /// Values of the unknowns that are held and not searched for.
    fixed: Vec<Option<f64>>,
}

impl<'a> Likelihood<'a> {
    /// Prepares the likelihood for populations of up to `size` points.
    ///
    /// # Errors
    /// When an episode has no complete reading of the tracked signals, or the engine
    /// cannot set an unknown.
    pub fn new(problem: &'a Problem<'a>, episodes: &[Episode], size: usize) -> Result<Self> {
        let layout = problem.model.layout();
        let scene = problem.task.scene();
        let signals = SignalSet::new(layout, problem.signals)?.with_angles_of(
            scene,
            layout,
            problem.signals,
        )?;
        let names: Vec<String> = problem.signals.iter().map(|s| s.sensor.clone()).collect();
        let width = signals.width();
        let mut observed = Vec::with_capacity(episodes.len());
        let mut present = 0;
        let mut whitened = vec![0.0; signals.whitened_len()];
        for episode in episodes {
            let readings = episode.select(layout, &names);
            let first = readings
                .chunks_exact(width)
                .find(|r| r.iter().all(|x| x.is_finite()))
                .ok_or_else(|| {
                    Error::Failed(format!(
                        "no row of the log has a reading of all of {}",
                        names.join(", ")
                    ))
                })?;
            let start = problem.task.locate(first);
            let start_std = start_deviation(problem, &signals, first);
            let mut there = Vec::new();
            for row in readings.chunks_exact(width) {
                signals.difference(row, row, &mut whitened);
                there.extend(whitened.iter().map(|x| x.is_finite()));
            }
            present += there.iter().filter(|x| **x).count();
            observed.push(Observed {
                replay: Replay::new(layout, episode, &names)?,
                readings,
                time: episode.time.clone(),
                there,
                start,
                start_std,
            });
        }
        Ok(Self {
            batch: problem.batch(size)?,
            size,
            tracker: TrackerPrior::NONE,
            signals,
            episodes: observed,
            predicted: Vec::new(),
            present,
            fixed: vec![None; problem.parameters.len()],
            problem,
        })
    }

    /// The same likelihood with systematic errors of the trackers integrated out.
    #[must_use]
    pub fn with_tracker(mut self, tracker: TrackerPrior) -> Self {
        self.tracker = tracker;
        self
    }

    /// Largest population that is simulated in one batch.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of episodes.
    #[must_use]
    pub fn episodes(&self) -> usize {
        self.episodes.len()
    }

    /// Holds some unknowns at a value; they are then no entries of a point.
    pub fn hold(&mut self, values: &[Option<f64>]) {
        self.fixed.copy_from_slice(values);
    }

    /// Number of unknowns that are entries of a point.
    #[must_use]
    pub fn sought(&self) -> usize {
        self.fixed.iter().filter(|f| f.is_none()).count()
    }

    /// Names of the unknowns that are entries of a point.
    #[must_use]
    pub fn names(&self) -> Vec<&'a str> {
        let unknowns = self.problem.parameters.iter().zip(&self.fixed);
        unknowns
            .filter(|(_, fixed)| fixed.is_none())
            .map(|(p, _)| p.name.as_str())
            .collect()
    }

    /// Number of entries of a point.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.sought() + self.episodes.iter().map(|e| e.start.len()).sum::<usize>()
    }

    /// Smallest and largest value of each entry.
    #[must_use]
    pub fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        let d = self.sought();
        let high: Vec<f64> = (0..self.dimension())
            .map(|i| {
                if i < d {
                    Parameter::scaled_bound()
                } else {
                    START_BOUND
                }
            })
            .collect();
        (high.iter().map(|x| -x).collect(), high)
    }

    /// Number of reading entries that are present.
    #[must_use]
    pub fn present(&self) -> usize {
        self.present
    }

    /// The unknowns at a point, in their units.
    #[must_use]
    pub fn parameters(&self, point: &[f64]) -> Vec<f64> {
        let mut free = point.iter();
        self.problem
            .parameters
            .iter()
            .zip(&self.fixed)
            .filter_map(|(p, fixed)| fixed.or_else(|| free.next().map(|z| p.from_scaled(*z))))
            .collect()
    }

    /// The start pose of episode `k` at a point, in the task's coordinates.
    #[must_use]
    pub fn start(&self, point: &[f64], k: usize) -> Vec<f64> {
        let before: usize = self.episodes[..k].iter().map(|e| e.start.len()).sum();
        let from = self.sought() + before;
        let e = &self.episodes[k];
        e.start
            .iter()
            .zip(&e.start_std)
            .zip(&point[from..])
            .map(|((x, s), offset)| x + s * offset)
            .collect()
    }

    /// Whitened residuals (predicted minus observed) of all episodes at each point; `None` where a
    /// simulation diverged.
    ///
    /// There is one residual per reading entry, zero where the reading is missing.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn residuals(&mut self, points: &[Vec<f64>]) -> Result<Vec<Option<Vec<f64>>>> {
        let len = self.signals.whitened_len();
        let mut all: Vec<Option<Vec<f64>>> = vec![Some(Vec::new()); points.len()];
        let mut whitened = vec![0.0; len];
        for first in (0..points.len()).step_by(self.size) {
            let chunk = &points[first..(first + self.size).min(points.len())];
            for k in 0..self.episodes.len() {
                self.predict(chunk, k)?;
                let observed = &self.episodes[k];
                let (rows, width) = (observed.replay.rows(), observed.replay.width());
                for (i, out) in all[first..first + chunk.len()].iter_mut().enumerate() {
                    let predicted = &self.predicted[i * rows * width..(i + 1) * rows * width];
                    if predicted.iter().any(|x| !x.is_finite()) {
                        *out = None;
                    }
                    let Some(out) = out else { continue };
                    out.reserve(rows * len);
                    for (p, o) in predicted
                        .chunks_exact(width)
                        .zip(observed.readings.chunks_exact(width))
                    {
                        self.signals.difference(p, o, &mut whitened);
                        out.extend(
                            whitened
                                .iter()
                                .map(|x| if x.is_finite() { *x } else { 0.0 }),
                        );
                    }
                    let systematic = SystematicErrors::at(
                        self.tracker,
                        &self.signals,
                        &observed.time,
                        predicted,
                    );
                    let from = out.len() - rows * len;
                    systematic.whiten(&observed.there, &mut out[from..]);
                }
            }
        }
        Ok(all)
    }

    /// Predicted readings of episode `k` at one point, `rows x width`.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn prediction(&mut self, point: &[f64], k: usize) -> Result<Vec<f64>> {
        self.predict(&[point.to_vec()], k)?;
        let replay = &self.episodes[k].replay;
        Ok(self.predicted[..replay.rows() * replay.width()].to_vec())
    }

    fn predict(&mut self, points: &[Vec<f64>], k: usize) -> Result<()> {
        let sims: Vec<usize> = (0..points.len()).collect();
        let theta: Vec<f64> = points.iter().flat_map(|p| self.parameters(p)).collect();
        let starts: Vec<f64> = points.iter().flat_map(|p| self.start(p, k)).collect();
        self.batch.set_parameters(&sims, &theta)?;
        self.batch.place(self.problem.task, &sims, &starts)?;
        let replay = &mut self.episodes[k].replay;
        self.predicted
            .resize(points.len() * replay.rows() * replay.width(), 0.0);
        let before = self.batch.simulator.steps_taken();
        replay.run(&mut *self.batch.simulator, &sims, &mut self.predicted)?;
        self.problem.count_physics(&self.batch, before);
        Ok(())
    }
}
