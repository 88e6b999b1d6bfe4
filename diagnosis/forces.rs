//! The force that a model lacks at each joint, measured over short windows of the logs.
//!
//! Over a long replay an error at one joint moves all others. Over a window with a fitted initial
//! state, a missing force shows at its own joint. The constant forces on all joints that explain
//! most of a window's residuals are a linear fit: one replay per joint gives the derivatives for
//! all windows.

mod linear;

use asid_core::Result;
use asid_core::layout::JointKind;
use asid_core::registry::find;
use asid_effects::EffectEntry;
use asid_effects::EffectSpec;

use crate::bench::{Bench, Trial};
use crate::candidate::Candidate;
use crate::noise::{NORMAL, median};
use crate::record::Record;
use crate::trajectory::Trajectory;

use linear::Linear;

/// The effect whose parameter is a constant force on a joint.
const EFFECT: &str = asid_effects::catalogue::joint_friction::COULOMB;

/// What a model lacks at one joint over some of the windows.
#[derive(Clone, Debug, PartialEq)]
pub struct Missing {
    /// Name of the joint.
    pub joint: String,
    /// Unit of the force.
    pub unit: &'static str,
    /// Whether the machine touches something in these windows.
    pub touching: bool,
    /// Number of these windows.
    pub windows: usize,
    /// Root mean square force over them, less what the noise alone contributes.
    pub force: f64,
    /// Median force against the motion, weighted by how precisely a window determines it, and its
    /// standard error.
    ///
    /// The median ignores windows in which the machine meets something that the model does not.
    pub against: [f64; 2],
}

/// What short replays of one model leave unexplained.
#[derive(Clone, Debug, PartialEq)]
pub struct Short {
    /// Median over the windows of the root mean square residual, in units of the noise.
    ///
    /// The first is of windows without contact, the second of windows with contact; `None` where
    /// there are none.
    pub gaps: [Option<f64>; 2],
    /// What the model lacks at each hinge and slide.
    pub joints: Vec<Missing>,
}

/// Makes the candidate of a constant force at one joint.
fn candidate(joint: &str) -> Result<Candidate> {
    let effect = (find::<EffectEntry>(EFFECT)?.make)();
    let spec = EffectSpec {
        name: EFFECT.into(),
        site: joint.into(),
        values: Vec::new(),
    };
    let parameters = effect.parameters().iter();
    Ok(Candidate {
        starts: Vec::new(),
        large: Vec::new(),
        ranges: parameters.map(|p| p.range).collect(),
        effect: effect.into(),
        spec,
        episodes: usize::MAX,
        is_tolerance: false,
    })
}

/// Returns the residuals of a model over windows and the forces that it lacks at each hinge and
/// slide; `theta` are the study's parameters.
///
/// # Errors
/// When a rollout fails.
pub fn missing(
    bench: &Bench,
    windows: &Record,
    trials: &[Trial<'_>],
    theta: &[f64],
) -> Result<Short> {
    let layout = bench.layout();
    let scalar = |k: JointKind| matches!(k, JointKind::Hinge | JointKind::Slide);
    let joints: Vec<_> = layout.joints.iter().filter(|j| scalar(j.kind)).collect();
    let forces = joints.iter().map(|j| candidate(&j.name));
    let forces = forces.collect::<Result<Vec<_>>>()?;
    let linear = Linear::of(bench, windows, (trials, theta), &forces)?;
    let logs = &windows.logs;
    let shown = Trajectory::of(
        &*bench.machine.with(&[])?,
        &bench.machine.plant,
        &bench.parameters,
        logs,
        &linear.point,
        bench.machine.threads,
    )?;
    let mut sums = vec![<[Sum; 2]>::default(); joints.len()];
    let mut gaps = [Vec::new(), Vec::new()];
    for (e, path) in shown.episodes.iter().enumerate() {
        let touching = usize::from(path.contact.iter().any(|f| *f > 0.0));
        let rows = logs.offset(e)..logs.offset(e + 1);
        gaps[touching].push(linear.gap(rows.clone()));
        let found = linear.forces(rows);
        for ((joint, sums), (force, variance)) in joints.iter().zip(&mut sums).zip(found) {
            let speeds = path.qvel.iter().skip(joint.qvel).step_by(layout.nv);
            sums[touching].add(force, variance, speeds.sum());
        }
    }
    let mut all = Vec::new();
    for (joint, sums) in joints.iter().zip(sums) {
        let unit = if joint.kind == JointKind::Slide {
            "N"
        } else {
            "N m"
        };
        for (touching, sum) in [false, true].into_iter().zip(sums) {
            let windows = sum.against.len();
            if windows > 0 {
                all.push(Missing {
                    joint: joint.name.clone(),
                    unit,
                    touching,
                    windows,
                    force: (sum.excess / windows as f64).max(0.0).sqrt(),
                    against: sum.against(),
                });
            }
        }
    }
    Ok(Short {
        gaps: gaps.map(|mut g| median(&mut g)),
        joints: all,
    })
}

/// Sums over windows.
#[derive(Clone, Debug, Default)]
struct Sum {
    /// Sum of the squared forces less their variances.
    excess: f64,
    /// Forces against the motion, with their standard deviations.
    against: Vec<(f64, f64)>,
}

impl Sum {
    fn add(&mut self, force: f64, variance: f64, motion: f64) {
        self.excess += force * force - variance;
        self.against
            .push((-force * motion.signum(), variance.sqrt()));
    }

    /// Returns the weighted median against the motion, with its standard error.
    ///
    /// The weight of a window is the inverse of its standard deviation. The windows themselves
    /// determine a common factor of these standard deviations.
    fn against(&self) -> [f64; 2] {
        let least = f64::MIN_POSITIVE;
        let mut sorted: Vec<(f64, f64)> = self.against.clone();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
        let weight: f64 = sorted.iter().map(|(_, s)| 1.0 / s.max(least)).sum();
        let mut below = 0.0;
        let middle = sorted.iter().find(|(_, s)| {
            below += 1.0 / s.max(least);
            below >= 0.5 * weight
        });
        let middle = middle.map_or(0.0, |m| m.0);
        let off = sorted
            .iter()
            .map(|(x, s)| (x - middle).abs() / s.max(least));
        let factor = NORMAL * median(&mut off.collect::<Vec<f64>>()).unwrap_or(0.0);
        // Ratio of the standard error of a median to that of a mean.
        let loss = std::f64::consts::FRAC_PI_2.sqrt();
        let n = sorted.len().max(1) as f64;
        [middle, loss * factor * n.sqrt() / weight.max(least)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_acts_against_the_motion_is_told_from_what_does_not_and_from_a_blow() {
        // 0.2 against the motion beside a constant 0.01, in as many windows of each direction.
        let mut sum = Sum::default();
        for k in 0..100 {
            let motion = if k % 2 == 0 { 1.0 + f64::from(k) } else { -3.0 };
            sum.add(0.01 - 0.2 * f64::signum(motion), 1e-4, motion);
        }
        let excess = sum.excess / 100.0;
        assert!(
            (excess - (0.2 * 0.2 + 0.01 * 0.01 - 1e-4)).abs() < 1e-12,
            "{excess}"
        );
        sum.add(50.0, 1e-4, 1.0);
        let [middle, error] = sum.against();
        assert!((middle - 0.2).abs() < 0.0101, "{middle}");
        // All lie within 0.02 of the median.
        assert!(error < 1.2534 * 1.4827 * 0.02 / 10.0 + 1e-12, "{error}");
    }
}
