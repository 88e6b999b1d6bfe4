//! Which pairs of geoms can collide, and the friction of each pair.
//!
//! The rules are MuJoCo's: contact bits in either direction, excluded and explicit
//! pairs, no contact between a body and its parent; the elementwise larger
//! friction, or that of the geom with the higher priority.

use mjcf_rs::Model;
use rapier3d::geometry::SolverFlags;
use rapier3d::pipeline::{ContactModificationContext, PairFilterContext, PhysicsHooks};

use crate::slip::Sides;

/// Bit of a contact's index by which rapier marks it as new.
const NEW_CONTACT: u32 = 1 << 31;

/// Friction of one geom: sliding, torsional (m), rolling (m).
pub type Friction = [f32; 3];

/// Which geom of a pair rules its friction.
#[derive(Clone, Copy, Debug)]
enum Ruling {
    /// The first one: it has the higher priority.
    First,
    /// The second one: it has the higher priority.
    Second,
    /// Both, by the elementwise larger friction: their priorities are equal.
    Both,
}

/// What the document says about the contact of a pair of geoms.
#[derive(Clone, Copy, Debug)]
struct Pair {
    may_collide: bool,
    condim: u32,
    ruling: Ruling,
    /// Friction of an explicit `<pair>`, which overrules that of both geoms.
    own: Option<Friction>,
}

/// What leaves the friction of a geom without effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overruled {
    /// The friction of an explicit `<pair>` with this geom.
    ByPair(usize),
    /// The higher priority of this geom.
    ByPriority(usize),
}

/// The rules for every pair of geoms.
#[derive(Clone, Debug)]
pub struct PairTable {
    geoms: usize,
    pairs: Vec<Pair>,
    has_rolling_or_spinning_friction: bool,
}

impl PairTable {
    /// Reads the rules of a document: contact bits, excluded and explicit pairs,
    /// and MuJoCo's rule that a body does not collide with its parent (unless the world)
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
                let (condim, ruling) = match a.priority.cmp(&b.priority) {
                    std::cmp::Ordering::Greater => (a.condim, Ruling::First),
                    std::cmp::Ordering::Less => (b.condim, Ruling::Second),
                    std::cmp::Ordering::Equal => (a.condim.max(b.condim), Ruling::Both),
                };
                pairs.push(Pair {
                    may_collide: bits && u != v && !family && !apart,
                    condim,
                    ruling,
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
                pairs[at].may_collide = true;
                pairs[at].condim = pair.condim.unwrap_or(pairs[at].condim);
                pairs[at].own = pair.friction.map(|f| f.map(|x| x as f32));
            }
        }
        let turning = |p: &Pair| p.may_collide && p.condim >= 4;
        Ok(Self {
            geoms: n,
            has_rolling_or_spinning_friction: pairs.iter().any(turning),
            pairs,
        })
    }

    fn pair(&self, a: usize, b: usize) -> &Pair {
        &self.pairs[a * self.geoms + b]
    }

    /// True where some pair resists rolling or spinning.
    pub fn has_rolling_or_spinning_friction(&self) -> bool {
        self.has_rolling_or_spinning_friction
    }

    /// What overrules the friction of a geom in all the contacts that it can make; `None` where it counts in some, or
    /// where the geom can touch nothing.
    pub fn overruled(&self, geom: usize) -> Option<Overruled> {
        let mut by = None;
        let touched = (0..self.geoms).filter(|&other| self.pair(geom, other).may_collide);
        for other in touched {
            let pair = self.pair(geom, other);
            let found = match (pair.own, pair.ruling) {
                (Some(_), _) => Overruled::ByPair(other),
                (None, Ruling::Second) => Overruled::ByPriority(other),
                (None, Ruling::First | Ruling::Both) => return None,
            };
            by = by.or(Some(found));
        }
        by
    }

    /// Friction and `condim` of a pair of geoms.
    pub fn friction(&self, friction: &[Friction], a: usize, b: usize) -> (Friction, u32) {
        let pair = self.pair(a, b);
        let value = match (pair.own, pair.ruling) {
            (Some(own), _) => own,
            (None, Ruling::First) => friction[a],
            (None, Ruling::Second) => friction[b],
            (None, Ruling::Both) => std::array::from_fn(|i| friction[a][i].max(friction[b][i])),
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
            .may_collide
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
