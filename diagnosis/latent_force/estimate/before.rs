//! Free force for the state of a drive before its log.

use crate::latent_force::context::Context;

use super::Estimate;

/// Time after a log's first row during which a drive's past counts, s.
///
/// Rotors of servos settle behind a spring or a gap, and commands arrive, within some tens of
/// milliseconds. Over a longer time, more of each log would carry no information about its driven
/// joints.
const SECONDS: f64 = 0.05;

impl Estimate {
    /// Lets a force as large as its inertial forces act on each driven joint that moves at its
    /// log's first row, in every model alike.
    ///
    /// It acts while the drive still depends on its state before the log. No log records where a
    /// rotor stands behind its spring or in its gap, or which commands are on their way. A model
    /// begins as if the first command had been held for long, but a joint that moves was not at
    /// rest under it. The resulting error keeps ringing, and would lower the evidence of the effect
    /// that explains the rest of the log.
    pub fn free_at_start(&mut self, context: &Context<'_>) {
        let layout = &context.plant().layout;
        let nv = layout.nv;
        let joints = context.plant().scalar_joints();
        let driven = joints.filter(|&j| context.plant().drives_of(j).next().is_some());
        let dofs: Vec<usize> = driven.map(|j| layout.joints[j].qvel).collect();
        let rest = self.rest_speeds(context);
        let mut free = std::mem::take(&mut self.free);
        for (w, (walk, free)) in context.walks.iter().zip(&mut free).enumerate() {
            if walk.segment.is_some() || walk.rows.first() != Some(&0) {
                continue;
            }
            free.resize(walk.len() * nv, 0.0);
            let is_early = |k: &usize| walk.time[*k] - walk.time[0] < SECONDS;
            for k in (0..walk.len()).take_while(is_early) {
                for &d in &dofs {
                    if self.speed(context, w, 0, d).abs() > rest[d] {
                        free[k * nv + d] += context.inertial[d].powi(2);
                    }
                }
            }
        }
        self.free = free;
    }
}
