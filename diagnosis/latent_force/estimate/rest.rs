//! Joints at rest: the forces that may hold them.

use crate::latent_force::context::Context;

use super::Estimate;

/// Largest speed of a joint at rest, in standard deviations of its estimate.
const REST_DEVIATIONS: f64 = 3.0;
/// The same relative to the joint's largest speed.
const REST_SHARE: f64 = 0.02;
/// Standard deviations of the sign test's count from which the sign of a force against the motion
/// is certain; with fewer than nine rows it never is.
const SURE: f64 = 3.0;

impl Estimate {
    /// Returns the speed of a degree of freedom in a row of a walk.
    pub(super) fn speed(&self, context: &Context<'_>, walk: usize, row: usize, dof: usize) -> f64 {
        let layout = &context.plant().layout;
        self.trajectory[walk][row * (layout.nq + layout.nv) + layout.nq + dof]
    }

    /// Returns the speed below which each degree of freedom counts as at rest.
    #[must_use]
    pub fn rest_speeds(&self, context: &Context<'_>) -> Vec<f64> {
        let nv = context.plant().layout.nv;
        // Segments have no variances along their rows.
        let walks = self.smoothed.iter().zip(&context.walks);
        let smoothed: Vec<_> = walks.filter(|(_, w)| w.segment.is_none()).collect();
        (0..nv)
            .map(|d| {
                let mut variances: Vec<f64> = smoothed
                    .iter()
                    .flat_map(|(s, _)| s.change_variance.iter().skip(nv + d).step_by(2 * nv))
                    .copied()
                    .collect();
                let typical = crate::noise::median(&mut variances).unwrap_or(0.0).sqrt();
                (REST_DEVIATIONS * typical).max(REST_SHARE * context.scale[nv + d])
            })
            .collect()
    }

    /// Returns the dry friction that a joint shows where it moves faster than at rest.
    ///
    /// This is the median missing force against its motion where its sign is certain, averaged over
    /// the directions. A force that always acts opposes only one of them.
    fn friction_shown(&self, context: &Context<'_>, dof: usize, rest: f64) -> f64 {
        let nv = context.plant().layout.nv;
        let mut against = [Vec::new(), Vec::new()];
        let walks = self.smoothed.iter().zip(&context.walks).enumerate();
        for (w, (smoothed, _)) in walks.filter(|(_, (_, walk))| walk.segment.is_none()) {
            for (row, forces) in smoothed.force.chunks_exact(nv).enumerate() {
                let speed = self.speed(context, w, row, dof);
                if speed.abs() > rest {
                    against[usize::from(speed > 0.0)].push(-forces[dof] * speed.signum());
                }
            }
        }
        let shown: Vec<f64> = against
            .iter_mut()
            .filter_map(|a| certain_median(a))
            .collect();
        shown.iter().sum::<f64>().max(0.0) / shown.len().max(1) as f64
    }

    /// Lets any force as large as the dry friction of the moving rows hold a joint at rest, in
    /// every model alike.
    ///
    /// At rest, friction is any force within its cone, and carries no information about its size.
    pub fn free_at_rest(&mut self, context: &Context<'_>) {
        let layout = &context.plant().layout;
        let nv = layout.nv;
        let rest = self.rest_speeds(context);
        let mut free: Vec<Vec<f64>> = context
            .walks
            .iter()
            .map(|w| vec![0.0; if w.segment.is_some() { 0 } else { w.len() * nv }])
            .collect();
        for joint in context.plant().scalar_joints() {
            let d = layout.joints[joint].qvel;
            let friction = self.friction_shown(context, d, rest[d]);
            for (w, free) in free.iter_mut().enumerate() {
                for k in 0..free.len() / nv {
                    if self.speed(context, w, k, d).abs() <= rest[d] {
                        free[k * nv + d] = friction * friction;
                    }
                }
            }
        }
        self.free = free;
    }
}

/// Returns the median of some values, or zero where the sign test leaves its sign open; `None` if
/// there are too few for any sign to be certain.
fn certain_median(values: &mut [f64]) -> Option<f64> {
    let positive = values.iter().filter(|x| **x > 0.0).count() as f64;
    let n = values.len() as f64;
    let open = SURE * n.sqrt();
    if n < open.max(1.0) {
        return None;
    }
    if (2.0 * positive - n).abs() < open {
        return Some(0.0);
    }
    crate::noise::median(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_certain_where_few_values_have_the_other_sign() {
        let values = |n: u32| (1..=n).map(f64::from).collect::<Vec<f64>>();
        assert_eq!(certain_median(&mut []), None);
        assert_eq!(certain_median(&mut values(8)), None);
        assert_eq!(certain_median(&mut values(9)), Some(5.0));
        // Of a hundred, 65 to 35 is certain and 64 to 36 is not.
        let signed = |positive: u32| -> Vec<f64> {
            let sign = |k| if k < positive { 1.0 } else { -1.0 };
            (0..100).map(sign).collect()
        };
        assert_eq!(certain_median(&mut signed(65)), Some(1.0));
        assert_eq!(certain_median(&mut signed(64)), Some(0.0));
        assert_eq!(certain_median(&mut signed(35)), Some(-1.0));
    }
}
