//! The rows of a log that the filter processes.

use crate::data::Logs;
use crate::noise::median;

/// Shortest row, s. Over a shorter one no force moves a body by as much as a sensor resolves, and
/// machines of this size hardly move faster.
pub const FINEST: f64 = 0.004;

/// Smallest offset of a row from its physics step that counts, as a share of the step: stamps are
/// rounded.
const ON_STEP: f64 = 1e-3;
/// Largest distance to a reading that tells the motion about a row, as a multiple of the log's usual
/// row time: a joint may turn back over a longer one.
const NEAR: f64 = 2.5;

/// Rows of one episode, at least [`FINEST`] and one physics step apart.
///
/// A simulation has states at whole physics steps alone, and a log may have rows between them. So a
/// walk's rows are at whole steps, with the readings that the log has about them.
#[derive(Clone, Debug, PartialEq)]
pub struct Walk {
    /// Index of the episode in the logs.
    pub episode: usize,
    /// Indices of the rows in the log.
    pub rows: Vec<usize>,
    /// Times of the rows' physics steps from the first row on, s.
    pub time: Vec<f64>,
    /// Physics steps from each row to the next, one fewer than rows.
    pub substeps: Vec<usize>,
    /// Commands held from each row to the next, `(rows - 1) x nu`.
    pub ctrl: Vec<f64>,
    /// Readings at the rows' steps, `rows x width`; empty where those of the log are.
    pub at_steps: Vec<f64>,
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
    /// up; of rows on one step, the nearest is taken. A row is skipped if it follows the one before
    /// sooner than [`FINEST`]. The command between two rows is the mean of the commands sent.
    #[must_use]
    pub fn new(logs: &Logs, episode: usize, timestep: f64) -> Self {
        let log = &logs.episodes[episode];
        let times = &log.episode.time;
        let all = log.plan.rows();
        let step = |k: usize| ((times[k] - times[0]) / timestep).round() as usize;
        let off = |k: usize| times[k] - times[0] - timestep * step(k) as f64;
        let least = ((FINEST / timestep).round() as usize).max(1);
        let mut rows = vec![0];
        let mut next = 1;
        while let Some(first) = (next..all).find(|&k| step(k) >= step(rows[rows.len() - 1]) + least)
        {
            let same = (first..all).take_while(|&k| step(k) == step(first));
            let nearest = same.min_by(|&a, &b| off(a).abs().total_cmp(&off(b).abs()));
            let nearest = nearest.unwrap_or(first);
            rows.push(nearest);
            next = nearest + 1;
        }
        let steps: Vec<usize> = rows.iter().map(|&k| step(k)).collect();
        let time: Vec<f64> = steps.iter().map(|&s| timestep * s as f64).collect();
        let mut walk = Self {
            episode,
            substeps: steps.windows(2).map(|s| s[1] - s[0]).collect(),
            ctrl: Vec::with_capacity((rows.len() - 1) * log.episode.actuators.len()),
            at_steps: Vec::new(),
            segment: None,
            rows,
            time,
        };
        let is_off = |k: usize| off(k).abs() > ON_STEP * timestep;
        let edges: Vec<f64> = (walk.rows.iter().zip(&walk.time))
            .map(|(&k, at)| if is_off(k) { times[0] + at } else { times[k] })
            .collect();
        for pair in edges.windows(2) {
            walk.add_commands(logs, (pair[0], pair[1]));
        }
        if walk.rows.iter().any(|&k| is_off(k)) {
            walk.read_at_steps(logs, timestep);
        }
        walk
    }

    /// Adds the means of the commands that the log holds from one time to another.
    fn add_commands(&mut self, logs: &Logs, (from, to): (f64, f64)) {
        let log = &logs.episodes[self.episode].episode;
        let (nu, times) = (log.actuators.len(), &log.time);
        let first = times.partition_point(|t| *t <= from).saturating_sub(1);
        let end = times.partition_point(|t| *t < to);
        for actuator in 0..nu {
            let sent = |r: usize| {
                let until = times.get(r + 1).map_or(to, |t| t.min(to));
                log.ctrl[r * nu + actuator] * (until - times[r].max(from))
            };
            let sum: f64 = (first..end).map(sent).sum();
            self.ctrl.push(sum / (to - from));
        }
    }

    /// Reads the log at the rows' steps, by the parabola through a row and those about it.
    ///
    /// Readings that jump with a command are those of the row: between two rows they may have any
    /// value.
    fn read_at_steps(&mut self, logs: &Logs, timestep: f64) {
        let log = &logs.episodes[self.episode];
        let (times, width) = (&log.episode.time, logs.width());
        let mut row_times: Vec<f64> = times.windows(2).map(|t| t[1] - t[0]).collect();
        let near = NEAR * median(&mut row_times).unwrap_or(timestep).max(timestep);
        let reading = |k: usize, c: usize| log.readings[k * width + c];
        let mut at_steps = Vec::with_capacity(self.rows.len() * width);
        for (&k, time) in self.rows.iter().zip(&self.time) {
            let at = times[0] + time;
            // Messages that arrive together tell no speed: at least a step lies between two.
            let before = times.partition_point(|t| *t <= times[k] - timestep);
            let after = times.partition_point(|t| *t < times[k] + timestep);
            let sides = [
                before.checked_sub(1),
                (after < log.plan.rows()).then_some(after),
            ];
            let sides = sides.map(|r| r.filter(|&r| (times[r] - times[k]).abs() <= near));
            let mut row: Vec<f64> = (0..width).map(|c| reading(k, c)).collect();
            for (sensor, place) in logs.places() {
                if sensor.jumps {
                    continue;
                }
                let is_read = |r: &usize| place.clone().all(|c| reading(*r, c).is_finite());
                let sides = sides.map(|r| r.filter(is_read));
                // Of the two quaternions of an orientation, the one next to that of the row.
                let sign = |r: usize| {
                    let dot = |c: usize| reading(r, c) * reading(k, c);
                    let dot: f64 = place.clone().map(dot).sum();
                    if sensor.rotation { dot.signum() } else { 1.0 }
                };
                for c in place.clone() {
                    let own = (times[k], reading(k, c));
                    let side = |r: usize| (times[r], sign(r) * reading(r, c));
                    row[c] = at_time(own, sides.map(|r| r.map(side)), at);
                }
            }
            at_steps.extend(row);
        }
        self.at_steps = at_steps;
    }

