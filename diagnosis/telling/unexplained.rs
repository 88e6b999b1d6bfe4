//! Force that the model still lacks with the best explanation: the place where most of it is left,
//! in words.

use asid_core::Result;

use super::Telling;
use crate::bench::{Explanation, Trial};
use crate::forces::{self, Short};
use crate::result::MissingForce;
use crate::windows;

/// Share of the missing force at a joint from which on it counts as unexplained.
const UNEXPLAINED: f64 = 0.7;

/// Describes the joint at which the largest share of the missing force over short windows is left.
pub(super) fn least_explained(before: &Short, after: &Short) -> Option<String> {
    let pairs = before.joints.iter().zip(&after.joints);
    let shares = pairs.map(|(a, b)| (b.force / a.force, a, b));
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

/// Describes the degree of freedom at which the largest share is left, of a force that was
/// estimated moment by moment.
pub(super) fn least_made_up(missing: &[MissingForce]) -> Option<String> {
    let share = |m: &MissingForce| m.refined / m.identified;
    let worst = missing
        .iter()
        .filter(|m| share(m).is_finite())
        .max_by(|a, b| share(a).total_cmp(&share(b)))?;
    (share(worst) > UNEXPLAINED).then(|| {
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
