//! Which pairs of geoms can collide, and the friction of each pair.
//!
//! The rules are MuJoCo's. They comprise contact bits in either direction, excluded and explicit
//! pairs, and no contact between a body and its parent. The friction is the elementwise larger one,
//! or that of the geom with the higher priority.

use std::collections::{BTreeMap, BTreeSet};

use mjcf_rs::Model;
use rapier3d::geometry::SolverFlags;
use rapier3d::pipeline::{ContactModificationContext, PairFilterContext, PhysicsHooks};

use crate::slip::Sides;

/// Bit of a contact's index with which rapier marks it as new.
const NEW_CONTACT: u32 = 1 << 31;

/// Friction of one geom: sliding, torsional (m), rolling (m).
pub type Friction = [f32; 3];

/// Which geom of a pair determines its friction.
#[derive(Clone, Copy, Debug)]
enum Ruling {
    /// The first one: it has the higher priority.
    First,
    /// The second one: it has the higher priority.
    Second,
    /// Both, by the elementwise larger friction, since their priorities are equal.
    Both,
}

/// What the document says about the contact of a pair of geoms.
#[derive(Clone, Copy, Debug)]
struct Pair {
    may_collide: bool,
    condim: u32,
    ruling: Ruling,
    /// Friction of an explicit `<pair>`, which overrides that of both geoms.
    own: Option<Friction>,
}

/// What makes the friction of a geom irrelevant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overruled {
    /// The friction of an explicit `<pair>` with this geom.
    ByPair(usize),
    /// The higher priority of this geom.
    ByPriority(usize),
}

/// What the document says about the contacts of a geom.
#[derive(Clone, Copy, Debug)]
struct Rules {
    contype: u32,
    conaffinity: u32,
    priority: i32,
    condim: u32,
    body: usize,
    /// The body that the geom's body is rigidly joined to, and the one that this body moves on.
    group: usize,
    parent_group: usize,
}

/// An explicit `<pair>`.
#[derive(Clone, Copy, Debug, Default)]
struct Explicit {
    condim: Option<u32>,
    friction: Option<Friction>,
}

/// The rules for every pair of geoms.
///
/// They are stored by geom, because the pairs of a document with thousands of geoms would fill the
/// memory.
#[derive(Clone, Debug)]
pub struct PairTable {
    geoms: Vec<Rules>,
    /// Excluded pairs of bodies, in both orders.
    excluded: BTreeSet<(usize, usize)>,
    /// Explicit pairs of geoms, in both orders.
    explicit: BTreeMap<(usize, usize), Explicit>,
    has_rolling_or_spinning_friction: bool,
}

impl PairTable {
    /// Reads the rules of a document: contact bits, excluded and explicit pairs, and MuJoCo's rule
    /// on parents.
    ///
    /// By that rule, a body does not collide with its parent (unless the world) or with what it is
    /// welded to.
    ///
    /// # Errors
    /// The name of a body or geom that a contact element refers to, but that does not exist.
    pub fn new(model: &Model, body_of: &[usize]) -> Result<Self, String> {
        let geoms: Vec<_> = model.bodies.iter().flat_map(|b| &b.body.geoms).collect();
        let welded = weld_groups(model);
        let parent_group = |body: usize| {
            let root = welded[body];
            model.bodies[root].parent.map_or(0, |p| welded[p])
        };
        let mut excluded = BTreeSet::new();
        for exclude in &model.contact.excludes {
            let find = |name: &str| match name {
                "world" => Ok(0),
                _ => model.body_id_by_name(name).ok_or(format!("body `{name}`")),
            };
            let (a, b) = (find(&exclude.body1)?, find(&exclude.body2)?);
            excluded.extend([(a, b), (b, a)]);
        }
        let index = |name: &str| {
            geoms
                .iter()
                .position(|g| g.name.as_deref() == Some(name))
                .ok_or(format!("geom `{name}`"))
        };
        let mut explicit: BTreeMap<(usize, usize), Explicit> = BTreeMap::new();
        for pair in &model.contact.pairs {
            let (i, j) = (index(&pair.geom1)?, index(&pair.geom2)?);
            for at in BTreeSet::from([(i, j), (j, i)]) {
                let own = explicit.entry(at).or_default();
                own.condim = pair.condim.or(own.condim);
                own.friction = pair.friction.map(|f| f.map(|x| x as f32));
            }
        }
        let rules = geoms.iter().zip(body_of).map(|(geom, &body)| Rules {
            contype: geom.contype,
            conaffinity: geom.conaffinity,
            priority: geom.priority,
            condim: geom.condim,
            body,
            group: welded[body],
            parent_group: parent_group(body),
        });
        let mut table = Self {
            geoms: rules.collect(),
            excluded,
            explicit,
            has_rolling_or_spinning_friction: false,
        };
        table.has_rolling_or_spinning_friction = table.some_pair_turns();
        Ok(table)
    }

