//! Short predictions by the model as given, from states read off the log: under a wrong view they
//! miss the motion.
//!
//! A window begins at a state that is read off the log: positions from local parabolas, speeds from
//! their derivatives. It lasts long enough for forces to exceed the noise. Each quantity has two
//! measures. The miss is the distance of the prediction from the readings. The motion is the
//! distance of the quantity from its initial straight line, which is what a prediction must
//! explain. Where a log gives its initial state, a second window at the first row begins there:
//! this compares the readings with that state.

mod initial_state;
mod misses;
mod placement;

use asid_core::layout::Recording;
use asid_core::problem::home;
use asid_core::{BatchConfig, Control, Parameter, Result, Rollout, Simulator};
use asid_mjcf::Plant;

use crate::machine::Machine;

use super::hypotheses::LATEST;
use super::record::Recorded;
use super::view::{ColumnView, View};

pub use misses::Misses;
use placement::{Window, duration, place};

/// Windows over all episodes: this many give the mean of a miss to a seventh.
pub const WINDOWS: usize = 48;
/// Windows over all episodes in the first evaluation of hypotheses.
pub const FEW: usize = 12;
/// Largest number of physics steps of one evaluation, times degrees of freedom.
///
/// Beyond it there are fewer windows, so that some hundred evaluations take about a second.
const BUDGET: usize = 60_000;
/// Fewest windows, however expensive each is.
const FEWEST: usize = 6;
/// Largest number of frames of a window.
const FRAMES: f64 = 24.0;
/// Largest share of an episode that a window covers.
const SHARE: f64 = 0.3;
/// Readings within this share of a window, before and after its start, determine the state there.
///
/// Larger: less noise in the state, and more of the motion's curvature.
const LOCAL: f64 = 0.25;

/// Windows of some logs, and the simulations that predict them.
pub struct Windows<'a> {
    plant: &'a Plant,
    record: &'a [Recorded],
    simulator: Box<dyn Simulator>,
    recording: Recording,
    /// First those from states read off the log, then those at given initial states.
    windows: Vec<Window>,
    /// Views of the commands, parameter values, and the predictions from given initial states with
    /// them. No view of the readings changes these.
    from_starts: Option<(Vec<ColumnView>, Vec<f64>, Vec<f64>)>,
    parameters: &'a [Parameter],
    /// Values of the parameters.
    theta: Vec<f64>,
    /// Index of each sensor in the layout, and of its first entry in a row of readings.
    sensors: Vec<(usize, usize)>,
    duration: f64,
    frames: usize,
    substeps: usize,
    width: usize,
}

impl<'a> Windows<'a> {
    /// Places about `count` windows in the logs; returns `None` if the logs are too short for any.
    ///
    /// # Errors
    /// When the engine refuses a batch.
    pub fn new(
        machine: &'a Machine,
        record: &'a [Recorded],
        (sensors, parameters): (&[String], &'a [Parameter]),
        count: usize,
    ) -> Result<Option<Self>> {
        let plant = &*machine.plant;
        let layout = &plant.layout;
        let recording = layout.recording(sensors)?;
        let width = recording.width();
        let mut places = Vec::new();
        for (i, name) in sensors.iter().enumerate() {
            let index = layout.sensors.iter().position(|s| s.name == *name);
            places.extend(index.map(|index| (index, recording.range(i).start)));
        }
        let longest = record.iter().map(Recorded::seconds).fold(0.0, f64::max);
        let duration = duration(record, width, SHARE * longest);
        let row_time = record
            .iter()
            .map(|r| r.seconds() / (r.time.len() - 1).max(1) as f64)
            .fold(0.0, f64::max);
        let frame = row_time.max(duration / FRAMES).min(duration);
        let substeps = (frame / layout.timestep).round().max(1.0) as usize;
        let frames = (duration / (substeps as f64 * layout.timestep))
            .round()
            .max(1.0) as usize;
        let duration = frames as f64 * substeps as f64 * layout.timestep;
        let steps = frames * substeps * layout.nv.max(1);
        let count = count.min((BUDGET * count / WINDOWS / steps).max(FEWEST));
        let windows = place(record, duration, count);
        if windows.is_empty() {
            return Ok(None);
        }
        let model = machine.with(&[])?;
        let theta = parameters
            .iter()
            .map(|p| Ok(p.value_of(model.nominal(&p.targets[0])?)))
            .collect::<Result<_>>()?;
        let simulator = model.simulator(&BatchConfig {
            size: windows.len(),
            threads: machine.threads,
            targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
        })?;
        Ok(Some(Self {
            plant,
            record,
            simulator,
            recording,
            windows,
            from_starts: None,
            parameters,
            theta,
            sensors: places,
            duration,
            frames,
            substeps,
            width,
        }))
    }

    /// Largest delay at which every window still has readings, s.
    #[must_use]
    pub fn latest(&self) -> f64 {
        let behind = |w: &Window| self.record[w.episode].seconds() - w.start - self.duration;
        self.windows.iter().map(behind).fold(LATEST, f64::min)
    }

    /// Ranges of the study's parameters.
    #[must_use]
    pub fn ranges(&self) -> Vec<[f64; 2]> {
        self.parameters.iter().map(|p| p.range).collect()
    }

    /// Values of the study's parameters: at first those of the model as given.
    #[must_use]
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Sets the values of the study's parameters.
    pub fn set_theta(&mut self, theta: &[f64]) {
        self.theta = theta.to_vec();
    }

    /// Shift that makes a quantity's first readings equal the given initial states.
    ///
    /// It is the median over the episodes that give their initial state.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn start_shift(&mut self, view: &View, entry: usize) -> Result<Option<f64>> {
        let told = self.predict_from_starts(view)?;
        let residual = self.residuals(view, &told, self.free());
        let window = (self.frames + 1) * self.width;
        let firsts = residual.chunks_exact(window).map(|w| -w[entry]);
        let mut firsts: Vec<f64> = firsts.filter(|x| x.is_finite()).collect();
        Ok(crate::noise::median(&mut firsts))
    }
    /// Number of windows that do not begin at given initial states.
    fn free(&self) -> usize {
        self.windows.partition_point(|w| !w.given)
    }

