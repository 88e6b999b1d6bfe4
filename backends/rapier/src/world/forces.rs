//! Forces on bodies in one physics step: those of a rollout and a hook, and the resistance of
//! contacts.

use asid_core::layout::JointKind;
use nalgebra::Vector3;

use super::World;
use crate::compiled::Compiled;
use crate::contact::Touching;
use crate::convert;

/// Largest force (N) or torque (N m) on a body. Up to it, the resulting velocity can be squared in
/// single precision; above it rapier ignores the force.
pub(super) const MAX_FORCE: f64 = 1e15;

impl World {
    /// Adds a force (N) and a torque (N m) at a body's centre of mass for this step.
    pub(super) fn push(
        &mut self,
        compiled: &Compiled,
        body: usize,
        force: &Vector3<f64>,
        torque: &Vector3<f64>,
    ) {
        let Some(handle) = compiled.bodies[body] else {
            return;
        };
        if force.amax().max(torque.amax()) > MAX_FORCE {
            self.excess = Some(body);
            return;
        }
        if let Some(rigid) = self.state.bodies.get_mut(handle)
            && rigid.is_dynamic()
        {
            rigid.add_force(convert::to_vector(force), false);
            rigid.add_torque(convert::to_vector(torque), false);
            self.pushed.push(handle);
        }
    }

    /// Adds the generalised forces of free and ball joints; those of hinges and
    /// slides go through their drives.
    pub(super) fn push_generalised(&mut self, compiled: &Compiled) {
        for joint in &compiled.joints {
            let f = &self.force[joint.qvel..joint.qvel + joint.kind.qvel_len()];
            if f.iter().all(|&x| x == 0.0) {
                continue;
            }
            let motion = self.state.motion(compiled, joint.body);
            match joint.kind {
                JointKind::Free => {
                    let force = Vector3::new(f[0], f[1], f[2]);
                    let torque = motion.rotation * Vector3::new(f[3], f[4], f[5]);
                    let moved = torque + (motion.position - motion.center).cross(&force);
                    self.push(compiled, joint.body, &force, &moved);
                }
                JointKind::Ball => {
                    let torque = motion.rotation * Vector3::new(f[0], f[1], f[2]);
                    self.push(compiled, joint.body, &Vector3::zeros(), &torque);
                    self.push(compiled, joint.parent, &Vector3::zeros(), &-torque);
                }
                JointKind::Hinge | JointKind::Slide => {}
            }
        }
    }

    /// Adds the rolling and torsional resistance of contacts.
    pub(super) fn resist(&mut self, compiled: &Compiled) {
        let mut torques = std::mem::take(&mut self.torques);
        torques.clear();
        let mut resistance = std::mem::take(&mut self.state.resistance);
        let state = &self.state;
        resistance.torques(
            &compiled.pairs,
            &self.tables.friction,
            &Touching {
                narrow_phase: &state.narrow_phase,
                colliders: &state.colliders,
                body_of: &compiled.body_of_geom,
                body: &|i| state.body(compiled, i),
            },
            compiled.layout.timestep as f32,
            &mut torques,
        );
        self.state.resistance = resistance;
        for (body, torque) in &torques {
            self.push(
                compiled,
                *body,
                &Vector3::zeros(),
                &convert::vector(*torque),
            );
        }
        self.torques = torques;
    }
}
