//! Effects that need no engine to become columns: what they add to forces and commands along a trajectory.
//!
//! An effect on the command path, or one that only adds forces, is driven along the smoothed states and the logged
//! commands, physics step by physics step, so that what it remembers is right; its column follows by the slopes of the model in forces and
//! commands.

use asid_core::Result;
use asid_core::simulator::StepView;
use asid_effects::{Acts, Site};
use asid_mjcf::Plant;

use crate::candidate::Candidate;

use super::walk::Walk;

/// What an effect adds in each row of one walk.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// Generalized forces, mean over the row, `(rows - 1) x nv`.
    pub force: Vec<f64>,
    /// Changes of the commands, mean over the row, `(rows - 1) x nu`.
    pub command: Vec<f64>,
}

/// Whether a candidate acts through forces and commands alone.
#[must_use]
pub fn is_traceable(plant: &Plant, candidate: &Candidate) -> bool {
    let effect = &candidate.effect;
    matches!(effect.acts(), Acts::Force) && effect.targets(plant, &candidate.spec.site).is_empty()
}

/// Drives a candidate with some values along a walk's states (`rows x (nq + nv)`).
///
/// # Errors
/// When a value makes no sense.
pub fn trace(
    plant: &Plant,
    candidate: &Candidate,
    values: &[f64],
    walk: &Walk,
    states: &[f64],
) -> Result<Traced> {
    let layout = &plant.layout;
    let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
    let mut acting = candidate.effect.attach(&Site {
        plant,
        name: &candidate.spec.site,
        values,
        columns: &[],
    })?;
    acting.restart();
    let steps = walk.len() - 1;
    let mut out = Traced {
        force: vec![0.0; steps * nv],
        command: vec![0.0; steps * nu],
    };
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
            let forces = &mut out.force[k * nv..(k + 1) * nv];
            forces
                .iter_mut()
                .zip(&force)
                .for_each(|(o, f)| *o += share * f);
            let commands = &mut out.command[k * nu..(k + 1) * nu];
            for (o, (c, u)) in commands.iter_mut().zip(ctrl.iter().zip(logged)) {
                *o += share * (c - u);
            }
        }
    }
    Ok(out)
}
