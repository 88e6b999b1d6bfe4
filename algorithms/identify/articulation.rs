//! How two tracked parts are joined (rigidly, by a hinge or by a slide) and about which axis, from
//! their tracked poses alone.
//!
//! The pose of the moving part in the frame of the fixed one is constant (rigid), turned about an
//! axis by a separate angle at each time (revolute), or shifted along one (prismatic).
//!
//! Each kind is fitted by least squares. The residuals are whitened by the noise that both trackers
//! cause in the relative pose. Orientation noise of the fixed part turns the other part about it,
//! so the noise of position and rotation is correlated. Angles and shifts are eliminated for each
//! trial of axis, origin and mean pose (variable projection; Golub and Pereyra 1973). The Bayesian
//! information criterion chooses the kind; it penalises every angle and shift as a free parameter.

mod fit;

use asid_core::signal::{Signal, unit_quaternion};
use asid_core::task::Task;
use asid_core::{Episode, Error, Layout, Result};
use nalgebra::{Isometry3, Vector3};
use serde::{Deserialize, Serialize};

use fit::{Fit, POSE, Reading, fit};

/// A kind of joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Joint {
    /// The parts do not move against each other.
    Rigid,
    /// A hinge.
    Revolute,
    /// A slide.
    Prismatic,
}

/// Standard deviations of a tracker's noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Of each entry of a position, m.
    pub position: f64,
    /// Of each rotation angle, rad.
    pub rotation: f64,
}

/// Fewest poses of which a joint is told: two always lie on one axis, whatever joins the parts.
const LEAST: usize = 3;

/// How two parts are joined.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Articulation {
    /// The most probable kind.
    pub joint: Joint,
    /// Probability of each kind: rigid, revolute, prismatic.
    pub probability: [f64; 3],
    /// Unit vector along the axis in the fixed part's frame; `None` for a rigid joint.
    pub axis: Option<[f64; 3]>,
    /// Standard deviation of the axis, rad.
    pub axis_std: Option<f64>,
    /// Point of the axis nearest to the moving part, in the fixed part's frame, m; `None` but
    /// for a revolute joint.
    pub origin: Option<[f64; 3]>,
    /// Standard deviation of the origin across the axis, m.
    pub origin_std: Option<f64>,
    /// How far the joint moved: largest less smallest angle (rad) or shift (m).
    pub travel: f64,
    /// Root mean square of the whitened residual.
    pub residual: f64,
}

/// Joint between the two parts that a task tracks, from all readings of the episodes; `None` where
/// the task does not track two parts.
///
/// # Errors
/// When the task names sensors that are not tracked, or no row has both poses.
pub fn of_episodes(
    task: &dyn Task,
    layout: &Layout,
    signals: &[Signal],
    episodes: &[Episode],
) -> Result<Option<Articulation>> {
    let Some(parts) = &task.spec().parts else {
        return Ok(None);
    };
    let noise = |name: &str| {
        (signals.iter().find(|s| s.sensor == name))
            .map(|s| s.noise)
            .ok_or_else(|| Error::unknown("signal", name, signals.iter().map(|s| &*s.sensor)))
    };
    let mut noises = Vec::with_capacity(2);
    for part in parts {
        noises.push(Noise {
            position: noise(&part.position)?,
            rotation: noise(&part.orientation)?,
        });
    }
    let names: Vec<String> = (parts.iter())
        .flat_map(|p| [p.position.clone(), p.orientation.clone()])
        .collect();
    let poses: Vec<[Isometry3<f64>; 2]> = episodes
        .iter()
        .flat_map(|e| {
            let rows = e.select(layout, &names);
            let complete = rows
                .chunks_exact(14)
                .filter(|r| r.iter().all(|x| x.is_finite()))
                .map(|r| [pose(&r[..7]), pose(&r[7..])]);
            complete.collect::<Vec<_>>()
        })
        .collect();
    estimate(&poses, [noises[0], noises[1]]).map(Some)
}

/// Pose of a part in the world (`world_from_part`) from its position and orientation.
fn pose(row: &[f64]) -> Isometry3<f64> {
    Isometry3::from_parts(
        Vector3::new(row[0], row[1], row[2]).into(),
        unit_quaternion(&row[3..7]),
    )
}

/// Joint between the second part and the first, from their poses in the world and the noise of each
/// part's tracker.
///
/// # Errors
/// When there are fewer than 3 poses, or a tracker has no noise.
pub fn estimate(poses: &[[Isometry3<f64>; 2]], noise: [Noise; 2]) -> Result<Articulation> {
    if poses.len() < LEAST {
        return Err(Error::Failed(format!(
            "complete readings of both parts are too few: {}, where {LEAST} are needed",
            poses.len()
        )));
    }
    let readings: Option<Vec<Reading>> = poses
        .iter()
        .map(|[fixed, moving]| Reading::new(fixed.inverse() * moving, noise))
        .collect();
    let Some(readings) = readings else {
        let message = "the noise of each tracker must be above 0, of positions and of orientations";
        return Err(Error::Failed(message.into()));
    };
    let fits = [Joint::Rigid, Joint::Revolute, Joint::Prismatic].map(|joint| fit(joint, &readings));
    let best = fits.iter().map(|f| f.bic).fold(f64::INFINITY, f64::min);
    let weights = [0, 1, 2].map(|i| (0.5 * (best - fits[i].bic)).exp());
    let total: f64 = weights.iter().sum();
    let [rigid, revolute, prismatic] = fits;
    let found = [rigid, revolute, prismatic]
        .into_iter()
        .min_by(|a, b| a.bic.total_cmp(&b.bic))
        .ok_or_else(|| Error::Failed("no joint fits".into()))?;
    Ok(found.articulation(&readings, weights.map(|w| w / total)))
}

