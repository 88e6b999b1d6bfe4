//! Least-squares fit of one kind of joint to relative poses.

use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};

use super::{Joint, Noise};

/// Number of fitted entries of the mean pose; entries of axis and origin follow them.
pub const POSE: usize = 6;

/// Maximum number of least-squares steps.
const STEPS: usize = 30;

/// Step of the difference quotients, m or rad.
const DELTA: f64 = 1e-6;

/// A relative pose and the matrix that whitens its residual.
pub struct Reading {
    pose: Isometry3<f64>,
    whitener: Matrix6<f64>,
}

impl Reading {
    /// Reading with the noise of both trackers; `None` where the noise is zero.
    pub fn new(pose: Isometry3<f64>, [fixed, moving]: [Noise; 2]) -> Option<Self> {
        let arm = pose.translation.vector.cross_matrix();
        let (a, b) = (fixed.rotation.powi(2), moving.rotation.powi(2));
        let place = fixed.position.powi(2) + moving.position.powi(2);
        let mut covariance = Matrix6::zeros();
        let eye = Matrix3::identity();
        covariance
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(eye * place + arm * arm.transpose() * a));
        covariance
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(-arm * a));
        covariance
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&(-arm.transpose() * a));
        covariance
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&(eye * (a + b)));
        let whitener = covariance.cholesky()?.l().try_inverse()?;
        Some(Self { pose, whitener })
    }

    /// Whitened residual of this reading against a predicted pose.
    fn residual(&self, predicted: &Isometry3<f64>) -> Vector6<f64> {
        let shift = self.pose.translation.vector - predicted.translation.vector;
        let turn = (self.pose.rotation * predicted.rotation.inverse()).scaled_axis();
        self.whitener * Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
    }
}

/// Mean pose, axis and origin: one point of the least-squares search.
#[derive(Clone)]
pub struct Trial {
    /// The kind of joint.
    pub joint: Joint,
    /// Relative pose where the joint's coordinate is zero.
    pub mean: Isometry3<f64>,
    /// Unit vector along the axis.
    pub axis: Vector3<f64>,
    /// A point of the axis, m.
    pub origin: Vector3<f64>,
}

impl Trial {
    fn entries(&self) -> usize {
        match self.joint {
            Joint::Rigid => POSE,
            Joint::Prismatic => POSE + 2,
            Joint::Revolute => POSE + 4,
        }
    }

    /// The trial after a step: position and rotation of the mean pose, then the tilt of the axis
    /// and the shift of the origin across it.
    fn moved(&self, step: &[f64]) -> Self {
        let mut out = self.clone();
        out.mean.translation.vector += Vector3::new(step[0], step[1], step[2]);
        let turn = Vector3::new(step[3], step[4], step[5]);
        out.mean.rotation = UnitQuaternion::from_scaled_axis(turn) * out.mean.rotation;
        let [u, v] = across(&self.axis);
        if step.len() >= POSE + 2 {
            out.axis = (self.axis + u * step[6] + v * step[7]).normalize();
        }
        if step.len() >= POSE + 4 {
            out.origin += u * step[8] + v * step[9];
        }
        out
    }

    /// Relative pose where the joint's coordinate is `q` (0 at the mean pose).
    fn pose(&self, q: f64) -> Isometry3<f64> {
        match self.joint {
            Joint::Rigid => self.mean,
            Joint::Prismatic => {
                let mut pose = self.mean;
                pose.translation.vector += self.axis * q;
                pose
            }
            Joint::Revolute => {
                let turn = UnitQuaternion::from_scaled_axis(self.axis * q);
                let arm = self.mean.translation.vector - self.origin;
                Isometry3::from_parts((self.origin + turn * arm).into(), turn * self.mean.rotation)
            }
        }
    }

    /// Residuals of all readings, with the best joint coordinate for each.
    fn residuals(&self, readings: &[Reading], q: &mut [f64]) -> DVector<f64> {
        let mut out = DVector::zeros(6 * readings.len());
        for (k, reading) in readings.iter().enumerate() {
            let mut r = reading.residual(&self.pose(q[k]));
            if self.joint != Joint::Rigid {
                for _ in 0..4 {
                    let slope = (reading.residual(&self.pose(q[k] + DELTA)) - r) / DELTA;
                    let step = -slope.dot(&r) / slope.norm_squared().max(1e-12);
                    q[k] += step;
                    r = reading.residual(&self.pose(q[k]));
                    if step.abs() < 1e-10 {
                        break;
                    }
                }
            }
            out.rows_mut(6 * k, 6).copy_from(&r);
        }
        out
    }
}

/// Two unit vectors perpendicular to the axis and to each other.
fn across(axis: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let other = if axis.x.abs() < 0.7 {
        Vector3::x()
    } else {
        Vector3::y()
    };
    let u = axis.cross(&other).normalize();
    [u, axis.cross(&u)]
}

/// A fitted kind of joint.
pub struct Fit {
    /// Mean pose, axis and origin.
    pub trial: Trial,
    /// The joint's coordinate at each reading: rad or m from the mean pose, zero for a rigid joint.
    pub q: Vec<f64>,
    /// Half of the sum of squares of the whitened residuals.
    pub loss: f64,
    /// Bayesian information criterion.
    pub bic: f64,
    /// Covariance of the trial's entries, where the readings determine it.
    pub covariance: Option<DMatrix<f64>>,
}

