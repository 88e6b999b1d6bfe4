//! When a simulation counts as diverged.

use super::World;
use crate::compiled::Compiled;
use crate::settings::MAX_SPEED;

/// Position beyond which a simulation counts as diverged, m.
const MAX_POSITION: f32 = 1e4;

/// Angular or joint velocity beyond which a simulation counts as diverged, rad/s.
const MAX_RATE: f32 = 1e4;

impl World {
    /// Why the state is outside the plausible range; `None` if it is inside.
    pub(super) fn complaint(&self, compiled: &Compiled) -> Option<String> {
        let quarantine = self.pipeline.quarantine();
        if !quarantine.is_empty() {
            return Some("a body's position is not finite".into());
        }
        for multibody in self.state.multibodies.multibodies() {
            let fast = multibody
                .generalized_velocity()
                .iter()
                .any(|v| !v.is_finite() || v.abs() > MAX_RATE);
            if fast {
                return Some(format!("a joint moves faster than {MAX_RATE} rad/s"));
            }
        }
        for (index, handle) in compiled.bodies.iter().enumerate() {
            let Some(body) = handle.and_then(|h| self.state.bodies.get(h)) else {
                continue;
            };
            let name = &compiled.layout.bodies[index];
            let position = body.translation();
            if !position.is_finite() || position.abs().max_element() > MAX_POSITION {
                return Some(format!("body `{name}` is farther than {MAX_POSITION} m"));
            }
            let (linear, angular) = (body.linvel(), body.angvel());
            if !linear.is_finite() || linear.length() > 0.99 * MAX_SPEED {
                return Some(format!("body `{name}` moves faster than {MAX_SPEED} m/s"));
            }
            if !angular.is_finite() || angular.length() > MAX_RATE {
                return Some(format!("body `{name}` turns faster than {MAX_RATE} rad/s"));
            }
        }
        None
    }
}
