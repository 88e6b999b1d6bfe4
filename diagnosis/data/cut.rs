//! Parts of logs: their first rows, and windows of them.

use asid_core::Layout;
use asid_readings::replay::ReplayPlan;

use super::{LoggedEpisode, Logs};

/// Fewest rows of a part of a log, if the log has as many: fewer do not determine a speed.
const FEWEST: f64 = 6.0;

impl Logs {
    /// Cuts each log after a share of its rows, but not so short that it does not determine a
    /// speed.
    #[must_use]
    pub fn cut(&self, layout: &Layout, share: f64) -> Self {
        let mut logs = self.clone();
        let width = self.differences.width();
        for e in &mut logs.episodes {
            let all = e.plan.rows();
            let share = share.max(FEWEST / all as f64);
            let rows = ((all as f64 * share).ceil() as usize).clamp(2, all);
            e.plan = ReplayPlan::new(layout, &e.episode, rows);
            e.readings.truncate(rows * width);
        }
        logs
    }

    /// Cuts the logs into consecutive windows of `rows` rows, each a log of its own.
    ///
    /// The remainder at the end of an episode is left out unless it is at least half as long.
    #[must_use]
    pub fn windows(&self, layout: &Layout, rows: usize) -> Self {
        let width = self.width();
        let mut logs = Self {
            episodes: Vec::new(),
            ..self.clone()
        };
        for e in &self.episodes {
            let mut first = 0;
            while e.plan.rows() >= first + rows.div_ceil(2).max(2) {
                let part = first..(first + rows).min(e.plan.rows());
                let episode = e.episode.part(part.clone());
                logs.episodes.push(LoggedEpisode {
                    name: e.name.clone(),
                    number: e.number,
                    readings: e.readings[part.start * width..part.end * width].to_vec(),
                    plan: ReplayPlan::new(layout, &episode, episode.rows()),
                    episode,
                });
                first = part.end;
            }
        }
        logs
    }

    /// Plans the replays of the same logs with another time step.
    #[must_use]
    pub fn replanned(&self, layout: &Layout) -> Self {
        let mut logs = self.clone();
        for e in &mut logs.episodes {
            e.plan = ReplayPlan::new(layout, &e.episode, e.plan.rows());
        }
        logs
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{log, plant};
    use super::*;

    #[test]
    fn a_head_is_a_share_of_the_rows_but_no_shorter_than_tells_a_speed() {
        let places: Vec<f64> = (0..20).map(f64::from).collect();
        let plant = plant();
        let logs = vec![log("short", &places[..10]), log("long", &places)];
        let logs = Logs::new(&plant, &["place".to_owned()], logs).unwrap();
        let rows = |share: f64| -> Vec<usize> {
            let cut = logs.cut(&plant.layout, share);
            cut.episodes.iter().map(|e| e.plan.rows()).collect()
        };
        assert_eq!(rows(0.1), [6, 6]);
        // Rounded up.
        assert_eq!(rows(0.71), [8, 15]);
        assert_eq!(logs.cut(&plant.layout, 0.5).len(), 16);
    }
}
