//! Whether a machine may play a motion: within its joints' ranges, not much faster than logged, and
//! without new contacts.
//!
//! A model says little of what a real machine bears; its logs show what it has borne. Forces need
//! no check: commands stay within their ranges, and drives within theirs.

use asid_core::Result;
use asid_core::layout::JointKind;

use crate::bench::{Bench, specs};
use crate::record::Record;
use crate::trajectory::Trajectory;

use super::Rival;

/// Largest ratio of a joint's speed to that in the logs: two for a motion at twice the speed, and a
/// tenth for how the joint follows.
const FASTER: f64 = 2.2;
/// Share of a joint's range kept free at either end, unless the logs went there: a real machine's
/// end stop may be there.
const END_MARGIN: f64 = 0.02;

/// Limits given by what a machine does in the logs, as replayed with an explanation.
pub(super) struct Limits<'b> {
    bench: &'b Bench,
    shown: Trajectory,
}

/// Returns the smallest and the largest of some values; NaN if one is NaN, as after a divergence.
///
/// `f64::min` and `f64::max` pass over NaN.
fn extremes<'v>(mut values: impl Iterator<Item = &'v f64>) -> [f64; 2] {
    let widen =
        |[low, high]: [f64; 2], x: &f64| (!x.is_nan()).then_some([low.min(*x), high.max(*x)]);
    let none = [f64::INFINITY, f64::NEG_INFINITY];
    values.try_fold(none, widen).unwrap_or([f64::NAN; 2])
}

/// Returns the largest magnitude of values with these extremes; NaN if they are.
fn largest([low, high]: [f64; 2]) -> f64 {
    if low.is_nan() { low } else { high.max(-low) }
}

impl<'b> Limits<'b> {
    /// Takes the limits from replays of the training logs with an explanation.
    pub(super) fn of(bench: &'b Bench, rival: Rival<'_>) -> Result<Self> {
        Ok(Self {
            bench,
            shown: played(bench, &bench.train, rival)?,
        })
    }

    /// Whether the machine keeps the limits in some episodes, as replayed with an explanation.
    pub(super) fn keeps(&self, record: &Record, rival: Rival<'_>) -> Result<bool> {
        let new = played(self.bench, record, rival)?;
        let layout = self.bench.layout();
        let scalar = |kind: JointKind| matches!(kind, JointKind::Hinge | JointKind::Slide);
        for (i, joint) in layout.joints.iter().enumerate() {
            if scalar(joint.kind) && !self.keeps_range(i, &new) {
                return Ok(false);
            }
            for dof in joint.qvel..joint.qvel + joint.kind.qvel_len() {
                let fastest = |t: &Trajectory| {
                    let rows = t.episodes.iter();
                    largest(extremes(
                        rows.flat_map(|e| e.qvel.iter().skip(dof).step_by(layout.nv)),
                    ))
                };
                // A comparison with NaN is false: a motion that diverged keeps no limit.
                let keeps = fastest(&new) <= FASTER * fastest(&self.shown);
                if !keeps {
                    return Ok(false);
                }
            }
        }
        Ok(!new.touches_more_than(&self.shown))
    }

    /// Whether a joint stays in its range, or where it was in the logs.
    fn keeps_range(&self, joint: usize, new: &Trajectory) -> bool {
        let Some([low, high]) = self.bench.machine.plant.joints[joint].range else {
            return true;
        };
        let layout = self.bench.layout();
        let joint = &layout.joints[joint];
        let margin = END_MARGIN * (high - low);
        let reached = |t: &Trajectory| {
            let rows = t.episodes.iter();
            extremes(rows.flat_map(|e| e.qpos.iter().skip(joint.qpos).step_by(layout.nq)))
        };
        let (was, is) = (reached(&self.shown), reached(new));
        is_within(is, [low + margin, high - margin], was)
    }
}

/// Whether values with the extremes `is` stay in a range, or within the extremes `was`; false if
/// they are NaN.
fn is_within(is: [f64; 2], [low, high]: [f64; 2], was: [f64; 2]) -> bool {
    is[0] >= low.min(was[0]) && is[1] <= high.max(was[1])
}

/// Returns the trajectory of the machine in some episodes, as replayed with an explanation.
fn played(bench: &Bench, record: &Record, (trials, of): Rival<'_>) -> Result<Trajectory> {
    let mut point = of.fit.point.clone();
    point.starts.clone_from(&record.starts);
    Trajectory::of(
        &*bench.machine.with(&specs(trials))?,
        &bench.machine.plant,
        &bench.all_parameters(trials),
        &record.logs,
        &point,
        bench.machine.threads,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a motion in which the model diverges was proposed as within all limits. Cause: the
    /// smallest and the largest of its positions and speeds were those before it diverged.
    #[test]
    fn a_motion_that_diverges_keeps_no_limit() {
        let whole = [0.1, -0.4, 0.3];
        assert_eq!(extremes(whole.iter()), [-0.4, 0.3]);
        assert!(is_within(extremes(whole.iter()), [-1.0, 1.0], [0.0, 0.0]));
        assert!(largest(extremes(whole.iter())) <= 1.0);
        for place in 0..3 {
            let mut broken = whole;
            broken[place] = f64::NAN;
            let found = extremes(broken.iter());
            assert!(!is_within(found, [-1.0, 1.0], [0.0, 0.0]), "{broken:?}");
            let keeps = largest(found) <= 1.0;
            assert!(!keeps, "{broken:?}");
        }
        // Where the logs went beyond the range, so may the motion.
        assert!(is_within([-1.1, 0.0], [-1.0, 1.0], [-1.2, 0.0]));
        assert!(!is_within([-1.3, 0.0], [-1.0, 1.0], [-1.2, 0.0]));
    }
}
