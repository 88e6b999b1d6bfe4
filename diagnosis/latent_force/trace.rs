//! Effects whose columns need no engine: forces along a trajectory.
//!
//! An effect that only adds forces is evaluated along the smoothed states and the logged commands,
//! physics step by physics step, so that its memory is right. Its column follows from the model's
//! derivatives with respect to forces. (Effects on commands are excluded: a drive at its limit has
//! no derivative.)

use asid_core::Result;
use asid_core::simulator::StepView;
use asid_effects::{Acts, Site};
use asid_mjcf::Plant;

use crate::candidate::Candidate;

use super::walk::Walk;

/// Whether a candidate acts through forces alone.
#[must_use]
pub fn is_traceable(plant: &Plant, candidate: &Candidate) -> bool {
    let effect = &candidate.effect;
    matches!(effect.acts(), Acts::Force) && effect.targets(plant, &candidate.spec.site).is_empty()
}

/// Returns the generalized forces that a candidate adds along a walk, as means over its rows.
///
/// `values` are its values, `states` are `rows x (nq + nv)`, and the result is `(rows - 1) x nv`.
///
/// # Errors
/// When a value is invalid.
pub fn trace(
    plant: &Plant,
    candidate: &Candidate,
    values: &[f64],
    (walk, episode): (&Walk, usize),
    states: &[f64],
) -> Result<Vec<f64>> {
    let layout = &plant.layout;
    let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
    let mut acting = candidate.effect.attach(&Site {
        plant,
        name: &candidate.spec.site,
        values,
        columns: &[],
        episode,
    })?;
    acting.restart();
    let steps = walk.len() - 1;
    let mut out = vec![0.0; steps * nv];
    let mut ctrl = vec![0.0; nu];
    let mut force = vec![0.0; nv];
    let mut time = 0.0;
    for k in 0..steps {
        let state = &states[k * (nq + nv)..(k + 1) * (nq + nv)];
        let logged = &walk.ctrl[k * nu..(k + 1) * nu];
        let share = 1.0 / walk.substeps[k] as f64;
        for _ in 0..walk.substeps[k] {
            ctrl.copy_from_slice(logged);
            force.fill(0.0);
            acting.before_step(&mut StepView {
                time,
                qpos: &state[..nq],
                qvel: &state[nq..],
                ctrl: &mut ctrl,
                force: &mut force,
                parameters: &mut [],
            });
            time += layout.timestep;
            let forces = &mut out[k * nv..(k + 1) * nv];
            for (o, f) in forces.iter_mut().zip(&force) {
                *o += share * f;
            }
        }
    }
    Ok(out)
}