/// Principal direction of vectors: the one in which they spread most.
fn principal(vectors: impl Iterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let spread: Matrix3<f64> = vectors.map(|v| v * v.transpose()).sum();
    let eigen = spread.symmetric_eigen();
    eigen
        .eigenvectors
        .column(eigen.eigenvalues.imax())
        .into_owned()
}

/// Initial trial, and the joint coordinates in it.
fn first(joint: Joint, readings: &[Reading]) -> (Trial, Vec<f64>) {
    let n = readings.len() as f64;
    let places = || readings.iter().map(|r| r.pose.translation.vector);
    let center = places().sum::<Vector3<f64>>() / n;
    // Mean rotation, iterated from the middle reading.
    let mut rotation = readings[readings.len() / 2].pose.rotation;
    for _ in 0..10 {
        let off = |r: &Reading| (r.pose.rotation * rotation.inverse()).scaled_axis();
        let mean = readings.iter().map(off).sum::<Vector3<f64>>() / n;
        rotation = UnitQuaternion::from_scaled_axis(mean) * rotation;
    }
    let turns = || {
        readings
            .iter()
            .map(|r| (r.pose.rotation * rotation.inverse()).scaled_axis())
    };
    let mut trial = Trial {
        joint,
        mean: Isometry3::from_parts(center.into(), rotation),
        axis: Vector3::x(),
        origin: center,
    };
    match joint {
        Joint::Rigid => (trial, vec![0.0; readings.len()]),
        Joint::Prismatic => {
            trial.axis = principal(places().map(|p| p - center));
            let q = places().map(|p| trial.axis.dot(&(p - center))).collect();
            (trial, q)
        }
        Joint::Revolute => {
            trial.axis = principal(turns());
            let q: Vec<f64> = turns().map(|t| trial.axis.dot(&t)).collect();
            // p = (1 - R) origin + R mean, linear in both; the origin's position along the axis is
            // free.
            let mut normal = nalgebra::Matrix6::<f64>::identity() * 1e-6;
            let mut right = Vector6::zeros();
            for (angle, p) in q.iter().zip(places()) {
                let turn = UnitQuaternion::from_scaled_axis(trial.axis * *angle);
                let turn = turn.to_rotation_matrix().into_inner();
                let mut a = nalgebra::Matrix3x6::zeros();
                a.fixed_view_mut::<3, 3>(0, 0)
                    .copy_from(&(Matrix3::identity() - turn));
                a.fixed_view_mut::<3, 3>(0, 3).copy_from(&turn);
                normal += a.transpose() * a;
                // The origin is sought as an offset from the mean position of the moving part.
                right += a.transpose() * (p - center);
            }
            if let Some(x) = normal.cholesky().map(|c| c.solve(&right)) {
                trial.origin = center + Vector3::new(x[0], x[1], x[2]);
                trial.mean.translation.vector = center + Vector3::new(x[3], x[4], x[5]);
            }
            (trial, q)
        }
    }
}

/// The best fit of a kind of joint, by Levenberg-Marquardt steps.
pub fn fit(joint: Joint, readings: &[Reading]) -> Fit {
    let (mut trial, mut q) = first(joint, readings);
    let entries = trial.entries();
    let mut residual = trial.residuals(readings, &mut q);
    let mut loss = 0.5 * residual.norm_squared();
    let mut damping = 1e-3;
    let mut covariance = None;
    for _ in 0..STEPS {
        let mut jacobian = DMatrix::zeros(residual.len(), entries);
        for i in 0..entries {
            let mut step = vec![0.0; entries];
            step[i] = DELTA;
            let up = trial.moved(&step).residuals(readings, &mut q.clone());
            jacobian.set_column(i, &((up - &residual) / DELTA));
        }
        let normal = jacobian.transpose() * &jacobian;
        let gradient = jacobian.transpose() * &residual;
        // The floor keeps entries that the readings do not determine where they are.
        let floor = DMatrix::identity(entries, entries) * 1e-6;
        covariance = (&normal + &floor).cholesky().map(|c| c.inverse());
        let mut scaled = &normal + floor;
        for i in 0..entries {
            scaled[(i, i)] += damping * normal[(i, i)];
        }
        let Some(step) = scaled.cholesky().map(|c| c.solve(&-gradient)) else {
            break;
        };
        let next = trial.moved(step.as_slice());
        let mut next_q = q.clone();
        let next_residual = next.residuals(readings, &mut next_q);
        let next_loss = 0.5 * next_residual.norm_squared();
        if next_loss < loss {
            let done = loss - next_loss < 1e-6;
            (trial, q, residual, loss) = (next, next_q, next_residual, next_loss);
            damping *= 0.2;
            if done {
                break;
            }
        } else {
            damping *= 8.0;
        }
    }
    // The mean pose already accounts for one coordinate.
    let coordinates = if joint == Joint::Rigid {
        0
    } else {
        readings.len() - 1
    };
    let data = (6 * readings.len()) as f64;
    Fit {
        bic: 2.0 * loss + (entries + coordinates) as f64 * data.ln(),
        trial,
        q,
        loss,
        covariance,
    }
}
