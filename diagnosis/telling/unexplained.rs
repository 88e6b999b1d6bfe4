//! Force that the model still lacks with the best explanation: the place where most of it is left,
//! in words.

use asid_core::Result;

use super::Telling;
use crate::bench::{Explanation, Trial};
use crate::ceiling::Left;
use crate::forces::{self, Short};
use crate::result::MissingForce;
use crate::windows;

/// Share of the missing force at a joint from which on it counts as unexplained.
const UNEXPLAINED: f64 = 0.7;

/// Share of the largest missing force of a unit below which nothing counts as missing at a joint: a
/// fifth, 4 % of the power, which a name must make up for.
const SLIGHT: f64 = 0.2;

/// Describes the joint at which the largest share of the missing force over short windows is left.
///
/// Joints that hardly lack any do not count: nearly all of it is left there.
pub(super) fn least_explained(before: &Short, after: &Short) -> Option<String> {
    let pairs = before.joints.iter().zip(&after.joints);
    let largest = |unit: &str| {
        let alike = before.joints.iter().filter(|m| m.unit == unit);
        alike.map(|m| m.force).fold(0.0, f64::max)
    };
    let lacking = pairs.filter(|(a, _)| a.force >= SLIGHT * largest(a.unit));
    let shares = lacking.map(|(a, b)| (b.force / a.force, a, b));
    let (share, a, b) = shares
        .filter(|(share, ..)| share.is_finite())
        .max_by(|x, y| x.0.total_cmp(&y.0))?;
    (share > UNEXPLAINED).then(|| {
        format!(
            "at {}, {:.2} of the {:.2} {} that the model lacks over short windows are left",
            a.joint, b.force, a.force, a.unit
        )
    })
}

/// Describes the degree of freedom at which most force is left, of a force that was estimated
/// moment by moment; `None` if a good part of it is made up for.
///
/// `left` has what is left at each place, in units of its inertial forces.
pub(super) fn least_made_up(missing: &[MissingForce], left: &[Left]) -> Option<String> {
    let most = left.iter().max_by(|a, b| a.weight.total_cmp(&b.weight))?;
    let worst = missing.iter().find(|m| m.dof == most.place)?;
    let share = worst.refined / worst.identified;
    (share.is_finite() && share > UNEXPLAINED).then(|| {
        format!(
            "at {}, {:.2} of the {:.2} {} that the model lacks are left",
            worst.dof, worst.refined, worst.identified, worst.unit
        )
    })
}

impl Telling<'_> {
    /// Returns the results of short replays, if the logs allow them: without effects, with those of
    /// the best explanation, and their duration, s.
    pub(super) fn short(
        &self,
        none: &Explanation,
        (members, best): (&[Trial<'_>], &Explanation),
    ) -> Result<Option<(Short, Short, f64)>> {
        let bench = self.bench;
        let plant = &bench.machine.plant;
        // Short replays take seconds for machines of many joints: a search that had no time has
        // none for them.
        if self.stopped || !self.findings.missing.is_empty() {
            return Ok(None);
        }
        let Some(rows) = windows::rows(plant, &bench.train.logs, &bench.open) else {
            return Ok(None);
        };
        let record = windows::cut(plant, &bench.train, rows);
        let study = bench.parameters.len();
        let of = |trials: &[Trial<'_>], e: &Explanation| {
            forces::missing(bench, &record, trials, &e.fit.point.theta[..study])
        };
        let seconds = record.logs.longest();
        let before = of(&[], none)?;
        let after = if members.is_empty() && best.fit.point.theta == none.fit.point.theta {
            before.clone()
        } else {
            of(members, best)?
        };
        Ok(Some((before, after, seconds)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ceiling::Foretold;
    use crate::forces::Missing;

    /// Forces at a shoulder and an elbow, N m, before and after; the elbow hardly lacks any.
    fn at_two_joints(left: f64) -> [(&'static str, [f64; 2]); 2] {
        [("shoulder", [5.0, left]), ("elbow", [0.003, 0.003])]
    }

    /// Symptom: the sentence told that at the elbow 0.00 of 0.00 N m are left. Cause: the joint
    /// with the largest share was told, however little is missing there.
    #[test]
    fn the_joint_that_is_told_is_the_one_where_most_is_left() {
        let told = |left: f64| {
            let joints = at_two_joints(left);
            let missing = joints.map(|(dof, [identified, refined])| MissingForce {
                dof: dof.to_owned(),
                unit: "N m".to_owned(),
                identified,
                refined,
                correlation_time: 0.1,
            });
            // In units of an inertial force of 1 N m at the elbow and of 10 N m at the shoulder.
            let left = [("shoulder", left / 10.0), ("elbow", 0.003)].map(|(place, force)| Left {
                place: place.to_owned(),
                weight: force * force,
                foretold: Foretold::default(),
            });
            least_made_up(&missing, &left)
        };
        let shoulder = "at shoulder, 3.60 of the 5.00 N m that the model lacks are left";
        assert_eq!(told(3.6).as_deref(), Some(shoulder));
        assert_eq!(told(3.0), None, "two fifths are made up for");
    }

    #[test]
    fn over_short_windows_joints_that_lack_nothing_do_not_count_either() {
        let told = |left: f64| {
            let [before, after] = [0, 1].map(|of: usize| Short {
                gaps: [None; 2],
                joints: at_two_joints(left)
                    .map(|(joint, forces)| Missing {
                        joint: joint.to_owned(),
                        unit: "N m",
                        touching: false,
                        windows: 9,
                        force: forces[of],
                        against: [0.0; 2],
                    })
                    .into(),
            });
            least_explained(&before, &after)
        };
        assert!(told(3.6).is_some_and(|text| text.starts_with("at shoulder, 3.60")));
        assert_eq!(told(3.0), None);
    }
}
