//! Forces of contacts: the recorded normal force, and the resistance to rolling and spinning that
//! rapier lacks.
//!
//! A pair with `condim` 4 or 6 resists spinning about its normal with at most `friction[1] * N`;
//! one with 6 also resists rolling with at most `friction[2] * N` (N m, for a normal force N). The
//! resistance is applied as a pair of torques in the following step, from this step's normal force.
//! It is proportional to the relative angular velocity, up to the torque that just stops it. A slow
//! integral part keeps a body at rest on a slope without creeping. The whole is clamped to its
//! bound. The bounds of sliding, spinning and rolling are independent, whereas MuJoCo's elliptic
//! cone couples them.

use rapier3d::dynamics::RigidBody;
use rapier3d::geometry::{ColliderSet, ContactPair, NarrowPhase};
use rapier3d::math::Vector;
use rapier3d::utils::AngularInertiaOps;

use crate::pairs::{Friction, PairTable};

/// Fraction of a relative angular velocity that one step removes.
const STOPPING: f32 = 0.7;

/// Fraction of a relative angular velocity whose stopping torque is remembered.
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

/// Inputs of the contacts' resistance.
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

/// Torque remembered by one contact, and where it acts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    pair: (u32, u32),
    torque: Vector,
}

/// Resistance to rolling and spinning, kept from step to step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Resistance {
    held: Vec<Held>,
    /// The torques of the step before, kept to reuse the memory.
    before: Vec<Held>,
}

impl Resistance {
    /// Adds to `torques` the contact torques of the coming step, from the contacts of the last one.
    ///
    /// Each entry is the geom's body (index in the layout) and the torque in the world frame, N m.
    pub fn torques(
        &mut self,
        table: &PairTable,
        friction: &[Friction],
        touching: &Touching<'_>,
        dt: f32,
        torques: &mut Vec<(usize, Vector)>,
    ) {
        if !table.has_rolling_or_spinning_friction() {
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
            let (load, normal) = pressing(pair, dt);
            if load <= 0.0 {
                continue;
            }
            let rolling = if condim >= 6 { mu[2] } else { 0.0 };
            let (first, second) = (body_of[a], body_of[b]);
            let key = (a as u32, b as u32);
            let before = self.before.iter().find(|h| h.pair == key);
            let turning = Turning {
                normal,
                relative: angular_velocity(second) - angular_velocity(first),
                bounds: [mu[1] * load, rolling * load],
                held: before.map_or(Vector::ZERO, |h| h.torque),
            };
            let both = |axis| inverse_inertia(first, axis) + inverse_inertia(second, axis);
            let (resisting, torque) = turning.resist(both, dt);
            for torque in resisting {
                torques.push((second, torque));
                torques.push((first, -torque));
            }
            self.held.push(Held { pair: key, torque });
        }
    }
}

/// Normal force between two shapes in the last step, N, and its direction.
fn pressing(pair: &ContactPair, dt: f32) -> (f32, Vector) {
    let (mut load, mut normal) = (0.0, Vector::ZERO);
    for manifold in pair.manifolds() {
        let impulse: f32 = manifold.points.iter().map(|p| p.data.impulse).sum();
        load += impulse / dt;
        normal += manifold.data.normal * impulse;
    }
    (load, normal.normalize_or_zero())
}

/// A contact whose bodies rotate relative to each other.
struct Turning {
    /// Direction of the normal force.
    normal: Vector,
    /// Angular velocity of the second body relative to the first, rad/s.
    relative: Vector,
    /// Largest torques against spinning and against rolling, N m.
    bounds: [f32; 2],
    /// Remembered torque, N m.
    held: Vector,
}

impl Turning {
    /// Computes one contact: the torques on the second body against spinning and against rolling,
    /// and the torque to remember, N m.
    ///
    /// `inverse_inertia` is that of both bodies together about an axis, 1/(kg m²).
    fn resist(&self, inverse_inertia: impl Fn(Vector) -> f32, dt: f32) -> ([Vector; 2], Vector) {
        let spin = self.normal * self.relative.dot(self.normal);
        let twist = self.normal * self.held.dot(self.normal);
        let parts = [(spin, twist), (self.relative - spin, self.held - twist)];
        let (mut torques, mut keep) = ([Vector::ZERO; 2], Vector::ZERO);
        for (i, (rate, held)) in parts.into_iter().enumerate() {
            let inverse = inverse_inertia(rate.normalize_or_zero());
            let stop = if inverse > 0.0 {
                rate / (inverse * dt)
            } else {
                Vector::ZERO
            };
            let wanted = held - stop * STOPPING;
            torques[i] = wanted.clamp_length_max(self.bounds[i]);
            let sliding = torques[i] != wanted;
            let next = if sliding { held } else { held - stop * HOLDING };
            keep += next.clamp_length_max(self.bounds[i]);
        }
        (torques, keep)
    }
}
