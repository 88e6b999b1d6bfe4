//! Sets of degrees of freedom that nothing couples: two arms on a table, or an arm beside an
//! object.
//!
//! A perturbation of one set moves none of the others, so one simulation perturbs each of them.
//! They are columns of a Jacobian whose rows do not overlap (Curtis, Powell and Reid 1974). Engines
//! call such sets islands. A kinematic tree is within one island by its structure. Two trees are
//! one island if a sensor reads both, or if their bodies touched in some row of the logs. They also
//! are if derivatives show a coupling, as of a tendon or a connection.

use asid_core::layout::JointKind;
use asid_effects::Reach;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use super::step_map::LinearEpisode;

/// Derivatives below this share of the largest of their row count as zero.
///
/// They are differences of doubles over steps of 1e-6, and rounding makes 1e-10 of a coordinate of
/// order one.
const NO_COUPLING: f64 = 1e-8;

/// Degrees of freedom, merged into sets (union-find).
pub(super) struct Joined {
    parent: Vec<usize>,
    sets: usize,
}

impl Joined {
    /// Each degree of freedom as a set of its own.
    pub(super) fn new(dofs: usize) -> Self {
        Self {
            parent: (0..dofs).collect(),
            sets: dofs,
        }
    }

    /// Number of sets.
    pub(super) fn sets(&self) -> usize {
        self.sets
    }

    /// Returns the smallest member of the set that contains `of`.
    pub(super) fn root(&self, mut of: usize) -> usize {
        while self.parent[of] != of {
            of = self.parent[of];
        }
        of
    }

    /// Merges the sets of two degrees of freedom.
    pub(super) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            self.parent[a.max(b)] = a.min(b);
            self.sets -= 1;
        }
    }

    /// Merges the degrees of freedom on which a row of derivatives depends, and the row's `own`.
    ///
    /// The row has derivatives with respect to positions, then to speeds.
    pub(super) fn couple(&mut self, slopes: &[f64], own: Option<usize>) {
        let nv = self.parent.len();
        let mut first = own;
        for place in depends(slopes) {
            match first {
                Some(first) => self.join(first, place % nv),
                None => first = Some(place % nv),
            }
        }
    }

    /// Returns the set of each degree of freedom, numbered in order of appearance.
    pub(super) fn numbered(&self) -> Vec<usize> {
        let mut numbers = vec![usize::MAX; self.parent.len()];
        let mut next = 0;
        let number = |d: usize| {
            let own = &mut numbers[self.root(d)];
            if *own == usize::MAX {
                *own = next;
                next += 1;
            }
            *own
        };
        (0..self.parent.len()).map(number).collect()
    }
}

/// Indices of the derivatives of a row that exceed rounding.
pub(super) fn depends(slopes: &[f64]) -> impl Iterator<Item = usize> + '_ {
    let largest = slopes.iter().fold(0.0, |most: f64, x| x.abs().max(most));
    let places = slopes.iter().enumerate();
    places
        .filter(move |(_, x)| x.abs() > NO_COUPLING * largest)
        .map(|(place, _)| place)
}

/// The islands of a machine.
#[derive(Clone, Debug)]
pub struct Islands {
    /// The island of each degree of freedom, and of each entry of a reading.
    of_dof: Vec<usize>,
    of_entry: Vec<usize>,
    /// Degrees of freedom that are perturbed together: the first of each island, the second of
    /// each, and so on.
    slots: Vec<Vec<usize>>,
}

impl Islands {
    /// All degrees of freedom as one island.
    #[must_use]
    pub fn one(dofs: usize, entries: usize) -> Self {
        Self::numbered(vec![0; dofs], vec![0; entries])
    }

    fn numbered(of_dof: Vec<usize>, of_entry: Vec<usize>) -> Self {
        let mut slots: Vec<Vec<usize>> = Vec::new();
        for (d, island) in of_dof.iter().enumerate() {
            let before = of_dof[..d].iter().filter(|i| *i == island).count();
            if before == slots.len() {
                slots.push(Vec::new());
            }
            slots[before].push(d);
        }
        Self {
            of_dof,
            of_entry,
            slots,
        }
    }

