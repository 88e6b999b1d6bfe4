//! How the gap is divided: named, learnable, and not predictable; and what remains beside what is
//! named.

use asid_core::Result;

use super::{NO_GAP, Telling};
use crate::bench::Explanation;
use crate::bench::Trial;
use crate::ceiling::{Course, Left, Variable, learn, learnable, most};
use crate::findings::LEAST_GAP;
use crate::prepare::plain_residuals;
use crate::result::{Gap, Kind, Remainder, Shares};

/// Maximum number of rows of a sensor's entry from which a model learns.
const ROWS: usize = 6000;

/// Divides the excess, where `left` is what a verdict of a kind leaves; `None` if there is none.
pub(super) fn shares(gap: &Gap, kind: Kind, left: &[Left]) -> Option<Shares> {
    let closed = gap.closed?.clamp(0.0, 1.0);
    let learnable = (1.0 - closed) * learnable(left);
    let unrepeatable = 1.0 - closed - learnable;
    Some(match kind {
        Kind::Effects => Shares {
            named: closed,
            learnable,
            unrepeatable,
        },
        // What comes closest without being named is learnable nevertheless.
        Kind::None | Kind::Unknown => Shares {
            named: 0.0,
            learnable: closed + learnable,
            unrepeatable,
        },
    })
}

/// Returns what remains beside effects that are named.
pub(super) fn remainder(gap: &Gap, kind: Kind, left: &[Left]) -> Option<Remainder> {
    let is_left = kind == Kind::Effects && gap.refined > LEAST_GAP && gap.identified > NO_GAP;
    let most = most(left).filter(|_| is_left)?;
    Some(Remainder {
        share: gap.closed.map_or(f64::NAN, |c| 1.0 - c),
        place: most.place.clone(),
        against: most.foretold.variable.clone().unwrap_or_default(),
        kinds: most.foretold.kinds.clone(),
    })
}

impl Telling<'_> {
    /// Returns what an explanation leaves: of the missing force where that was estimated, else of
    /// whole replays of the training logs.
    pub(super) fn left(&self, trials: &[Trial<'_>], of: &Explanation) -> Result<Vec<Left>> {
        if !self.findings.left.is_empty() {
            return Ok(self.findings.left.clone());
        }
        let logs = &self.bench.train.logs;
        let residuals = plain_residuals(self.bench, &self.bench.train, trials, &of.fit.point)?;
        let n = logs.entries.len();
        let noise = logs.entry_noise();
        let rows: usize = logs.episodes.iter().map(|e| e.plan.rows()).sum();
        let stride = rows.div_ceil(ROWS).max(1);
        let of_entry = |j: usize| {
            let courses: Vec<Course> = (0..logs.episodes.len())
                .map(|e| self.course(e, j, stride, &residuals[e]))
                .collect();
            let all = courses.iter().flat_map(|c| &c.left);
            let square: f64 = all.filter(|x| x.is_finite()).map(|x| x * x).sum();
            Left {
                place: logs.sensors[logs.entries[j].sensor].name.clone(),
                weight: square / noise[j].powi(2),
                foretold: learn(&courses),
            }
        };
        Ok((0..n).map(of_entry).collect())
    }

    /// Returns what is left of one entry along an episode, with time, its rate of change and the
    /// commands as variables.
    fn course(&self, episode: usize, entry: usize, stride: usize, residuals: &[f64]) -> Course {
        let logs = &self.bench.train.logs;
        let log = &logs.episodes[episode];
        let n = logs.entries.len();
        let rows = || (0..log.plan.rows()).step_by(stride);
        let sensor = &logs.sensors[logs.entries[entry].sensor];
        let mut variables = vec![Variable {
            name: "time".into(),
            kinds: &["drift-like"],
            values: rows()
                .map(|k| log.episode.time[k] - log.episode.time[0])
                .collect(),
        }];
        let speeds = logs.speeds(episode, &log.readings);
        variables.push(Variable {
            name: format!("rate of {}", sensor.name),
            kinds: &["friction-like", "delay-like"],
            values: rows().map(|k| speeds[k * n + entry]).collect(),
        });
        let nu = log.episode.actuators.len();
        for (i, name) in log.episode.actuators.iter().enumerate() {
            variables.push(Variable {
                name: format!("command of {name}"),
                kinds: &["load-like", "gain-like"],
                values: rows().map(|k| log.episode.ctrl[k * nu + i]).collect(),
            });
        }
        Course {
            left: rows().map(|k| residuals[k * n + entry]).collect(),
            variables,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ceiling::Foretold;

    fn gap(identified: f64, refined: f64) -> Gap {
        let square = |x: f64| x * x - 1.0;
        Gap {
            identified,
            refined,
            closed: Some(1.0 - square(refined) / square(identified)),
            ..Gap::default()
        }
    }

    fn left(share: f64) -> Vec<Left> {
        vec![Left {
            place: "elbow".into(),
            weight: 2.0,
            foretold: Foretold {
                share,
                variable: Some("speed".into()),
                kinds: vec!["friction-like".into()],
            },
        }]
    }

    #[test]
    fn shares_sum_to_one_and_what_no_verdict_names_is_learnable() {
        let gap = gap(5.0, 2.0);
        for kind in [Kind::Effects, Kind::Unknown, Kind::None] {
            let s = shares(&gap, kind, &left(0.5)).unwrap();
            assert!((s.named + s.learnable + s.unrepeatable - 1.0).abs() < 1e-12);
            assert!((s.unrepeatable - 0.5 * 3.0 / 24.0).abs() < 1e-12);
            assert_eq!(s.named == 0.0, kind != Kind::Effects);
        }
        assert_eq!(shares(&Gap::default(), Kind::None, &left(0.5)), None);
    }

    #[test]
    fn a_remainder_is_told_beside_what_is_named_and_not_within_the_noise() {
        let told = remainder(&gap(5.0, 2.0), Kind::Effects, &left(0.5)).unwrap();
        assert!((told.share - 3.0 / 24.0).abs() < 1e-12);
        assert_eq!((&*told.place, &*told.against), ("elbow", "speed"));
        assert_eq!(told.kinds, ["friction-like"]);
        assert_eq!(remainder(&gap(5.0, 1.02), Kind::Effects, &left(0.5)), None);
        assert_eq!(remainder(&gap(5.0, 2.0), Kind::Unknown, &left(0.5)), None);
    }
}