impl Fit {
    fn articulation(self, readings: &[Reading], probability: [f64; 3]) -> Articulation {
        let joint = self.trial.joint;
        let deviation = |i: usize| {
            let covariance = self.covariance.as_ref()?;
            Some((covariance[(i, i)] + covariance[(i + 1, i + 1)]).sqrt())
        };
        let axis = self.trial.axis;
        let along = axis.dot(&(self.trial.mean.translation.vector - self.trial.origin));
        let origin = self.trial.origin + axis * along;
        let low = self.q.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.q.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let moves = joint != Joint::Rigid;
        let turns = joint == Joint::Revolute;
        Articulation {
            joint,
            probability,
            axis: moves.then(|| axis.into()),
            axis_std: if moves { deviation(POSE) } else { None },
            origin: turns.then(|| origin.into()),
            origin_std: if turns { deviation(POSE + 2) } else { None },
            travel: high - low,
            residual: (2.0 * self.loss / (6 * readings.len()) as f64).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;
    use nalgebra::UnitQuaternion;
    use rand_distr::{Distribution, StandardNormal};

    const NOISE: Noise = Noise {
        position: 0.002,
        rotation: 0.01,
    };

    /// Poses of two parts, the first sliding over a table, the second moved by `joint`.
    fn tracked(seed: u64, joint: impl Fn(f64) -> Isometry3<f64>) -> Vec<[Isometry3<f64>; 2]> {
        let mut rng = Streams::new(seed).stream("t");
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        (0..100)
            .map(|k| {
                let t = f64::from(k) / 99.0;
                let fixed = Isometry3::new(
                    Vector3::new(0.5 + 0.05 * t, 0.1, 0.0),
                    Vector3::z() * (0.7 + 0.2 * t),
                );
                [fixed, fixed * joint(t)].map(|pose| {
                    let shift = Vector3::from_fn(|_, _| NOISE.position * normal());
                    let turn = Vector3::from_fn(|_, _| NOISE.rotation * normal());
                    Isometry3::from_parts(
                        (pose.translation.vector + shift).into(),
                        UnitQuaternion::from_scaled_axis(turn) * pose.rotation,
                    )
                })
            })
            .collect()
    }

    fn mean_pose() -> Isometry3<f64> {
        Isometry3::new(Vector3::new(0.0, 0.05, 0.12), Vector3::x() * -1.8)
    }

    #[test]
    fn a_hinge_is_found_with_axis_and_origin() {
        let axis = Vector3::new(-1.0, 0.2, 0.1).normalize();
        let origin = Vector3::new(0.0, 0.1, 0.03);
        for seed in 0..5 {
            // The joint stands still at first, like a lid before it is touched.
            let found = estimate(
                &tracked(seed, |t| {
                    let angle = (2.0 * t - 1.0).max(0.0) * 0.6;
                    let turn = UnitQuaternion::from_scaled_axis(axis * angle);
                    let about = origin - turn * origin;
                    Isometry3::from_parts(about.into(), turn) * mean_pose()
                }),
                [NOISE; 2],
            )
            .unwrap();
            assert_eq!(found.joint, Joint::Revolute, "{found:?}");
            assert!(found.probability[1] > 0.99);
            assert!((found.travel - 0.6).abs() < 0.06, "{}", found.travel);
            let a = Vector3::from(found.axis.unwrap());
            let tilt = a.cross(&axis).norm().asin();
            let off = (Vector3::from(found.origin.unwrap()) - origin)
                .cross(&axis)
                .norm();
            // The errors lie within 4 of the stated standard deviations, which match the noise.
            let (tilt_std, off_std) = (found.axis_std.unwrap(), found.origin_std.unwrap());
            assert!(
                tilt < 4.0 * tilt_std && tilt_std < 0.02,
                "{tilt} {tilt_std}"
            );
            assert!(off < 4.0 * off_std && off_std < 0.005, "{off} {off_std}");
            assert!((found.residual - 1.0).abs() < 0.1, "{}", found.residual);
        }
    }

    #[test]
    fn a_slide_is_found_with_its_direction() {
        let axis = Vector3::new(0.6, 0.0, 0.8);
        let found = estimate(
            &tracked(3, |t| {
                let mut pose = mean_pose();
                pose.translation.vector += axis * (0.05 * t);
                pose
            }),
            [NOISE; 2],
        )
        .unwrap();
        assert_eq!(found.joint, Joint::Prismatic, "{found:?}");
        let tilt = Vector3::from(found.axis.unwrap())
            .cross(&axis)
            .norm()
            .asin();
        assert!(tilt < 4.0 * found.axis_std.unwrap(), "{found:?}");
        assert!(found.origin.is_none());
    }

    #[test]
    fn parts_that_move_together_are_rigid() {
        for seed in 0..5 {
            let found = estimate(&tracked(seed, |_| mean_pose()), [NOISE; 2]).unwrap();
            assert_eq!(found.joint, Joint::Rigid, "{found:?}");
            assert!(found.axis.is_none() && found.origin.is_none());
        }
        let still = tracked(0, |_| mean_pose());
        for few in [0, 2] {
            let error = estimate(&still[..few], [NOISE; 2]).unwrap_err().to_string();
            assert!(
                error.ends_with(&format!("{few}, where 3 are needed")),
                "{error}"
            );
        }
        let exact = Noise {
            position: 0.0,
            rotation: 0.0,
        };
        let error = estimate(&still, [exact; 2]).unwrap_err().to_string();
        assert!(error.contains("must be above 0"), "{error}");
    }
}