    /// Finds the islands of a machine by its structure, its contacts and derivatives along some
    /// rows.
    ///
    /// `sensors` are those of the entries of a reading, by index in the layout. `touching` are
    /// pairs of bodies in contact.
    #[must_use]
    pub fn of(
        plant: &Plant,
        sensors: &[usize],
        touching: &[[usize; 2]],
        linear: &[LinearEpisode],
    ) -> Self {
        let nv = plant.layout.nv;
        let nx = 2 * nv;
        let mut joined = Joined::new(nv);
        let trees = trees(plant);
        for dofs in &trees {
            dofs.iter().for_each(|&d| joined.join(dofs[0], d));
        }
        let first_of = |body: usize| trees[root(plant, body)].first().copied();
        for [a, b] in touching {
            if let (Some(a), Some(b)) = (first_of(*a), first_of(*b)) {
                joined.join(a, b);
            }
        }
        let mut read = Vec::with_capacity(sensors.len());
        for &sensor in sensors {
            read.push(match plant.sensors.get(sensor) {
                Some(Reads::Joint(joint)) => Some(plant.layout.joints[*joint].qvel),
                Some(Reads::Body(body)) => first_of(*body).or(Some(0)),
                _ => None,
            });
        }
        if read.contains(&None) || nv == 0 {
            return Self::one(nv, sensors.len());
        }
        let read: Vec<usize> = read.into_iter().flatten().collect();
        for episode in linear {
            for (row, a) in episode.a.chunks_exact(nx).enumerate() {
                joined.couple(a, Some(row % nv));
            }
            for (entry, h) in episode.h.chunks_exact(nx).enumerate() {
                joined.couple(h, Some(read[entry % read.len()]));
            }
        }
        let of_dof = joined.numbered();
        let of_entry = read.iter().map(|&d| of_dof[d]).collect();
        Self::numbered(of_dof, of_entry)
    }

    /// Number of perturbations that cover all degrees of freedom.
    #[must_use]
    pub fn slots(&self) -> usize {
        self.slots.len()
    }

    /// Degrees of freedom that are perturbed together.
    #[must_use]
    pub fn pushed(&self, slot: usize) -> &[usize] {
        &self.slots[slot]
    }

    /// Tangent coordinates that are perturbed together: positions if `slot` is below
    /// [`Islands::slots`], else speeds.
    pub fn moved(&self, slot: usize) -> impl Iterator<Item = usize> + '_ {
        let (n, nv) = (self.slots.len(), self.of_dof.len());
        self.slots[slot % n]
            .iter()
            .map(move |d| nv * (slot / n) + d)
    }

    /// Which of the degrees of freedom perturbed together moves a tangent coordinate.
    #[must_use]
    pub fn dof_told(&self, slot: usize, coordinate: usize) -> Option<usize> {
        let own = self.of_dof[coordinate % self.of_dof.len()];
        let mut dofs = self.slots[slot].iter().copied();
        dofs.find(|&d| self.of_dof[d] == own)
    }

    /// Which of the coordinates perturbed together moves a tangent coordinate.
    #[must_use]
    pub fn coordinate_told(&self, slot: usize, coordinate: usize) -> Option<usize> {
        let own = self.of_dof[coordinate % self.of_dof.len()];
        let nv = self.of_dof.len();
        self.moved(slot).find(|c| self.of_dof[c % nv] == own)
    }

    /// Which of the coordinates perturbed together changes an entry of a reading.
    #[must_use]
    pub fn coordinate_read(&self, slot: usize, entry: usize) -> Option<usize> {
        let nv = self.of_dof.len();
        let mut moved = self.moved(slot);
        moved.find(|c| self.of_dof[c % nv] == self.of_entry[entry])
    }

    /// The island of a degree of freedom.
    #[must_use]
    pub fn island(&self, dof: usize) -> usize {
        self.of_dof[dof]
    }

    /// The one island that an effect reaches; `None` if it reaches several or if that is unknown.
    #[must_use]
    pub fn reached(&self, reach: &Reach) -> Option<usize> {
        let Reach::Dofs(dofs) = reach else {
            return None;
        };
        let mut islands = dofs.iter().map(|&d| self.of_dof[d]);
        let first = islands.next()?;
        islands.all(|i| i == first).then_some(first)
    }
}

/// The root body of a body's kinematic tree; the world for a body that is fixed to it.
fn root(plant: &Plant, mut body: usize) -> usize {
    let mut foot = 0;
    while body != 0 {
        if !plant.bodies[body].joints.is_empty() {
            foot = body;
        }
        body = plant.bodies[body].parent;
    }
    foot
}

/// Degrees of freedom of each kinematic tree, by its root body.
fn trees(plant: &Plant) -> Vec<Vec<usize>> {
    let mut trees = vec![Vec::new(); plant.bodies.len()];
    for (body, own) in plant.bodies.iter().enumerate() {
        let foot = root(plant, body);
        for joint in own.joints.clone().map(|j| &plant.layout.joints[j]) {
            let count = match joint.kind {
                JointKind::Free => 6,
                JointKind::Ball => 3,
                JointKind::Hinge | JointKind::Slide => 1,
            };
            trees[foot].extend(joint.qvel..joint.qvel + count);
        }
    }
    trees
}

