//! Parts of logs: some of the episodes, their first rows, windows of them, and the share in which the machine moves.

use asid_core::Layout;
use asid_core::replay::ReplayPlan;

use super::{LoggedEpisode, Logs};

/// Rows that a part of a log has at least, where the log has as many: fewer tell no speed.
const FEWEST: f64 = 6.0;

impl Logs {
    /// The same logs, some of the episodes only.
    #[must_use]
    pub fn some(&self, which: &[usize]) -> Self {
        Self {
            sensors: self.sensors.clone(),
            entries: self.entries.clone(),
            episodes: which.iter().map(|&i| self.episodes[i].clone()).collect(),
            differences: self.differences.clone(),
        }
    }

    /// The same logs, each cut after a share of its rows, but not so short that no speed can be told.
    #[must_use]
    pub fn cut(&self, layout: &Layout, share: f64) -> Self {
        let least = |e: &LoggedEpisode| share.max(FEWEST / e.plan.rows() as f64);
        let shares: Vec<f64> = self.episodes.iter().map(least).collect();
        self.cut_each(layout, &shares)
    }

    /// The same logs, each cut after its own share of its rows.
    #[must_use]
    pub fn cut_each(&self, layout: &Layout, shares: &[f64]) -> Self {
        let mut logs = self.clone();
        let width = self.differences.width();
        for (e, share) in logs.episodes.iter_mut().zip(shares) {
            let rows = ((e.plan.rows() as f64 * share).ceil() as usize).clamp(2, e.plan.rows());
            e.plan = ReplayPlan::new(layout, &e.episode, rows);
            e.readings.truncate(rows * width);
        }
        logs
    }

    /// The logs cut into windows of `rows` rows, one after the other, each a log of its own; what
    /// is left over at the end of an episode stays out unless it is half as long.
    #[must_use]
    pub fn windows(&self, layout: &Layout, rows: usize) -> Self {
        let width = self.width();
        let mut logs = self.some(&[]);
        for e in &self.episodes {
            let mut first = 0;
            while e.plan.rows() >= first + rows.div_ceil(2).max(2) {
                let part = first..(first + rows).min(e.plan.rows());
                let episode = e.episode.part(part.clone());
                logs.episodes.push(LoggedEpisode {
                    name: e.name.clone(),
                    readings: e.readings[part.start * width..part.end * width].to_vec(),
                    plan: ReplayPlan::new(layout, &episode, episode.rows()),
                    episode,
                });
                first = part.end;
            }
        }
        logs
    }

    /// The same logs, replayed with another time step.
    #[must_use]
    pub fn replanned(&self, layout: &Layout) -> Self {
        let mut logs = self.clone();
        for e in &mut logs.episodes {
            e.plan = ReplayPlan::new(layout, &e.episode, e.plan.rows());
        }
        logs
    }

    /// Share of each episode after which no reading moves by more than a few deviations of the
    /// noise any more.
    #[must_use]
    pub fn moving_shares(&self) -> Vec<f64> {
        let n = self.entries.len();
        let noise = self.entry_noise();
        let mut shares = Vec::with_capacity(self.episodes.len());
        for (i, e) in self.episodes.iter().enumerate() {
            let rows = e.plan.rows();
            let width = self.width();
            let last = e.readings[(rows - 1) * width..].to_vec();
            let mut difference = vec![0.0; rows * n];
            self.difference(i, &last.repeat(rows), &mut difference);
            let moving = |row: &[f64]| row.iter().zip(&noise).any(|(d, s)| d.abs() > 8.0 * s);
            let end = difference.chunks_exact(n).rposition(moving).unwrap_or(0);
            shares.push(((end + 1) as f64 / rows as f64 + 0.05).min(1.0));
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{log, plant};
    use super::*;

    #[test]
    fn an_episode_is_cut_where_its_own_motion_ends() {
        // One that comes to rest after 2 of 20 rows does not hide behind one that never does.
        let resting: Vec<f64> = (0..20)
            .map(|k| if k < 2 { k as f64 } else { 5.0 })
            .collect();
        let moving: Vec<f64> = (0..10).map(|k| k as f64).collect();
        let plant = plant();
        let logs = vec![log("resting", &resting), log("moving", &moving)];
        let mut logs = Logs::new(&plant, &["place".to_owned()], logs).unwrap();
        logs.set_noise(&[0.01]);
        let shares = logs.moving_shares();
        // The last row that moves is the second; a twentieth more is kept.
        assert!(
            (shares[0] - (2.0 / 20.0 + 0.05)).abs() < 1e-12,
            "{shares:?}"
        );
        assert!(
            (shares[1] - (9.0 / 10.0 + 0.05)).abs() < 1e-12,
            "{shares:?}"
        );
        let cut = logs.cut_each(&plant.layout, &shares);
        let rows: Vec<usize> = cut.episodes.iter().map(|e| e.plan.rows()).collect();
        // Rounded up.
        assert_eq!(rows, [4, 10]);
        assert_eq!(cut.len(), 14);
        // A tenth of them would be two rows and one.
        let heads = logs.cut(&plant.layout, 0.1);
        assert!(heads.episodes.iter().all(|e| e.plan.rows() == 6));
    }
}
