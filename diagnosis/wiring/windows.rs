//! Short predictions by the model as given, from states that the log itself shows: under a wrong view of the columns they
//! miss what the machine does next.
//!
//! A window begins at a state that is read off the log (positions by local parabolas, speeds by their slopes) and lasts long
//! enough for forces to show beyond the noise. Two things are measured for each quantity: how far the prediction is off,
//! and how far the quantity leaves the straight line on which it began, which is what a prediction is to tell. Windows at
//! the first row begin a second time at the state that the log gives there, where it does: this compares readings with it.

use asid_core::layout::Recording;
use asid_core::problem::home;
use asid_core::signal::{rotation_difference, unit_quaternion};
use asid_core::{BatchConfig, Control, Parameter, Result, Rollout, Simulator};
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use crate::machine::Machine;

use super::record::Recorded;
use super::view::{ColumnView, View};

/// Windows over all episodes: so many give the mean of a miss to a seventh.
pub const WINDOWS: usize = 48;
/// Windows over all episodes with which hypotheses are first looked at.
pub const FEW: usize = 12;
/// Physics steps of one evaluation at most, times degrees of freedom: beyond it there are fewer windows, so that some hundred
/// evaluations take about a second.
const BUDGET: usize = 60_000;
/// Fewest windows.
const FEWEST: usize = 6;
/// Durations of windows that are tried, the shortest first, s.
const DURATIONS: [f64; 4] = [0.1, 0.2, 0.4, 0.8];
/// Deviations of the prediction's noise by which a quantity has to leave its straight line for a window to be long enough.
const SHOWS: f64 = 8.0;
/// Frames of a window at most.
const FRAMES: f64 = 24.0;
/// Share of an episode that a window takes at most.
const SHARE: f64 = 0.3;
/// Share of a window before and after its start within which readings tell the state there. Larger: less noise of the state,
/// and more of the motion's bend in it.
const LOCAL: f64 = 0.25;
/// A prediction that is off by more than so many motions tells no more than that it is wrong.
const FARTHEST: f64 = 10.0;

/// A window: where it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Window {
    episode: usize,
    start: f64,
    /// Whether it begins at the state that the log gives.
    given: bool,
}

/// What predictions under a view miss.
#[derive(Clone, Debug)]
pub struct Misses {
    /// `reading - prediction`, `windows x frames x width`; NaN where nothing was read, infinite where the engine failed.
    pub residual: Vec<f64>,
    /// Mean distance of each quantity from its straight line, over the windows that begin at states read off the log.
    pub motion: Vec<f64>,
    /// Mean magnitude of each quantity's residual over those windows, in motions.
    pub miss: Vec<f64>,
    /// The same at given starts; 0 where there are none.
    pub start_miss: Vec<f64>,
}

/// Windows of some logs, and the simulations to predict them.
pub struct Windows<'a> {
    plant: &'a Plant,
    record: &'a [Recorded],
    simulator: Box<dyn Simulator>,
    recording: Recording,
    /// Those from states read off the log, then those at given starts.
    windows: Vec<Window>,
    /// Views of the commands, parameters, and what they predict from given starts, which no view of the readings changes.
    from_starts: Option<(Vec<ColumnView>, Vec<f64>, Vec<f64>)>,
    parameters: &'a [Parameter],
    /// Values of the parameters.
    theta: Vec<f64>,
    /// Names of the sensors, and where each begins in a row of readings.
    sensors: Vec<(usize, usize)>,
    duration: f64,
    frames: usize,
    substeps: usize,
    width: usize,
}

impl<'a> Windows<'a> {
    /// Places about `count` windows in logs; `None` where they are too short for any.
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
            .map(|p| Ok(model.nominal(&p.targets[0])?.clamp(p.range[0], p.range[1])))
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

    /// What would have to be added to a quantity so that it reads what the given starts say: the median over the episodes
    /// that give theirs.
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

