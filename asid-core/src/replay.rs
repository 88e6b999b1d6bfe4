//! Replaying a log's commands in a simulator.
//!
//! A log whose rows lie on the physics grid is replayed frame by frame; any
//! other is replayed step by step and interpolated to the times of its rows.

use crate::episode::Episode;
use crate::error::Result;
use crate::layout::{Layout, Recording};
use crate::simulator::{Control, Rollout, Simulator};

/// A log prepared for replay.
#[derive(Clone, Debug)]
pub struct Replay {
    ctrl: Vec<f64>,
    frames: usize,
    substeps: usize,
    rows: usize,
    /// For each row, the earlier of the two recorded states (0 is the start) and how far
    /// beyond it the row lies; `None` where every row is a recorded state.
    between: Option<Vec<(usize, f64)>>,
    recording: Recording,
    quaternions: Vec<usize>,
    buffer: Vec<f64>,
}

impl Replay {
    /// Prepares `episode` for a scene; `channels` are what is predicted.
    ///
    /// # Errors
    /// When the scene has no such channel.
    pub fn new(layout: &Layout, episode: &Episode, channels: &[String]) -> Result<Self> {
        let recording = layout.recording(channels)?;
        let quaternions = channels
            .iter()
            .enumerate()
            .filter(|(_, name)| layout.sensor(name).is_ok_and(|s| s.len == 4))
            .map(|(i, _)| recording.range(i).start)
            .collect();
        let (nu, rows) = (layout.nu(), episode.rows());
        let start = episode.time[0];
        let dt = layout.timestep;
        let steps: Vec<f64> = episode.time.iter().map(|t| (t - start) / dt).collect();
        let stride = steps[1].round();
        // Within a thousandth of a step a row is on the grid: times are often rounded in logs.
        let regular = stride >= 1.0
            && steps
                .iter()
                .enumerate()
                .all(|(i, s)| (s - stride * i as f64).abs() < 1e-3);
        if regular {
            return Ok(Self {
                ctrl: episode.ctrl[..(rows - 1) * nu].to_vec(),
                frames: rows - 1,
                substeps: stride as usize,
                rows,
                between: None,
                recording,
                quaternions,
                buffer: Vec::new(),
            });
        }
        let frames = steps[rows - 1].ceil() as usize;
        let mut ctrl = Vec::with_capacity(frames * nu);
        let mut row = 0;
        for k in 0..frames {
            while row + 1 < rows && steps[row + 1] <= k as f64 + 1e-6 {
                row += 1;
            }
            ctrl.extend_from_slice(&episode.ctrl[row * nu..(row + 1) * nu]);
        }
        let between = steps
            .iter()
            .map(|s| {
                let earlier = (s.floor() as usize).min(frames - 1);
                (earlier, s - earlier as f64)
            })
            .collect();
        Ok(Self {
            ctrl,
            frames,
            substeps: 1,
            rows,
            between: Some(between),
            recording,
            quaternions,
            buffer: Vec::new(),
        })
    }

    /// Rows of the log.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Entries of a predicted row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.recording.width()
    }

    /// Physics steps of one replay.
    #[must_use]
    pub fn physics_steps(&self) -> usize {
        self.frames * self.substeps
    }

    /// Predicts all rows from the simulations' present states: `sims x rows x width`.
    ///
    /// # Errors
    /// As [`Simulator::rollout`].
    pub fn run(
        &mut self,
        simulator: &mut dyn Simulator,
        sims: &[usize],
        out: &mut [f64],
    ) -> Result<()> {
        let width = self.width();
        let states = self.frames + 1;
        let mut first = vec![0.0; sims.len() * width];
        simulator.read(sims, &self.recording, &mut first)?;
        self.buffer.resize(sims.len() * self.frames * width, 0.0);
        let rollout = Rollout::new(
            sims,
            self.frames,
            self.substeps,
            Control::Shared(&self.ctrl),
            &self.recording,
        );
        simulator.rollout(&rollout, &mut self.buffer)?;
        for i in 0..sims.len() {
            let state = |k: usize| -> &[f64] {
                if k == 0 {
                    &first[i * width..(i + 1) * width]
                } else {
                    &self.buffer[(i * self.frames + k - 1) * width..][..width]
                }
            };
            let rows = &mut out[i * self.rows * width..(i + 1) * self.rows * width];
            match &self.between {
                None => {
                    for (k, row) in rows.chunks_exact_mut(width).enumerate() {
                        debug_assert!(k < states);
                        row.copy_from_slice(state(k));
                    }
                }
                Some(between) => {
                    for (row, &(earlier, along)) in rows.chunks_exact_mut(width).zip(between) {
                        let (a, b) = (state(earlier), state(earlier + 1));
                        interpolate(a, b, along, &self.quaternions, row);
                    }
                }
            }
        }
        Ok(())
    }
}

/// Linear between `a` and `b`; quaternions (which start at `quaternions`) along
/// the shorter arc and normalised.
fn interpolate(a: &[f64], b: &[f64], along: f64, quaternions: &[usize], out: &mut [f64]) {
    for (o, (x, y)) in out.iter_mut().zip(a.iter().zip(b)) {
        *o = x + along * (y - x);
    }
    for &q in quaternions {
        let dot: f64 = (q..q + 4).map(|i| a[i] * b[i]).sum();
        let sign = if dot < 0.0 { -1.0 } else { 1.0 };
        for i in q..q + 4 {
            out[i] = a[i] + along * (sign * b[i] - a[i]);
        }
        let norm = (q..q + 4).map(|i| out[i] * out[i]).sum::<f64>().sqrt();
        for x in &mut out[q..q + 4] {
            *x /= norm;
        }
    }
}
