//! Groups of columns that reach different joints, or different sensors: one walk serves a group.

use asid_effects::Reach;

/// Columns that are walked together, by their places in a list, with what each reaches.
#[derive(Clone, Debug)]
pub(super) struct Group {
    /// Places of the columns.
    pub(super) members: Vec<usize>,
    /// What each reaches.
    pub(super) reaches: Vec<Reach>,
}

impl Group {
    /// A column by itself.
    pub(super) fn single(member: usize, reach: Reach) -> Self {
        Self {
            members: vec![member],
            reaches: vec![reach],
        }
    }

    /// The columns, each by itself.
    pub(super) fn apart(self) -> impl Iterator<Item = Self> {
        let each = self.members.into_iter().zip(self.reaches);
        each.map(|(member, reach)| Self::single(member, reach))
    }

    /// Whether its columns are of readings alone.
    pub(super) fn is_of_sensors(&self) -> bool {
        matches!(self.reaches[0], Reach::Sensor(_))
    }

    /// Whether a column that reaches this can be walked with its own.
    fn takes(&self, reach: &Reach) -> bool {
        self.reaches.iter().all(|own| own.is_apart_from(reach))
    }
}

/// Groups of columns, given with what they reach; each comes into the first that takes it.
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Of some degrees of freedom.
    pub(in crate::latent_force::columns) fn dofs(own: &[usize]) -> Reach {
        Reach::Dofs(own.iter().copied().collect())
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