    /// State at the start of a window under a view.
    fn state(&self, view: &View, window: Window) -> (Vec<f64>, Vec<f64>) {
        let layout = &self.plant.layout;
        let record = &self.record[window.episode];
        if let (true, Some(start)) = (window.given, &record.start) {
            return (start.qpos.clone(), start.qvel.clone());
        }
        let (mut qpos, mut qvel) = home(layout);
        let half = LOCAL * self.duration;
        let local = |entry: usize| record.local(view.readings[entry], window.start, half);
        let mut placed = vec![false; layout.nv];
        for &(index, first) in &self.sensors {
            match (self.plant.sensors[index], &*layout.sensors[index].kind) {
                (Reads::Joint(j), "jointpos") => {
                    if let Some((q, v)) = local(first) {
                        qpos[layout.joints[j].qpos] = q;
                        qvel[layout.joints[j].qvel] = v;
                        placed[layout.joints[j].qvel] = true;
                    }
                }
                (Reads::Body(b), "framepos") => {
                    let Some(j) = self.plant.free_joint(b) else {
                        continue;
                    };
                    for i in 0..3 {
                        if let Some((q, v)) = local(first + i) {
                            qpos[layout.joints[j].qpos + i] = q;
                            qvel[layout.joints[j].qvel + i] = v;
                        }
                    }
                }
                (Reads::Body(b), "framequat") => {
                    let Some(j) = self.plant.free_joint(b) else {
                        continue;
                    };
                    let at = |time: f64| -> Vec<f64> {
                        (0..4)
                            .map(|i| record.reading(view.readings[first + i], time, half))
                            .collect()
                    };
                    let here = at(window.start);
                    let (before, after) =
                        (at((window.start - half).max(0.0)), at(window.start + half));
                    if here
                        .iter()
                        .chain(&before)
                        .chain(&after)
                        .all(|x| x.is_finite())
                    {
                        let turn = unit_quaternion(&here);
                        let q = layout.joints[j].qpos + 3;
                        qpos[q..q + 4].copy_from_slice(&[turn.w, turn.i, turn.j, turn.k]);
                        let span = window.start + half - (window.start - half).max(0.0);
                        let way = nalgebra::Vector3::from(rotation_difference(&after, &before));
                        let own = turn.inverse() * way / span;
                        let v = layout.joints[j].qvel + 3;
                        qvel[v..v + 3].copy_from_slice(own.as_slice());
                    }
                }
                _ => {}
            }
        }
        // A speed that only a sensor of speed tells.
        for &(index, first) in &self.sensors {
            if let (Reads::Joint(j), "jointvel") =
                (self.plant.sensors[index], &*layout.sensors[index].kind)
                && !placed[layout.joints[j].qvel]
                && let Some((v, _)) = local(first)
            {
                qvel[layout.joints[j].qvel] = v;
            }
        }
        (qpos, qvel)
    }

    /// Number of windows that do not begin at given starts.
    fn free(&self) -> usize {
        self.windows.partition_point(|w| !w.given)
    }

    /// Readings that the model predicts in some windows under a view, `windows x (frames + 1) x width`.
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
            let (q, v) = self.state(view, window);
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

    /// What the model predicts from given starts.
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

    /// Predicts all windows under a view.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn misses(&mut self, view: &View) -> Result<Misses> {
        let mut told = self.predict(view, 0..self.free())?;
        told.extend(self.predict_from_starts(view)?);
        let residual = self.residuals(view, &told, 0);
        Ok(self.summed_up(view, residual))
    }

    /// Mean magnitude of each quantity's residual in windows at given starts, in motions; 0 where there are none. Costs no
    /// simulation where only readings are viewed another way.
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

    /// `reading - prediction` in the windows from one on.
    fn residuals(&self, view: &View, told: &[f64], first: usize) -> Vec<f64> {
        let (rows, width) = (self.frames + 1, self.width);
        let frame = self.duration / self.frames as f64;
        let mut residual = vec![f64::NAN; told.len()];
        for (i, window) in self.windows[first..].iter().enumerate() {
            let record = &self.record[window.episode];
            for k in 0..rows {
                let time = window.start + k as f64 * frame;
                let row = (i * rows + k) * width;
                let Some(told) = told.get(row..row + width) else {
                    continue;
                };
                let mut read: Vec<f64> = view
                    .readings
                    .iter()
                    .map(|v| record.reading(*v, time, 0.5 * self.duration))
                    .collect();
                self.nearer_signs(&mut read, told);
                let out = &mut residual[row..row + width];
                for ((miss, read), told) in out.iter_mut().zip(read).zip(told) {
                    if read.is_finite() {
                        *miss = if told.is_finite() {
                            read - told
                        } else {
                            f64::INFINITY
                        };
                    }
                }
            }
        }
        residual
    }

    /// The two signs of a quaternion are one orientation: the nearer one is compared.
    fn nearer_signs(&self, read: &mut [f64], told: &[f64]) {
        for &(index, at) in &self.sensors {
            if self.plant.layout.sensors[index].len != 4 {
                continue;
            }
            let (read, told) = (&mut read[at..at + 4], &told[at..at + 4]);
            if read.iter().zip(told).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
                read.iter_mut().for_each(|x| *x = -*x);
            }
        }
    }

    /// Means over the windows.
    fn summed_up(&self, view: &View, residual: Vec<f64>) -> Misses {
        let (rows, width) = (self.frames + 1, self.width);
        let frame = self.duration / self.frames as f64;
        let half = LOCAL * self.duration;
        let mut motion = vec![0.0; width];
        let (mut miss, mut start_miss) = (vec![0.0; width], vec![0.0; width]);
        for entry in 0..width {
            let view = view.readings[entry];
            let straight = self.is_place(entry);
            let of_window = |w: usize| -> Option<f64> {
                let own = (0..rows).map(|k| residual[(w * rows + k) * width + entry]);
                rms(own.filter(|r| !r.is_nan()))
            };
            let mut moved = Vec::new();
            for window in self.windows.iter().filter(|w| !w.given) {
                let record = &self.record[window.episode];
                let Some((value, slope)) = record.local(view, window.start, half) else {
                    continue;
                };
                let slope = if straight { slope } else { 0.0 };
                let away = (1..rows).map(|k| {
                    let s = k as f64 * frame;
                    record.reading(view, window.start + s, 0.5 * self.duration) - value - slope * s
                });
                moved.extend(rms(away.filter(|x| x.is_finite())));
            }
            motion[entry] = mean(&moved).unwrap_or(0.0).max(f64::MIN_POSITIVE);
            let of = |given: bool| -> f64 {
                let own = (0..self.windows.len()).filter(|&w| self.windows[w].given == given);
                let each: Vec<f64> = own
                    .filter_map(of_window)
                    .map(|r| (r / motion[entry]).min(FARTHEST))
                    .collect();
                mean(&each).unwrap_or(0.0)
            };
            miss[entry] = of(false);
            start_miss[entry] = of(true);
        }
        Misses {
            residual,
            motion,
            miss,
            start_miss,
        }
    }

    /// Whether a quantity is a place or an angle, which runs on along its slope, and no speed or force.
    fn is_place(&self, entry: usize) -> bool {
        let sensors = self.sensors.iter().rev();
        let found = sensors.clone().find(|(_, first)| *first <= entry);
        found.is_some_and(|(index, _)| {
            let kind = &*self.plant.layout.sensors[*index].kind;
            kind.ends_with("pos") || kind.ends_with("quat")
        })
    }
}

