//! The rows of a log as a filter walks them.

use crate::data::Logs;

/// Rows of one episode that are at least one physics step apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// The episode of the logs.
    pub episode: usize,
    /// Rows of the log.
    pub rows: Vec<usize>,
    /// Their times from the first on, s.
    pub time: Vec<f64>,
    /// Physics steps from each row to the next, one fewer than rows.
    pub substeps: Vec<usize>,
    /// Commands held from each row to the next, `(rows - 1) x nu`.
    pub ctrl: Vec<f64>,
}

impl Walk {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Walks an episode of some logs at a physics time step (s). Times are rounded to whole steps from
    /// the first row on, so that no error adds up; a row that falls on the step of the one before is passed
    /// over.
    #[must_use]
    pub fn new(logs: &Logs, episode: usize, timestep: f64) -> Self {
        let log = &logs.episodes[episode];
        let times = &log.episode.time;
        let nu = log.episode.actuators.len();
        let step = |k: usize| ((times[k] - times[0]) / timestep).round() as usize;
        let mut rows = vec![0];
        let mut substeps = Vec::new();
        let mut ctrl = Vec::new();
        for k in 1..log.plan.rows() {
            let last = rows[rows.len() - 1];
            if step(k) > step(last) {
                substeps.push(step(k) - step(last));
                ctrl.extend_from_slice(&log.episode.ctrl[last * nu..(last + 1) * nu]);
                rows.push(k);
            }
        }
        Self {
            episode,
            time: rows.iter().map(|&k| times[k] - times[0]).collect(),
            rows,
            substeps,
            ctrl,
        }
    }

    /// Some of its rows, as a walk of their own.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let steps = range.start..range.end - 1;
        let nu = self.ctrl.len() / self.substeps.len().max(1);
        Self {
            episode: self.episode,
            rows: self.rows[range.clone()].to_vec(),
            time: self.time[range].to_vec(),
            substeps: self.substeps[steps.clone()].to_vec(),
            ctrl: self.ctrl[steps.start * nu..steps.end * nu].to_vec(),
        }
    }
}
