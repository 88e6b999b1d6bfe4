//! Makes sliding friction act against the direction of slip.
//!
//! rapier solves a contact point's two tangential directions together, with the inverse inertia `K`
//! at the point, and then shortens the impulse to `mu N`. While a point slides, the impulse
//! therefore settles along `K^-1 v` and not along the slip `v`. A body turns more easily about some
//! axes than others, so the two can be 30 degrees apart. A box then slides 8 % too far, a rod much
//! more.
//!
//! A contact's target slip, which rapier provides for conveyor belts, removes the error: with the
//! target `v - c K v` the impulse settles along `v`. `c` is one over the largest inertia, so that a
//! sticking point is stopped without overshoot. A point at rest is left alone.

use rapier3d::dynamics::{RigidBody, RigidBodyHandle, RigidBodySet};
use rapier3d::geometry::SolverContact;
use rapier3d::math::Vector;
use rapier3d::utils::{AngularInertiaOps, OrthonormalBasis};

/// The two bodies of a contact, if they can be pushed.
pub struct Sides<'a> {
    bodies: [Option<&'a RigidBody>; 2],
    links: [bool; 2],
    /// Whether one side is in an articulated tree: rapier then solves the two directions
    /// separately.
    apart: bool,
    basis: [Vector; 2],
}

impl<'a> Sides<'a> {
    /// Bodies of a contact with the normal from the first to the second.
    ///
    /// `links` says which of them are moving links of articulated trees, `apart` whether one
    /// belongs to such a tree at all.
    pub fn new(
        bodies: &'a RigidBodySet,
        handles: [Option<RigidBodyHandle>; 2],
        links: [bool; 2],
        apart: bool,
        normal: Vector,
    ) -> Self {
        let first = (-normal).orthonormal_vector();
        Self {
            bodies: handles.map(|h| h.and_then(|h| bodies.get(h))),
            links,
            apart,
            basis: [first, (-normal).cross(first)],
        }
    }

    /// Sets the target slip of one contact, whose anchors are world points.
    ///
    /// Its friction gave at most the impulse `limit` (N s) in the last step.
    pub fn align(&self, contact: &mut SolverContact, limit: f32) {
        let point = (contact.anchor1 + contact.anchor2) * 0.5;
        let mut slip = Vector::ZERO;
        let mut k = [[0.0f32; 2]; 2];
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let Some(body) = self.bodies[side].filter(|b| b.is_dynamic()) else {
                continue;
            };
            let properties = body.mass_properties();
            let arm = point - properties.world_com;
            slip += (body.linvel() + body.angvel().cross(arm)) * sign;
            // A link's own inertia does not represent the tree's, so its part of `K` is omitted.
            // That part is small beside that of the light objects that arms push.
            if self.links[side] {
                continue;
            }
            let inertia = &properties.effective_world_inv_inertia;
            for (i, &t) in self.basis.iter().enumerate() {
                let turn = inertia.transform_vector(arm.cross(t)).cross(arm);
                let response = properties.effective_inv_mass * t + turn;
                for (j, &other) in self.basis.iter().enumerate() {
                    k[i][j] += response.dot(other);
                }
            }
        }
        let v = [slip.dot(self.basis[0]), slip.dot(self.basis[1])];
        let cross = if self.apart { 0.0 } else { k[0][1] };
        let mean = 0.5 * (k[0][0] + k[1][1]);
        let spread = (0.25 * (k[0][0] - k[1][1]).powi(2) + cross * cross).sqrt();
        let largest = mean + spread;
        if largest <= 0.0 {
            return;
        }
        let share = if self.links[0] || self.links[1] {
            sliding(v, k, limit)
        } else {
            1.0
        };
        let scaled = [
            share * ((k[0][0] * v[0] + cross * v[1]) / largest - v[0]),
            share * ((cross * v[0] + k[1][1] * v[1]) / largest - v[1]),
        ];
        contact.tangent_velocity = self.basis[0] * scaled[0] + self.basis[1] * scaled[1];
    }
}

/// How much a contact slides: 0 if the friction of the last step suffices to stop the slip in this
/// one, 1 from twice that on.
///
/// Near the end of a slip, the target slip slows the stopping. A rod would then creep out of a
/// moving grip by millimetres, so a gripped rod may stick.
fn sliding(v: [f32; 2], k: [[f32; 2]; 2], limit: f32) -> f32 {
    let needed = (v[0] / k[0][0]).hypot(v[1] / k[1][1]);
    if limit <= 0.0 {
        return 1.0;
    }
    (needed / limit - 1.0).clamp(0.0, 1.0)
}
