//! What a drive remembers of the time before its log.

use crate::latent_force::context::Context;

use super::Estimate;

/// Time from a log's first row on within which a drive's past counts, s: rotors of servos settle behind a spring or a gap, and commands arrive, within
/// some tens of milliseconds. Longer: more of each log says nothing of its driven joints.
const SECONDS: f64 = 0.05;

impl Estimate {
    /// Lets any force as large as its inertial ones act on each driven joint that moves at its log's first row, while its drive still shows what was
    /// before, in every model alike. Where a rotor stands behind its spring or in its gap, and which commands are on their way, no log
    /// says; a model begins as if the first command had been held for long, and a joint that moves has not stood so. What that leaves rings on, and the
    /// name that explains the rest of the log would be the less likely for it.
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
