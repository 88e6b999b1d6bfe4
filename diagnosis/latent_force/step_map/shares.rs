//! Distribution of walks among cores: a row is too little work to distribute.

use crate::latent_force::walk::Walk;

/// Distributes walks among cores, the longest first, each to the core with the least work.
pub(super) fn share_out(walks: &[Walk], cores: usize) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..walks.len()).collect();
    order.sort_by_key(|&w| std::cmp::Reverse(walks[w].len()));
    let mut shares = vec![(0, Vec::new()); cores.max(1)];
    for w in order {
        if let Some(least) = shares.iter_mut().min_by_key(|s| s.0) {
            least.0 += walks[w].len();
            least.1.push(w);
        }
    }
    let shares = shares.into_iter().map(|(_, mut walks)| {
        walks.sort_unstable();
        walks
    });
    shares.filter(|s: &Vec<usize>| !s.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walks_are_shared_out_so_that_the_longest_share_is_short() {
        let walk = |rows: usize| Walk {
            episode: 0,
            rows: (0..rows).collect(),
            time: Vec::new(),
            substeps: Vec::new(),
            ctrl: Vec::new(),
            at_steps: Vec::new(),
            segment: None,
        };
        let walks: Vec<Walk> = [3, 9, 4, 5, 2].map(walk).into();
        // 9 and 3 rows for one core; 5, 4 and 2 for the other.
        assert_eq!(share_out(&walks, 2), [vec![0, 1], vec![2, 3, 4]]);
        // No core is without a walk, and every walk occurs once.
        assert_eq!(share_out(&walks, 8).concat().len(), 5);
        assert_eq!(share_out(&walks, 8).len(), 5);
        assert_eq!(share_out(&walks, 0), [vec![0, 1, 2, 3, 4]]);
    }
}