#[cfg(test)]
mod tests {
    use asid_core::Scene;

    use super::*;

    /// An arm of two hinges, a free ball and a slide.
    const SCENE: &str = r#"<mujoco><worldbody>
        <body name="upper"><joint name="a" type="hinge"/><geom size="0.1" mass="1"/>
          <body name="fore"><joint name="b" type="hinge"/><geom size="0.1" mass="1"/></body></body>
        <body name="ball"><freejoint name="free"/><geom size="0.1" mass="1"/></body>
        <body name="cart"><joint name="c" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
        <sensor><jointpos name="qa" joint="a"/><jointpos name="qc" joint="c"/>
          <framepos name="place" objtype="body" objname="ball"/><clock name="clock"/></sensor></mujoco>"#;

    fn plant() -> Plant {
        Plant::of(&Scene::from_xml("scene", SCENE, &[]).unwrap()).unwrap()
    }

    fn body(plant: &Plant, name: &str) -> usize {
        let mut bodies = plant.layout.bodies.iter();
        bodies.position(|b| b == name).unwrap()
    }

    #[test]
    fn a_tree_is_an_island_and_one_push_of_each_tells_of_all() {
        let plant = plant();
        let islands = Islands::of(&plant, &[0, 1, 2, 2, 2], &[], &[]);
        let dofs = |name: &str| {
            let mut joints = plant.layout.joints.iter();
            joints.find(|j| j.name == name).unwrap().qvel
        };
        assert_eq!(islands.slots(), 6);
        let mut first = islands.pushed(0).to_vec();
        first.sort_unstable();
        let mut want = vec![dofs("a"), dofs("free"), dofs("c")];
        want.sort_unstable();
        assert_eq!(first, want);
        assert_eq!(islands.dof_told(1, dofs("a")), Some(dofs("b")));
        assert_eq!(islands.dof_told(1, dofs("c")), None);
        let nv = plant.layout.nv;
        assert_eq!(islands.coordinate_told(6, dofs("b")), Some(nv + dofs("a")));
        // The second entry is the cart's place.
        assert_eq!(islands.coordinate_read(0, 1), Some(dofs("c")));
        let reach = |own: &[usize]| Reach::Dofs(own.iter().copied().collect());
        assert_eq!(
            islands.reached(&reach(&[dofs("b")])),
            Some(islands.island(dofs("a")))
        );
        assert_eq!(islands.reached(&reach(&[dofs("b"), dofs("c")])), None);
        assert_eq!(islands.reached(&Reach::Everything), None);
    }

    #[test]
    fn what_touches_is_one_island() {
        let plant = plant();
        let touching = [[body(&plant, "fore"), body(&plant, "ball")]];
        let islands = Islands::of(&plant, &[0, 1], &touching, &[]);
        // Two hinges and six degrees of freedom of the ball; the cart is on its own. The floor
        // moves nothing.
        assert_eq!(islands.slots(), 8);
        let floor = [[0, body(&plant, "ball")]];
        assert_eq!(Islands::of(&plant, &[0, 1], &floor, &[]).slots(), 6);
    }

    #[test]
    fn slopes_say_what_a_tendon_joins() {
        let plant = plant();
        let nv = plant.layout.nv;
        let nx = 2 * nv;
        let mut a = nalgebra::DMatrix::identity(nx, nx);
        // The cart's speed depends on the arm's position; a value at the rounding of a difference
        // counts as zero.
        a[(2 * nv - 1, 0)] = 0.3;
        a[(nv + 3, 1)] = 1e-10;
        let episode = LinearEpisode {
            rows: 2,
            a: a.transpose().as_slice().to_vec(),
            ..LinearEpisode::default()
        };
        assert_eq!(Islands::of(&plant, &[0], &[], &[episode]).slots(), 6);
        let islands = |a: nalgebra::DMatrix<f64>| {
            let episode = LinearEpisode {
                rows: 2,
                a: a.transpose().as_slice().to_vec(),
                ..LinearEpisode::default()
            };
            let found = Islands::of(&plant, &[0], &[], &[episode]);
            found.island(0) == found.island(nv - 1)
        };
        assert!(islands(a.clone()));
        a[(2 * nv - 1, 0)] = 0.0;
        assert!(!islands(a));
    }

    #[test]
    fn where_a_sensor_may_read_anything_all_is_one() {
        let plant = plant();
        let islands = Islands::of(&plant, &[0, 3], &[], &[]);
        assert_eq!(islands.slots(), plant.layout.nv);
    }
}
