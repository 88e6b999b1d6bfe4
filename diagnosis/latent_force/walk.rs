//! The rows of a log that the filter processes.

use crate::data::Logs;

/// Shortest row, s. Over a shorter one no force moves a body by as much as a sensor resolves, and
/// machines of this size hardly move faster.
pub const FINEST: f64 = 0.004;

/// Rows of one episode, at least [`FINEST`] and one physics step apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// Index of the episode in the logs.
    pub episode: usize,
    /// Indices of the rows in the log.
    pub rows: Vec<usize>,
    /// Times of the rows from the first one on, s.
    pub time: Vec<f64>,
    /// Physics steps from each row to the next, one fewer than rows.
    pub substeps: Vec<usize>,
    /// Commands held from each row to the next, `(rows - 1) x nu`.
    pub ctrl: Vec<f64>,
    /// For a segment that is replayed from its first row: the number of leading rows that do not
    /// count. `None` for rows along which a force may be missing.
    pub segment: Option<usize>,
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

    /// Selects the rows of an episode at a physics time step (s).
    ///
    /// Times are rounded to whole steps from the first row on, so that rounding errors do not add
    /// up. A row is skipped if it falls on the step of the row before, or follows it sooner than
    /// [`FINEST`]. The command between two rows is the mean of the commands sent.
    #[must_use]
    pub fn new(logs: &Logs, episode: usize, timestep: f64) -> Self {
        let log = &logs.episodes[episode];
        let times = &log.episode.time;
        let nu = log.episode.actuators.len();
        let step = |k: usize| ((times[k] - times[0]) / timestep).round() as usize;
        let least = ((FINEST / timestep).round() as usize).max(1);
        let mut rows = vec![0];
        let mut substeps = Vec::new();
        let mut ctrl = Vec::new();
        for k in 1..log.plan.rows() {
            let last = rows[rows.len() - 1];
            if step(k) >= step(last) + least {
                substeps.push(step(k) - step(last));
                for a in 0..nu {
                    let sent = |r: usize| log.episode.ctrl[r * nu + a] * (times[r + 1] - times[r]);
                    let sum: f64 = (last..k).map(sent).sum();
                    ctrl.push(sum / (times[k] - times[last]));
                }
                rows.push(k);
            }
        }
        Self {
            episode,
            time: rows.iter().map(|&k| times[k] - times[0]).collect(),
            rows,
            substeps,
            ctrl,
            segment: None,
        }
    }

    /// The same rows at half the physics time step.
    #[must_use]
    pub fn halved(&self) -> Self {
        Self {
            substeps: self.substeps.iter().map(|n| 2 * n).collect(),
            ..self.clone()
        }
    }

    /// Some of the rows, as a walk of their own.
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
            segment: None,
        }
    }
}

