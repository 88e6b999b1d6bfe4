//! Joints that stand: what may hold them.

use crate::latent_force::context::Context;

use super::Estimate;

/// Speed up to which a joint counts as at rest, in deviations of its estimate.
const REST_DEVIATIONS: f64 = 3.0;
/// The same relative to its largest speed.
const REST_SHARE: f64 = 0.02;

impl Estimate {
    /// Speed of a degree of freedom in a row of a walk.
    pub(super) fn speed(&self, context: &Context<'_>, walk: usize, row: usize, dof: usize) -> f64 {
        let layout = &context.plant().layout;
        self.trajectory[walk][row * (layout.nq + layout.nv) + layout.nq + dof]
    }

    /// Speed up to which each degree of freedom counts as at rest.
    #[must_use]
    pub fn rest_speeds(&self, context: &Context<'_>) -> Vec<f64> {
        let nv = context.plant().layout.nv;
        (0..nv)
            .map(|d| {
                let mut variances: Vec<f64> = self
                    .smoothed
                    .iter()
                    .flat_map(|s| s.change_variance.iter().skip(nv + d).step_by(2 * nv))
                    .copied()
                    .collect();
                let typical = crate::noise::median(&mut variances).unwrap_or(0.0).sqrt();
                (REST_DEVIATIONS * typical).max(REST_SHARE * context.scale[nv + d])
            })
            .collect()
    }

    /// Lets joints that stand be held by any force as large as the dry friction that moving rows show, in
    /// every model alike: at rest friction is any force within its cone, and says nothing of its size.
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
            let mut against = Vec::new();
            for (w, smoothed) in self.smoothed.iter().enumerate() {
                for k in 0..free[w].len() / nv {
                    let speed = self.speed(context, w, k, d);
                    if speed.abs() > rest[d] {
                        against.push(-smoothed.force[k * nv + d] * speed.signum());
                    }
                }
            }
            let friction = crate::noise::median(&mut against).unwrap_or(0.0).max(0.0);
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
