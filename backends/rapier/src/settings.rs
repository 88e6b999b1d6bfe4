//! Solver settings of rapier for physics that is measured rather than played.
//!
//! rapier's own defaults are for games. The tests of this crate determined these values: friction
//! within 3 % of Coulomb's law, no creep, a grip that holds, at the highest speed that achieves all
//! that.

use rapier3d::dynamics::{FrictionModel, IntegrationParameters, SpringCoefficients};

/// Longest substep, s. rapier integrates each substep and solves its constraints once in it. A
/// pushed rod ends within 0.3 mm of the result with a quarter of this, at three times the speed.
const SUBSTEP: f64 = 1e-3;

/// Natural frequency of a contact, Hz. It sets the stiffness of a grip and the rate at which
/// penetration is corrected. A body at rest sinks in by g over its angular square, 6 µm.
const CONTACT_FREQUENCY: f32 = 200.0;

/// Damping ratio of a contact: heavily overdamped, so that nothing bounces.
const CONTACT_DAMPING: f32 = 5.0;

/// Distance at which contacts are prepared, m: more than 2 m/s covers in a step of 2 ms.
const PREDICTION: f32 = 0.005;

/// Fastest recovery from penetration, m/s; slow, so that an overlapping start
/// does not explode.
const RECOVERY_SPEED: f32 = 0.5;

/// Speed beyond which a simulation counts as diverged, m/s, because rapier silently clamps
/// velocities to it.
pub const MAX_SPEED: f32 = 400.0;

/// Solver settings for a physics step of `dt` seconds.
pub fn integration_parameters(dt: f64) -> IntegrationParameters {
    let softness = SpringCoefficients::new(CONTACT_FREQUENCY, CONTACT_DAMPING);
    IntegrationParameters {
        dt: dt as f32,
        min_ccd_dt: dt as f32,
        contact_softness: softness,
        static_contact_softness: softness,
        num_solver_iterations: ((dt / SUBSTEP - 1e-6).ceil() as usize).max(2),
        normalized_allowed_linear_error: 1e-4,
        normalized_max_corrective_velocity: RECOVERY_SPEED,
        normalized_prediction_distance: PREDICTION,
        normalized_max_linear_velocity: MAX_SPEED,
        max_ccd_substeps: 0,
        contact_clustering: false,
        contact_recycling: false,
        friction_model: FrictionModel::Coulomb,
        ..IntegrationParameters::default()
    }
}
