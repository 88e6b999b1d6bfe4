//! Groups of columns that reach different joints or different sensors: each group shares one
//! simulation.

use asid_effects::Reach;

use crate::latent_force::islands::Islands;

/// Columns that share a simulation, by their places in a list, with what each reaches.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Places of the columns.
    pub(super) members: Vec<usize>,
    /// What each reaches.
    pub(super) reaches: Vec<Reach>,
}

impl Group {
    /// A group of a single column.
    pub(super) fn single(member: usize, reach: Reach) -> Self {
        Self {
            members: vec![member],
            reaches: vec![reach],
        }
    }

    /// Splits the group by islands; into single columns if each column already reaches a different
    /// island.
    pub(super) fn apart(self, islands: &Islands) -> Vec<Self> {
        let by_islands = self.islands(islands).is_some();
        let each = self.members.into_iter().zip(self.reaches);
        if by_islands {
            return each.map(|(m, reach)| Self::single(m, reach)).collect();
        }
        by_island(each, islands)
    }

    /// Returns the island that each column reaches, if these all differ.
    pub(super) fn islands(&self, islands: &Islands) -> Option<Vec<usize>> {
        let own = self.reaches.iter().map(|r| islands.reached(r));
        let own: Vec<usize> = own.collect::<Option<_>>()?;
        let is_first = |(i, island): (usize, &usize)| !own[..i].contains(island);
        own.iter().enumerate().all(is_first).then_some(own)
    }

    /// Whether its columns are of effects on readings alone.
    pub(super) fn is_of_sensors(&self) -> bool {
        matches!(self.reaches[0], Reach::Sensor(_))
    }

    /// Whether a column with this reach can join the group.
    fn takes(&self, reach: &Reach) -> bool {
        self.reaches.iter().all(|own| own.is_apart_from(reach))
    }
}

/// Forms groups of columns, given with what they reach; each column joins the first group that
/// admits it.
pub(super) fn grouped(columns: impl Iterator<Item = (usize, Reach)>) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (member, reach) in columns {
        match groups.iter_mut().find(|g| g.takes(&reach)) {
            Some(group) => {
                group.members.push(member);
                group.reaches.push(reach);
            }
            None => groups.push(Group::single(member, reach)),
        }
    }
    groups
}

/// Forms groups in which each column reaches a different island, whatever it reaches there.
pub(super) fn by_island(
    columns: impl Iterator<Item = (usize, Reach)>,
    islands: &Islands,
) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (member, reach) in columns {
        let own = islands.reached(&reach);
        let takes = |g: &&mut Group| {
            own.is_some()
                && g.reaches.iter().all(|r| {
                    let other = islands.reached(r);
                    other.is_some() && other != own
                })
        };
        match groups.iter_mut().find(takes) {
            Some(group) => {
                group.members.push(member);
                group.reaches.push(reach);
            }
            None => groups.push(Group::single(member, reach)),
        }
    }
    groups
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Returns the reach of an effect on some degrees of freedom.
    pub(in crate::latent_force::columns) fn dofs(own: &[usize]) -> Reach {
        Reach::Dofs(own.iter().copied().collect())
    }

    #[test]
    fn columns_of_different_islands_are_told_apart_whatever_they_reach_there() {
        use super::super::super::step_map::LinearEpisode;
        use asid_core::Scene;
        use asid_mjcf::Plant;

        let scene = r#"<mujoco><worldbody>
            <body><joint type="hinge"/><geom size="0.1" mass="1"/>
              <body><joint type="hinge"/><geom size="0.1" mass="1"/></body></body>
            <body><joint type="slide"/><geom size="0.1" mass="1"/></body></worldbody></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("scene", scene, &[]).unwrap()).unwrap();
        let none: [LinearEpisode; 0] = [];
        let islands = Islands::of(&plant, &[], &[], &none);
        let reaches = [dofs(&[0]), dofs(&[0, 1]), dofs(&[2]), Reach::Everything];
        let groups = by_island(reaches.into_iter().enumerate(), &islands);
        let members: Vec<_> = groups.iter().map(|g| &g.members[..]).collect();
        assert_eq!(members, [&[0, 2][..], &[1], &[3]]);
        assert_eq!(groups[0].islands(&islands), Some(vec![0, 1]));
        // A group that does not separate by islands is split into single columns; one that did not
        // by forces is first split by islands.
        assert_eq!(groups[0].clone().apart(&islands).len(), 2);
        let of_all = grouped([(0, dofs(&[0])), (1, dofs(&[1])), (2, dofs(&[2]))].into_iter());
        let apart = of_all[0].clone().apart(&islands);
        let members: Vec<_> = apart.iter().map(|g| &g.members[..]).collect();
        assert_eq!(members, [&[0, 2][..], &[1]]);
    }

    #[test]
    fn columns_of_a_group_reach_different_things() {
        let reaches = [
            dofs(&[0]),
            dofs(&[1]),
            dofs(&[0, 1]),
            Reach::Sensor(0),
            Reach::Sensor(1),
            Reach::Everything,
            dofs(&[2]),
            Reach::Everything,
        ];
        let groups = grouped(reaches.into_iter().enumerate());
        let members: Vec<_> = groups.iter().map(|g| &g.members[..]).collect();
        assert_eq!(members, [&[0, 1, 6][..], &[2], &[3, 4], &[5], &[7]]);
    }
}