    /// Predicts the readings in some windows under a view, `windows x (frames + 1) x width`.
    fn predict(&mut self, view: &View, range: std::ops::Range<usize>) -> Result<Vec<f64>> {
        let (nu, width) = (view.commands.len(), self.width);
        let frame = self.duration / self.frames as f64;
        let sims: Vec<usize> = range.collect();
        let n = sims.len();
        if n == 0 {
            return Ok(Vec::new());
        }
        let (mut qpos, mut qvel) = (Vec::new(), Vec::new());
        let mut control = Vec::with_capacity(n * self.frames * nu);
        for window in sims.iter().map(|&w| self.windows[w]) {
            let (mut q, mut v) = self.state(view, window);
            if q.iter().chain(&v).any(|x| !x.is_finite()) {
                // No state of the machine is read here: the prediction from home misses it.
                (q, v) = home(&self.plant.layout);
            }
            qpos.extend(q);
            qvel.extend(v);
            let record = &self.record[window.episode];
            for k in 0..self.frames {
                let from = window.start + k as f64 * frame;
                control.extend(record.commands(view, from, from + frame));
            }
        }
        self.simulator.reset(&sims)?;
        let columns: Vec<f64> = (self.parameters.iter().zip(&self.theta))
            .flat_map(|(p, &x)| std::iter::repeat_n(p.setting(x), p.targets.len()))
            .collect();
        self.simulator.set_parameters(&sims, &columns.repeat(n))?;
        self.simulator.set_state(&sims, &qpos, &qvel)?;
        let mut first = vec![0.0; n * width];
        self.simulator.read(&sims, &self.recording, &mut first)?;
        let later = self.frames * width;
        let mut told = vec![0.0; n * later];
        let rollout = Rollout::new(
            &sims,
            self.frames,
            self.substeps,
            Control::PerSimulation(&control),
            &self.recording,
        );
        self.simulator.rollout(&rollout, &mut told)?;
        let pairs = first.chunks_exact(width).zip(told.chunks_exact(later));
        Ok(pairs
            .flat_map(|(a, b)| a.iter().chain(b))
            .copied()
            .collect())
    }

    /// Predicts the readings from given initial states.
    fn predict_from_starts(&mut self, view: &View) -> Result<Vec<f64>> {
        if let Some((commands, theta, told)) = &self.from_starts
            && *commands == view.commands
            && *theta == self.theta
        {
            return Ok(told.clone());
        }
        let told = self.predict(view, self.free()..self.windows.len())?;
        self.from_starts = Some((view.commands.clone(), self.theta.clone(), told.clone()));
        Ok(told)
    }

    /// Predicts all windows under a view, and returns what the predictions miss.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn misses(&mut self, view: &View) -> Result<Misses> {
        let mut told = self.predict(view, 0..self.free())?;
        told.extend(self.predict_from_starts(view)?);
        let residual = self.residuals(view, &told, 0);
        Ok(self.summed_up(view, residual))
    }

    /// Mean magnitude of each quantity's residual in windows at given initial states, in motions; 0
    /// if there are none.
    ///
    /// Costs no simulation if only the views of readings differ.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn start_misses(&mut self, view: &View) -> Result<Vec<f64>> {
        let told = self.predict_from_starts(view)?;
        let free = self.free();
        let own = self.residuals(view, &told, free);
        let missing = free * (self.frames + 1) * self.width;
        let residual = [vec![f64::NAN; missing], own].concat();
        Ok(self.summed_up(view, residual).start_miss)
    }
}