/// Groups walks by the physics steps from row `k` to the next.
///
/// Only walks of `here` that continue beyond row `k` are included. An engine steps all simulations
/// of a call by the same number of steps.
#[must_use]
pub fn by_substeps(walks: &[&Walk], here: Vec<usize>, k: usize) -> Vec<(usize, Vec<usize>)> {
    let mut groups: Vec<(usize, Vec<usize>)> = Vec::new();
    for e in here.into_iter().filter(|&e| walks[e].len() > k + 1) {
        let substeps = walks[e].substeps[k];
        match groups.iter_mut().find(|(s, _)| *s == substeps) {
            Some((_, group)) => group.push(e),
            None => groups.push((substeps, vec![e])),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use asid_core::episode::ChannelColumns;
    use asid_core::{Episode, Scene};
    use asid_mjcf::Plant;

    use super::*;

    const STEP: f64 = 0.01;

    /// A log of a pushed slide at some times; the command of row `k` is `k`.
    fn logs(time: &[f64]) -> Logs {
        let scene = r#"<mujoco><worldbody><body>
            <joint name="slide" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
            <actuator><motor name="push" joint="slide"/></actuator>
            <sensor><jointpos name="place" joint="slide"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("slide", scene, &[]).unwrap()).unwrap();
        let channel = ChannelColumns {
            name: "place".into(),
            len: 1,
        };
        let episode = Episode {
            time: time.to_vec(),
            actuators: vec!["push".into()],
            ctrl: (0..time.len()).map(|k| k as f64).collect(),
            channels: vec![channel],
            readings: vec![0.0; time.len()],
            ..Episode::default()
        };
        Logs::new(&plant, &["place".to_owned()], vec![("log".into(), episode)]).unwrap()
    }

    #[test]
    fn rounding_to_steps_does_not_add_up() {
        // Rows are 1.49 steps apart: each lies within half a step of the walk's time.
        let time: Vec<f64> = (0..200).map(|k| 7.0 + 1.49 * STEP * f64::from(k)).collect();
        let walk = Walk::new(&logs(&time), 0, STEP);
        assert_eq!(walk.len(), 200);
        let mut steps = 0;
        for k in 0..walk.len() {
            assert!((walk.time[k] - (time[k] - 7.0)).abs() < 1e-12);
            assert!((walk.time[k] - STEP * steps as f64).abs() < 0.5001 * STEP);
            steps += walk.substeps.get(k).unwrap_or(&0);
        }
    }

    #[test]
    fn a_row_on_the_step_of_the_one_before_is_passed_over() {
        let walk = Walk::new(&logs(&[5.0, 5.0104, 5.013, 5.0296, 5.05]), 0, STEP);
        assert_eq!(walk.rows, [0, 1, 3, 4]);
        assert_eq!(walk.substeps, [1, 2, 2]);
    }

    #[test]
    fn the_command_between_two_rows_is_the_mean_of_those_sent() {
        // The third row falls on the step of the second: command 1 for 2.6 ms, then 2 for 16.6 ms.
        let walk = Walk::new(&logs(&[5.0, 5.0104, 5.013, 5.0296, 5.05]), 0, STEP);
        let mean = (2.6 + 2.0 * 16.6) / 19.2;
        for (got, want) in walk.ctrl.iter().zip([0.0, mean, 3.0]) {
            assert!((got - want).abs() < 1e-9, "{:?}", walk.ctrl);
        }
    }

    #[test]
    fn rows_of_a_fast_log_are_taken_together() {
        // 1 kHz at a step of 1 ms.
        let time: Vec<f64> = (0..41).map(|k| 1e-3 * f64::from(k)).collect();
        let walk = Walk::new(&logs(&time), 0, 1e-3);
        assert_eq!(walk.substeps, [4; 10]);
        assert_eq!(walk.rows[..3], [0, 4, 8]);
        assert!((walk.ctrl[1] - 5.5).abs() < 1e-9);
    }

    #[test]
    fn walks_are_grouped_by_the_steps_of_a_row_and_those_that_end_are_left_out() {
        let times: [&[f64]; 4] = [
            &[0.0, 0.01, 0.02],
            &[0.0, 0.01, 0.04],
            &[0.0, 0.02],
            &[0.0, 0.01, 0.02, 0.03],
        ];
        let walks = times.map(|t| Walk::new(&logs(t), 0, STEP));
        let walks: Vec<&Walk> = walks.iter().collect();
        assert_eq!(
            by_substeps(&walks, vec![0, 1, 2, 3], 0),
            [(1, vec![0, 1, 3]), (2, vec![2])]
        );
        assert_eq!(
            by_substeps(&walks, vec![0, 1, 2, 3], 1),
            [(1, vec![0, 3]), (3, vec![1])]
        );
    }

    #[test]
    fn a_part_has_the_steps_and_commands_between_its_rows() {
        let time: Vec<f64> = [0.0, 1.0, 3.0, 6.0, 10.0]
            .iter()
            .map(|t| t * STEP)
            .collect();
        let walk = Walk::new(&logs(&time), 0, STEP);
        let part = walk.part(1..4);
        assert_eq!(part.rows, [1, 2, 3]);
        assert_eq!(part.time, walk.time[1..4]);
        assert_eq!(part.substeps, [2, 3]);
        assert_eq!(part.ctrl, [1.0, 2.0]);
        assert_eq!(walk.part(0..walk.len()), walk);
        let last = walk.part(4..5);
        assert_eq!(
            (last.len(), last.substeps.len(), last.ctrl.len()),
            (1, 0, 0)
        );
    }
}