    /// Whether a pair that can collide resists rolling or spinning: it is explicit, or one of its
    /// geoms has such friction.
    fn some_pair_turns(&self) -> bool {
        let turns = |(a, b): (usize, usize)| {
            let pair = self.pair(a, b);
            pair.may_collide && pair.condim >= 4
        };
        let all = 0..self.geoms.len();
        let mut asking = all.clone().filter(|&a| self.geoms[a].condim >= 4);
        self.explicit.keys().any(|&at| turns(at))
            || asking.any(|a| all.clone().any(|b| turns((a, b))))
    }

    fn pair(&self, a: usize, b: usize) -> Pair {
        let (first, second) = (&self.geoms[a], &self.geoms[b]);
        let bits =
            first.contype & second.conaffinity != 0 || second.contype & first.conaffinity != 0;
        let (u, v) = (first.group, second.group);
        let family = (u != 0 && u == second.parent_group) || (v != 0 && v == first.parent_group);
        let apart = self.excluded.contains(&(first.body, second.body));
        let (condim, ruling) = match first.priority.cmp(&second.priority) {
            std::cmp::Ordering::Greater => (first.condim, Ruling::First),
            std::cmp::Ordering::Less => (second.condim, Ruling::Second),
            std::cmp::Ordering::Equal => (first.condim.max(second.condim), Ruling::Both),
        };
        let explicit = self.explicit.get(&(a, b));
        Pair {
            may_collide: explicit.is_some() || bits && u != v && !family && !apart,
            condim: explicit.and_then(|e| e.condim).unwrap_or(condim),
            ruling,
            own: explicit.and_then(|e| e.friction),
        }
    }

    /// Whether some pair resists rolling or spinning.
    pub fn has_rolling_or_spinning_friction(&self) -> bool {
        self.has_rolling_or_spinning_friction
    }

    /// What overrules the friction of a geom in all contacts that it can make.
    ///
    /// `None` where its friction counts in some contact, or where the geom can touch nothing.
    pub fn overruled(&self, geom: usize) -> Option<Overruled> {
        let mut by = None;
        let touched = (0..self.geoms.len()).filter(|&other| self.pair(geom, other).may_collide);
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

/// Hooks that rapier calls for every pair of near shapes; a collider's `user_data` is its geom's
/// index.
pub struct Hooks<'a> {
    /// Rules.
    pub table: &'a PairTable,
    /// Friction of each geom of this simulation.
    pub friction: &'a [Friction],
    /// Body of each geom.
    pub body_of: &'a [usize],
    /// Whether each body is a moving link of an articulated tree.
    pub links: &'a [bool],
    /// Whether each body belongs to an articulated tree, including fixed roots.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Stored as pairs, they would be 9e8 entries in 20 GB.
    #[test]
    fn a_document_of_many_geoms_takes_no_memory_for_each_pair() {
        let geoms = r#"<geom size="0.1"/>"#.repeat(30_000);
        let text = format!("<mujoco><worldbody><body>{geoms}</body></worldbody></mujoco>");
        let base = std::path::Path::new(".");
        let model = Model::from_str(&text, base).expect("a valid document");
        let table = PairTable::new(&model, &vec![1; 30_000]).expect("no contact element");
        assert!(!table.pair(0, 29_999).may_collide && !table.has_rolling_or_spinning_friction());
    }
}
