//! Contacts: who meets whom, with what friction, and the resistance to rolling
//! and spinning that rapier lacks.
//!
//! Friction of a pair is MuJoCo's: the elementwise larger coefficient, or that of
//! the geom with the higher priority. A pair with `condim` 4 or 6 also resists
//! spinning about its normal with at most `friction[1] * N`, one with 6 rolling
//! with at most `friction[2] * N` (N m, for a normal force N). It is applied as
//! a pair of torques in the following step, from this step's normal force:
//! proportional to the relative rotation up to what would just stop it, with a
//! slow integral part so that a body at rest on a slope stays there without
//! creeping, and the whole clamped to its bound. The bounds of sliding, spinning
//! and rolling are independent, where MuJoCo's elliptic cone joins them.

use mjcf_rs::Model;
use rapier3d::dynamics::RigidBody;
use rapier3d::geometry::{ColliderSet, NarrowPhase, SolverFlags};
use rapier3d::math::Vector;
use rapier3d::pipeline::{ContactModificationContext, PairFilterContext, PhysicsHooks};
use rapier3d::utils::AngularInertiaOps;

use crate::slip::Sides;

/// Bit of a contact's index by which rapier marks it as new.
const NEW_CONTACT: u32 = 1 << 31;

/// Part of a relative rotation that one step takes out.
const STOPPING: f32 = 0.7;

/// Part of a relative rotation whose stopping torque is remembered.
const HOLDING: f32 = 0.1;

/// Friction of one geom: sliding, torsional (m), rolling (m).
pub type Friction = [f32; 3];

/// What the document says about the contact of a pair of geoms.
#[derive(Clone, Copy, Debug)]
struct Pair {
    meets: bool,
    condim: u32,
    /// 0 or 1 where one geom has the higher priority, 2 where they are equal.
    wins: u8,
    /// Friction of an explicit `<pair>`.
    own: Option<Friction>,
}

/// The rules for every pair of geoms.
#[derive(Clone, Debug)]
pub struct PairTable {
    geoms: usize,
    pairs: Vec<Pair>,
    resists: bool,
}

impl PairTable {
    /// Reads the rules of a document: contact bits, excluded and explicit pairs,
    /// and MuJoCo's rule that a body does not meet its parent (unless the world)
    /// or what it is welded to.
    ///
    /// # Errors
    /// The name of a body or geom that a contact element refers to in vain.
    pub fn new(model: &Model, body_of: &[usize]) -> Result<Self, String> {
        let geoms: Vec<_> = model.bodies.iter().flat_map(|b| &b.body.geoms).collect();
        let welded = weld_groups(model);
        let parent_group = |body: usize| {
            let root = welded[body];
            model.bodies[root].parent.map_or(0, |p| welded[p])
        };
        let mut excluded = Vec::new();
        for exclude in &model.contact.excludes {
            let find = |name: &str| match name {
                "world" => Ok(0),
                _ => model.body_id_by_name(name).ok_or(format!("body `{name}`")),
            };
            excluded.push((find(&exclude.body1)?, find(&exclude.body2)?));
        }
        let n = geoms.len();
        let mut pairs = Vec::with_capacity(n * n);
        for i in 0..n {
            for j in 0..n {
                let (a, b) = (geoms[i], geoms[j]);
                let (p, q) = (body_of[i], body_of[j]);
                let bits = a.contype & b.conaffinity != 0 || b.contype & a.conaffinity != 0;
                let (u, v) = (welded[p], welded[q]);
                let family = (u != 0 && u == parent_group(q)) || (v != 0 && v == parent_group(p));
                let apart = excluded.contains(&(p, q)) || excluded.contains(&(q, p));
                let (condim, wins) = match a.priority.cmp(&b.priority) {
                    std::cmp::Ordering::Greater => (a.condim, 0),
                    std::cmp::Ordering::Less => (b.condim, 1),
                    std::cmp::Ordering::Equal => (a.condim.max(b.condim), 2),
                };
                pairs.push(Pair {
                    meets: bits && u != v && !family && !apart,
                    condim,
                    wins,
                    own: None,
                });
            }
        }
        let index = |name: &str| {
            geoms
                .iter()
                .position(|g| g.name.as_deref() == Some(name))
                .ok_or(format!("geom `{name}`"))
        };
        for pair in &model.contact.pairs {
            let (i, j) = (index(&pair.geom1)?, index(&pair.geom2)?);
            for at in [i * n + j, j * n + i] {
                pairs[at].meets = true;
                pairs[at].condim = pair.condim.unwrap_or(pairs[at].condim);
                pairs[at].own = pair.friction.map(|f| f.map(|x| x as f32));
            }
        }
        let resists = pairs.iter().any(|p| p.meets && p.condim >= 4);
        Ok(Self {
            geoms: n,
            pairs,
            resists,
        })
    }

