//! Replaying a log's commands in a simulator.
//!
//! A log whose rows lie on the physics grid is replayed frame by frame; any
//! other is replayed step by step and interpolated to the times of its rows.

use asid_core::layout::JointKind;
use asid_core::{Control, Episode, Layout, Recording, Result, Rollout, Simulator};

/// How a log's commands are replayed, and how its rows are interpolated from the recorded states.
#[derive(Clone, Debug)]
pub struct ReplayPlan {
    /// Commands, `frames x nu`.
    pub ctrl: Vec<f64>,
    /// Frames of the rollout.
    pub frames: usize,
    /// Physics steps per frame.
    pub substeps: usize,
    rows: usize,
    /// For each row, the earlier of the two recorded states (0 is the initial state) and the
    /// fraction of a step by which the row is later; `None` if every row is a recorded state.
    between: Option<Vec<(usize, f64)>>,
}

impl ReplayPlan {
    /// Plans the replay of the first `rows` rows (at least two) of `episode`.
    #[must_use]
    pub fn new(layout: &Layout, episode: &Episode, rows: usize) -> Self {
        let nu = layout.nu();
        let rows = rows.clamp(2, episode.rows());
        let start = episode.time[0];
        let dt = layout.timestep;
        let steps: Vec<f64> = episode.time[..rows]
            .iter()
            .map(|t| (t - start) / dt)
            .collect();
        let stride = steps[1].round();
        // A row within a thousandth of a step counts as on the grid: logs often round times.
        let regular = stride >= 1.0
            && steps
                .iter()
                .enumerate()
                .all(|(i, s)| (s - stride * i as f64).abs() < 1e-3);
        if regular {
            return Self {
                ctrl: episode.ctrl[..(rows - 1) * nu].to_vec(),
                frames: rows - 1,
                substeps: stride as usize,
                rows,
                between: None,
            };
        }
        let frames = (steps[rows - 1].ceil() as usize).max(1);
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
        Self {
            ctrl,
            frames,
            substeps: 1,
            rows,
            between: Some(between),
        }
    }

    /// Number of rows of the log that are replayed.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of physics steps of one replay.
    #[must_use]
    pub fn physics_steps(&self) -> usize {
        self.frames * self.substeps
    }

    /// Computes the log's rows from what was recorded.
    ///
    /// `first` is the initial state (`width`), `recorded` the states at the ends of the frames
    /// (`frames x width`). `quaternions` are the indices of quaternions in a row, and `out` is
    /// `rows x width`.
    pub fn resample(
        &self,
        first: &[f64],
        recorded: &[f64],
        quaternions: &[usize],
        out: &mut [f64],
    ) {
        let width = first.len();
        let state = |k: usize| -> &[f64] {
            match k {
                0 => first,
                _ => &recorded[(k - 1) * width..k * width],
            }
        };
        for (k, row) in out.chunks_exact_mut(width.max(1)).enumerate() {
            match &self.between {
                None => row.copy_from_slice(state(k)),
                Some(between) => {
                    let (earlier, along) = between[k];
                    interpolate(state(earlier), state(earlier + 1), along, quaternions, row);
                }
            }
        }
    }
}

/// Indices of the quaternions in a row of some sensors and joint positions.
#[must_use]
pub fn quaternions(layout: &Layout, recording: &Recording, channels: &[String]) -> Vec<usize> {
    channels
        .iter()
        .enumerate()
        .filter_map(|(i, name)| {
            let within = match name.strip_prefix("qpos.") {
                Some(joint) => match layout.joint(joint).ok()?.kind {
                    JointKind::Free => 3,
                    JointKind::Ball => 0,
                    JointKind::Hinge | JointKind::Slide => return None,
                },
                None => layout.sensor(name).ok().filter(|s| s.len == 4).map(|_| 0)?,
            };
            Some(recording.range(i).start + within)
        })
        .collect()
}

/// A log prepared for replay.
#[derive(Clone, Debug)]
pub struct Replay {
    plan: ReplayPlan,
    recording: Recording,
    quaternions: Vec<usize>,
    buffer: Vec<f64>,
}

impl Replay {
    /// Prepares `episode` for a scene; `channels` are the predicted ones.
    ///
    /// # Errors
    /// When the scene has no such channel.
    pub fn new(layout: &Layout, episode: &Episode, channels: &[String]) -> Result<Self> {
        let recording = layout.recording(channels)?;
        Ok(Self {
            plan: ReplayPlan::new(layout, episode, episode.rows()),
            quaternions: quaternions(layout, &recording, channels),
            recording,
            buffer: Vec::new(),
        })
    }

    /// Number of rows of the log.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.plan.rows
    }

    /// Number of entries of a predicted row.
    #[must_use]
    pub fn width(&self) -> usize {
        self.recording.width()
    }

    /// Number of physics steps of one replay.
    #[must_use]
    pub fn physics_steps(&self) -> usize {
        self.plan.physics_steps()
    }

    /// Memory for recording and predicting one replay, bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let rows = self.plan.frames + self.plan.rows;
        rows * self.width() * size_of::<f64>()
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
        let (width, plan) = (self.width(), &self.plan);
        let mut first = vec![0.0; sims.len() * width];
        simulator.read(sims, &self.recording, &mut first)?;
        self.buffer.resize(sims.len() * plan.frames * width, 0.0);
        let rollout = Rollout::new(
            sims,
            plan.frames,
            plan.substeps,
            Control::Shared(&plan.ctrl),
            &self.recording,
        );
        simulator.rollout(&rollout, &mut self.buffer)?;
        let recorded = plan.frames * width;
        for i in 0..sims.len() {
            plan.resample(
                &first[i * width..(i + 1) * width],
                &self.buffer[i * recorded..(i + 1) * recorded],
                &self.quaternions,
                &mut out[i * plan.rows * width..(i + 1) * plan.rows * width],
            );
        }
        Ok(())
    }
}

/// Interpolates linearly between `a` and `b`; quaternions, which begin at `quaternions`, along the
/// shorter arc and normalised.
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
