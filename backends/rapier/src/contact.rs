//! Forces of contacts: the normal force that is recorded, and the resistance to
//! rolling and spinning that rapier lacks.
//!
//! A pair with `condim` 4 or 6 resists spinning about its normal with at most
//! `friction[1] * N`, one with 6 also rolling with at most `friction[2] * N` (N m,
//! for a normal force N). It is applied as a pair of torques in the following
//! step, from this step's normal force: proportional to the relative rotation up
//! to what would just stop it, with a slow integral part so that a body at rest on
//! a slope stays there without creeping, and the whole clamped to its bound. The
//! bounds of sliding, spinning and rolling are independent, where MuJoCo's
//! elliptic cone joins them.

use rapier3d::dynamics::RigidBody;
use rapier3d::geometry::{ColliderSet, NarrowPhase};
use rapier3d::math::Vector;
use rapier3d::utils::AngularInertiaOps;

use crate::pairs::{Friction, PairTable};

/// Part of a relative rotation that one step takes out.
const STOPPING: f32 = 0.7;

/// Part of a relative rotation whose stopping torque is remembered.
const HOLDING: f32 = 0.1;

/// Normal force between the geoms of two bodies in the last step, N.
pub fn normal_force(
    narrow_phase: &NarrowPhase,
    colliders: &ColliderSet,
    body_of: &[usize],
    bodies: [usize; 2],
    dt: f64,
) -> f64 {
    let mut impulse = 0.0;
    for pair in narrow_phase.contact_pairs() {
        let a = body_of[colliders[pair.collider1].user_data as usize];
        let b = body_of[colliders[pair.collider2].user_data as usize];
        if [a, b] != bodies && [b, a] != bodies {
            continue;
        }
        for manifold in pair.manifolds() {
            impulse += manifold
                .points
                .iter()
                .map(|p| f64::from(p.data.impulse))
                .sum::<f64>();
        }
    }
    impulse / dt
}

/// What the resistance of contacts is computed from.
pub struct Touching<'a> {
    /// Contacts with the impulses of the last step.
    pub narrow_phase: &'a NarrowPhase,
    /// Shapes.
    pub colliders: &'a ColliderSet,
    /// Body of each geom.
    pub body_of: &'a [usize],
    /// The rigid body of a body of the layout.
    pub body: &'a dyn Fn(usize) -> Option<&'a RigidBody>,
}

/// Torque that the resistance of one contact remembers, and where it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    pair: (u32, u32),
    torque: Vector,
}

/// What resists rolling and spinning, from step to step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Resistance {
    held: Vec<Held>,
    /// Those of the step before; kept for its memory.
    before: Vec<Held>,
}

impl Resistance {
    /// Adds to `torques` what the contacts of the last step let act in the coming
    /// one: geom's body (index in the layout) and torque in the world frame, N m.
    pub fn torques(
        &mut self,
        table: &PairTable,
        friction: &[Friction],
        touching: &Touching<'_>,
        dt: f32,
        torques: &mut Vec<(usize, Vector)>,
    ) {
        if !table.resists() {
            return;
        }
        let Touching {
            narrow_phase,
            colliders,
            body_of,
            body,
        } = touching;
        let angular_velocity = |i: usize| body(i).map_or(Vector::ZERO, RigidBody::angvel);
        let inverse_inertia = |i: usize, axis: Vector| {
            body(i).map_or(0.0, |b| {
                let inverse = &b.mass_properties().effective_world_inv_inertia;
                inverse.transform_vector(axis).dot(axis)
            })
        };
        std::mem::swap(&mut self.held, &mut self.before);
        self.held.clear();
        for pair in narrow_phase.contact_pairs() {
            let a = colliders[pair.collider1].user_data as usize;
            let b = colliders[pair.collider2].user_data as usize;
            let (mu, condim) = table.friction(friction, a, b);
            if condim < 4 {
                continue;
            }
            let (mut load, mut normal) = (0.0, Vector::ZERO);
            for manifold in pair.manifolds() {
                let impulse: f32 = manifold.points.iter().map(|p| p.data.impulse).sum();
                load += impulse / dt;
                normal += manifold.data.normal * impulse;
            }
            if load <= 0.0 {
                continue;
            }
            let normal = normal.normalize_or_zero();
            let (first, second) = (body_of[a], body_of[b]);
            let relative = angular_velocity(second) - angular_velocity(first);
            let key = (a as u32, b as u32);
            let held = self
                .before
                .iter()
                .find(|h| h.pair == key)
                .map_or(Vector::ZERO, |h| h.torque);
            let spin = normal * relative.dot(normal);
            let parts = [
                (spin, normal * held.dot(normal), mu[1]),
                (
                    relative - spin,
                    held - normal * held.dot(normal),
                    if condim >= 6 { mu[2] } else { 0.0 },
                ),
            ];
            let mut keep = Vector::ZERO;
            for (rate, held, coefficient) in parts {
                let bound = coefficient * load;
                let direction = rate.normalize_or_zero();
                let inverse =
                    inverse_inertia(first, direction) + inverse_inertia(second, direction);
                let stop = if inverse > 0.0 {
                    rate / (inverse * dt)
                } else {
                    Vector::ZERO
                };
                let wanted = held - stop * STOPPING;
                let torque = wanted.clamp_length_max(bound);
                let sliding = torque != wanted;
                let next = if sliding { held } else { held - stop * HOLDING };
                keep += next.clamp_length_max(bound);
                torques.push((second, torque));
                torques.push((first, -torque));
            }
            self.held.push(Held {
                pair: key,
                torque: keep,
            });
        }
    }
}