    /// The readings of a row.
    #[must_use]
    pub fn readings<'l>(&'l self, logs: &'l Logs, k: usize) -> &'l [f64] {
        let width = logs.width();
        let (all, row) = if self.at_steps.is_empty() {
            (&logs.episodes[self.episode].readings, self.rows[k])
        } else {
            (&self.at_steps, k)
        };
        &all[row * width..(row + 1) * width]
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
        let width = self.at_steps.len() / self.len().max(1);
        Self {
            episode: self.episode,
            rows: self.rows[range.clone()].to_vec(),
            at_steps: self.at_steps[range.start * width..range.end * width].to_vec(),
            time: self.time[range].to_vec(),
            substeps: self.substeps[steps.clone()].to_vec(),
            ctrl: self.ctrl[steps.start * nu..steps.end * nu].to_vec(),
            segment: None,
        }
    }
}

/// The value at a time of the parabola through three points `(time, value)`, or of the line through
/// two; `sides` are those before and after `own`, if any.
fn at_time(own: (f64, f64), sides: [Option<(f64, f64)>; 2], at: f64) -> f64 {
    let slope = |(t, y): (f64, f64)| (y - own.1) / (t - own.0);
    let ahead = at - own.0;
    match sides {
        [Some(a), Some(b)] => {
            let (slope, curve) = (slope(a), (slope(b) - slope(a)) / (b.0 - a.0));
            own.1 + ahead * (slope + curve * (at - a.0))
        }
        [Some(side), None] | [None, Some(side)] => own.1 + ahead * slope(side),
        [None, None] => own.1,
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
        // Rows are 1.49 steps apart: each lies within half a step of its own.
        let time: Vec<f64> = (0..200).map(|k| 7.0 + 1.49 * STEP * f64::from(k)).collect();
        let walk = Walk::new(&logs(&time), 0, STEP);
        assert_eq!(walk.len(), 200);
        let mut steps = 0;
        for k in 0..walk.len() {
            assert!((walk.time[k] - (time[k] - 7.0)).abs() < 0.5001 * STEP);
            assert!((walk.time[k] - STEP * steps as f64).abs() < 1e-12);
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
        // From 10 to 30 ms: command 0 for 0.4 ms, 1 for 2.6 ms, 2 for 16.6 ms, 3 for 0.4 ms.
        let walk = Walk::new(&logs(&[5.0, 5.0104, 5.013, 5.0296, 5.05]), 0, STEP);
        let mean = (2.6 + 2.0 * 16.6 + 3.0 * 0.4) / 20.0;
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

    /// Symptom: the friction of a pendulum was found in a log at 100 Hz, and `unknown` in one at 150
    /// Hz, with a missing force of 30 N m.
    ///
    /// Cause: rows between two physics steps were compared with the state at the nearest one.
    #[test]
    fn readings_between_steps_are_those_at_the_steps() {
        let rate = 150.0;
        let time: Vec<f64> = (0..60).map(|k| f64::from(k) / rate).collect();
        let mut all = logs(&time);
        let place = |t: f64| 0.7 * t - 3.0 * t * t;
        all.episodes[0].readings = time.iter().map(|t| place(*t)).collect();
        all.episodes[0].readings[20] = f64::NAN;
        let walk = Walk::new(&all, 0, 0.002);
        for k in 0..walk.len() {
            let read = walk.readings(&all, k)[0];
            match walk.rows[k] {
                20 => assert!(read.is_nan()),
                // At an end, and beside a missing row, by a line.
                0 | 19 | 21 | 59 => assert!((read - place(walk.time[k])).abs() < 3e-5),
                _ => assert!((read - place(walk.time[k])).abs() < 1e-12, "{k}"),
            }
        }
        // Each part has its own.
        let part = walk.part(10..15);
        assert_eq!(part.readings(&all, 2), walk.readings(&all, 12));
        // On the steps, they are the log's.
        assert!(Walk::new(&all, 0, 1.0 / 300.0).at_steps.is_empty());
    }

    #[test]
    fn a_fast_log_is_read_on_the_steps() {
        // 1 kHz at a step of 2 ms.
        let time: Vec<f64> = (0..41).map(|k| 1e-3 * f64::from(k)).collect();
        let walk = Walk::new(&logs(&time), 0, 2e-3);
        assert_eq!(walk.rows[..4], [0, 4, 8, 12]);
        assert!(walk.at_steps.is_empty());
    }

    #[test]
    fn messages_that_arrive_together_tell_no_speed() {
        let mut all = logs(&[0.0, 0.011, 0.0111, 0.02]);
        all.episodes[0].readings = vec![0.0, 0.011, 0.0121, 0.02];
        let walk = Walk::new(&all, 0, STEP);
        let read = walk.readings(&all, 1)[0];
        assert!((read - STEP).abs() < 1e-3, "{read}");
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