/// Root mean square; `None` of nothing.
fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for x in values {
        sum += x * x;
        count += 1.0;
    }
    (count > 0.0).then(|| (sum / count).sqrt())
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The shortest duration over which most quantities leave their straight lines by more than a prediction's noise.
fn duration(record: &[Recorded], width: usize, longest: f64) -> f64 {
    let fits = |d: f64| -> bool {
        let half = LOCAL * d;
        let mut shown = Vec::new();
        for entry in 0..width {
            let view = super::view::ColumnView::own(entry);
            let (mut moved, mut noise) = (Vec::new(), Vec::new());
            for r in record {
                let steps = ((r.seconds() / d) as usize).min(WINDOWS);
                for k in 1..steps.saturating_sub(1) {
                    let start = r.seconds() * k as f64 / steps as f64;
                    let Some((value, slope)) = r.local(view, start, half) else {
                        continue;
                    };
                    let read = |s: f64| r.reading(view, start + s, d);
                    moved.push((read(d) - value - slope * d).abs());
                    noise.push((read(0.0) - value).abs());
                }
            }
            moved.retain(|x| x.is_finite());
            noise.retain(|x| x.is_finite());
            let (Some(moved), Some(noise)) = (mean(&moved), mean(&noise)) else {
                continue;
            };
            shown.push(moved > SHOWS * noise);
        }
        2 * shown.iter().filter(|s| **s).count() > shown.len()
    };
    let possible = DURATIONS.iter().copied().filter(|d| *d <= longest);
    let mut last = DURATIONS[0].min(longest);
    for d in possible {
        last = d;
        if fits(d) {
            break;
        }
    }
    last
}

/// Windows spread evenly over the episodes, and one at each start that a log gives.
fn place(record: &[Recorded], duration: f64, count: usize) -> Vec<Window> {
    let each = count.div_ceil(record.len().max(1));
    let mut windows = Vec::new();
    for (episode, r) in record.iter().enumerate() {
        let room = r.seconds() - duration;
        if room <= 0.0 {
            continue;
        }
        // Readings that are late are looked for after their window.
        let room = (room - super::hypotheses::LATEST).max(0.5 * room);
        windows.extend((0..each).map(|k| Window {
            episode,
            start: room * (k as f64 + 0.5) / each as f64,
            given: false,
        }));
    }
    for (episode, r) in record.iter().enumerate() {
        if r.start.is_some() && r.seconds() > duration {
            windows.push(Window {
                episode,
                start: 0.0,
                given: true,
            });
        }
    }
    windows
}
