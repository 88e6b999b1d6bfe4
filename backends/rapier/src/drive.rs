//! Drives, springs, dampers and rotor inertias of hinges and slides.
//!
//! All forces linear in a joint's position and velocity form one implicit spring and damper of the
//! multibody: servo gains, passive springs and damping. rapier adds them to the mass matrix. Stiff
//! gains are therefore stable, and the coupled joints are solved exactly, unlike with its motor
//! constraints, which it solves one by one. A force that is constant over the step shifts the
//! spring's rest position.
//!
//! A servo at its force limit is a constant force. As in MuJoCo, the force demanded by the state at
//! the start of the step is clamped. A servo with a strong damper counts as saturated only if the
//! force that it would reach at the end of the step is beyond the limit too. Otherwise it would
//! switch between its limits from one step to the next.

use asid_core::layout::JointKind;
use mjcf_rs::extras::ActuatorKind;

use crate::compiled::Compiled;
use crate::coordinates::axis;
use crate::slot::{ActuatorSlot, JointSlot};
use crate::state::State;
use crate::tables::{ActuatorValues, Tables};

/// Stiffness that carries a constant force where a joint has no spring, with a far-away rest
/// position. It is too soft to matter and stiff enough for single precision.
const CARRIER: f64 = 1e-3;

/// Force of a joint as `constant + rest_force - stiffness q - damping v`.
#[derive(Clone, Copy, Debug, Default)]
struct Linear {
    stiffness: f64,
    /// Stiffness times rest position, summed over springs.
    rest_force: f64,
    damping: f64,
    constant: f64,
}

impl Linear {
    /// The force at a position and velocity.
    fn at(&self, q: f64, v: f64) -> f64 {
        self.constant + self.rest_force - self.stiffness * q - self.damping * v
    }

    fn add(&mut self, other: &Self) {
        self.stiffness += other.stiffness;
        self.rest_force += other.rest_force;
        self.damping += other.damping;
        self.constant += other.constant;
    }
}

/// Joint force of an actuator without its limit.
fn actuator(slot: &ActuatorSlot, values: &ActuatorValues, ctrl: f64) -> Linear {
    let ctrl = slot
        .ctrl_range
        .map_or(ctrl, |[low, high]| ctrl.clamp(low, high));
    let g = values.gear;
    match slot.kind {
        ActuatorKind::Position => Linear {
            stiffness: values.kp * g * g,
            rest_force: values.kp * g * ctrl,
            damping: values.kv * g * g,
            constant: 0.0,
        },
        ActuatorKind::Velocity => Linear {
            damping: values.kv * g * g,
            constant: values.kv * g * ctrl,
            ..Linear::default()
        },
        _ => Linear {
            constant: slot.gain * g * ctrl,
            ..Linear::default()
        },
    }
}

impl State {
    /// Sets the joint forces of the coming step.
    ///
    /// `ctrl` is `nu`; `force` is the generalised force to add, `nv` or empty.
    pub fn drive(&mut self, compiled: &Compiled, tables: &Tables, ctrl: &[f64], force: &[f64]) {
        let dt = compiled.layout.timestep;
        for (index, joint) in compiled.joints.iter().enumerate() {
            let values = &tables.joints[index];
            if joint.kind == JointKind::Free {
                continue;
            }
            let mut linear = Linear {
                stiffness: values.stiffness,
                rest_force: values.stiffness * joint.spring_rest,
                damping: values.damping,
                constant: 0.0,
            };
            if joint.kind == JointKind::Ball {
                self.install(joint, tables, index, &linear);
                continue;
            }
            let (q, v) = self.scalar(joint);
            for (slot, (values, &ctrl)) in compiled
                .actuators
                .iter()
                .zip(tables.actuators.iter().zip(ctrl))
            {
                if slot.joint != index {
                    continue;
                }
                let mut drive = actuator(slot, values, ctrl);
                if let Some([low, high]) = slot.force_range {
                    let ends = [low * values.gear, high * values.gear];
                    let (low, high) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
                    let asked = drive.at(q, v);
                    if asked < low || asked > high {
                        let stiff = dt * drive.damping + dt * dt * drive.stiffness;
                        let reached = asked / (1.0 + stiff * self.inverse_inertia(joint));
                        if reached < low || reached > high {
                            drive = Linear {
                                constant: asked.clamp(low, high),
                                ..Linear::default()
                            };
                        }
                    }
                }
                linear.add(&drive);
            }
            linear.constant += force.get(joint.qvel).copied().unwrap_or(0.0);
            self.install(joint, tables, index, &linear);
        }
    }

    /// Inverse inertia seen by a joint's force, with all other joints free.
    fn inverse_inertia(&mut self, joint: &JointSlot) -> f64 {
        let Some((multibody, id)) = joint.handle.and_then(|h| self.multibodies.get_mut(h)) else {
            return 0.0;
        };
        let inverse = multibody.dof_inverse_inertia(&self.bodies);
        multibody
            .link(id)
            .map_or(0.0, |link| f64::from(inverse[link.assembly_id()]))
    }

    fn install(&mut self, joint: &JointSlot, tables: &Tables, index: usize, linear: &Linear) {
        let values = &tables.joints[index];
        let Some((multibody, id)) = joint.handle.and_then(|h| self.multibodies.get_mut(h)) else {
            return;
        };
        let Some(link) = multibody.link_mut(id) else {
            return;
        };
        let first = link.assembly_id();
        if joint.kind != JointKind::Ball {
            let axis = axis(joint.kind);
            let q = f64::from(link.joint.coords()[axis]);
            let (stiffness, rest) = if linear.stiffness >= CARRIER {
                let rest = (linear.rest_force + linear.constant) / linear.stiffness;
                (linear.stiffness, rest - joint.reference)
            } else {
                let force = linear.at(q + joint.reference, 0.0);
                (
                    if force == 0.0 { 0.0 } else { CARRIER },
                    q + force / CARRIER,
                )
            };
            link.joint.set_spring(axis, stiffness as f32, rest as f32);
        }
        for dof in first..first + joint.kind.qvel_len() {
            multibody.damping_mut()[dof] = linear.damping as f32;
            multibody.armature_mut()[dof] = values.armature as f32;
            multibody.frictions_mut()[dof] = values.frictionloss as f32;
        }
    }
}