    fn pair(&self, a: usize, b: usize) -> &Pair {
        &self.pairs[a * self.geoms + b]
    }

    /// Friction and `condim` of a pair of geoms.
    fn friction(&self, friction: &[Friction], a: usize, b: usize) -> (Friction, u32) {
        let pair = self.pair(a, b);
        let value = match (pair.own, pair.wins) {
            (Some(own), _) => own,
            (None, 0) => friction[a],
            (None, 1) => friction[b],
            _ => std::array::from_fn(|i| friction[a][i].max(friction[b][i])),
        };
        (value, pair.condim)
    }
}

/// For each body, the topmost body that it is rigidly joined to.
fn weld_groups(model: &Model) -> Vec<usize> {
    let mut groups: Vec<usize> = Vec::with_capacity(model.bodies.len());
    for (i, entry) in model.bodies.iter().enumerate() {
        let group = match entry.parent {
            Some(parent) if entry.body.joints.is_empty() => groups[parent],
            _ => i,
        };
        groups.push(group);
    }
    groups
}

/// Hooks that rapier calls for every pair of near shapes; a collider's
/// `user_data` is its geom's index.
pub struct Hooks<'a> {
    /// Rules.
    pub table: &'a PairTable,
    /// Friction of each geom of this simulation.
    pub friction: &'a [Friction],
    /// Body of each geom.
    pub body_of: &'a [usize],
    /// Whether each body is a moving link of an articulated tree.
    pub links: &'a [bool],
    /// Whether each body is in an articulated tree at all.
    pub trees: &'a [bool],
}

impl PhysicsHooks for Hooks<'_> {
    fn filter_contact_pair(&self, context: &PairFilterContext<'_>) -> Option<SolverFlags> {
        let a = context.colliders[context.collider1].user_data as usize;
        let b = context.colliders[context.collider2].user_data as usize;
        self.table
            .pair(a, b)
            .meets
            .then_some(SolverFlags::COMPUTE_RIGID_IMPULSES)
    }

    fn modify_solver_contacts(&self, context: &mut ContactModificationContext<'_>) {
        let a = context.colliders[context.collider1].user_data as usize;
        let b = context.colliders[context.collider2].user_data as usize;
        let (friction, condim) = self.table.friction(self.friction, a, b);
        let sides = [context.rigid_body1, context.rigid_body2];
        let (first, second) = (self.body_of[a], self.body_of[b]);
        let links = [self.links[first], self.links[second]];
        let apart = self.trees[first] || self.trees[second];
        let bodies = context.bodies;
        if let Some(rigid) = context.rigid_mut() {
            *rigid.friction = if condim == 1 { 0.0 } else { friction[0] };
            let sides = Sides::new(bodies, sides, links, apart, *rigid.normal);
            for contact in rigid.solver_contacts.iter_mut() {
                let point = (contact.contact_id[0] & !NEW_CONTACT) as usize;
                let impulse = rigid
                    .manifold
                    .points
                    .get(point)
                    .map_or(0.0, |p| p.data.impulse);
                sides.align(contact, impulse * *rigid.friction);
            }
        }
    }
}

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
        if !table.resists {
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
