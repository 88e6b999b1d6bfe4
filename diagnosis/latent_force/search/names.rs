//! Names of a set of effects: which of its candidates were named together.

/// The names of a set.
///
/// A candidate that was added by itself is a name, and so is a group: one effect at several sites,
/// added at once. Tolerances are no names.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names(Vec<Vec<usize>>);

impl Names {
    /// Returns how many there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Adds some candidates as one name.
    pub fn add(&mut self, name: Vec<usize>) {
        self.0.push(name);
    }

    /// Adds the names of another set.
    pub(super) fn extend(&mut self, other: Self) {
        self.0.extend(other.0);
    }

    /// Returns the names with only some of the candidates; a name that has none of them is gone.
    #[must_use]
    pub fn among(&self, some: &[usize]) -> Self {
        let kept = self.0.iter().map(|name| -> Vec<usize> {
            let own = name.iter().filter(|c| some.contains(c));
            own.copied().collect()
        });
        Self(kept.filter(|name| !name.is_empty()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_gone_with_the_last_of_its_candidates() {
        let mut one_by_one = Names::default();
        one_by_one.add(vec![1]);
        one_by_one.add(vec![2]);
        let mut group = Names::default();
        group.add(vec![1, 2]);
        let counts = |names: &Names| [&[1, 2][..], &[2], &[]].map(|some| names.among(some).count());
        assert_eq!(counts(&one_by_one), [2, 1, 0]);
        assert_eq!(counts(&group), [1, 1, 0]);
        group.extend(one_by_one.among(&[2]));
        assert_eq!(counts(&group), [2, 2, 0]);
    }
}
