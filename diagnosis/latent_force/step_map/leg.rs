//! Rollouts of several rows at once along segments, which run on by themselves.
//!
//! Between two rollouts an engine copies every state. In MuJoCo reading a row costs half a physics
//! step, which within a rollout is the first half of the next one (not with Runge-Kutta, nor where
//! an effect changes the model in each step).

use std::collections::BTreeMap;

use asid_core::{Control, Result, Rollout, Simulator as _};

use crate::latent_force::walk::Walk;

use super::Common;
use super::pass::Part;

/// Rows that some walks are rolled out by, all with the same physics steps.
#[derive(Debug, PartialEq)]
pub(super) struct Leg {
    /// Row that the walks have reached.
    pub(super) from: usize,
    /// Number of rows after it.
    pub(super) rows: usize,
    /// Physics steps of each row.
    substeps: usize,
    /// The walks, by their places in the part.
    pub(super) walks: Vec<usize>,
}

/// Groups the walks of `going` that have not ended, where each has reached row `reached`, by the
/// next rows they take together: at most `most`.
pub(super) fn legs(
    walks: &[&Walk],
    (going, reached): (&[usize], &[usize]),
    most: usize,
) -> Vec<Leg> {
    let mut groups: BTreeMap<(usize, usize, usize), Vec<usize>> = BTreeMap::new();
    for &e in going {
        let from = reached[e];
        let ahead = &walks[e].substeps[from..];
        if let Some(&substeps) = ahead.first() {
            let alike = ahead.iter().take_while(|s| **s == substeps).count();
            let group = groups.entry((from, alike.min(most), substeps));
            group.or_default().push(e);
        }
    }
    let leg = |((from, rows, substeps), walks)| Leg {
        from,
        rows,
        substeps,
        walks,
    };
    groups.into_iter().map(leg).collect()
}

impl Part {
    /// Rolls out the first `roles` simulations of each walk of a leg.
    ///
    /// Writes the states and readings of the rows after `from`, `roles x walks x rows`, in the
    /// order of [`Common::states_and_readings`].
    pub(super) fn roll_on(
        &mut self,
        c: &Common<'_>,
        (leg, roles): (&Leg, usize),
        out: &mut Vec<f64>,
    ) -> Result<()> {
        let Leg { from, rows, .. } = *leg;
        let (n, nu) = (self.walks.len(), c.layout.nu());
        let (mut sims, mut ctrl) = (Vec::new(), Vec::new());
        for v in 0..roles {
            for &e in &leg.walks {
                sims.push(v * n + e);
                let walk = &c.walks[self.walks[e]];
                ctrl.extend_from_slice(&walk.ctrl[from * nu..(from + rows) * nu]);
            }
        }
        let record = &c.states_and_readings;
        let control = Control::PerSimulation(&ctrl);
        let rollout = Rollout::new(&sims, rows, leg.substeps, control, record);
        out.resize(sims.len() * rows * record.width(), 0.0);
        self.simulator.rollout(&rollout, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(substeps: &[usize]) -> Walk {
        Walk {
            episode: 0,
            rows: (0..=substeps.len()).collect(),
            time: vec![0.0; substeps.len() + 1],
            substeps: substeps.to_vec(),
            ctrl: Vec::new(),
            at_steps: Vec::new(),
            segment: Some(0),
        }
    }

    #[test]
    fn walks_go_together_as_long_as_their_rows_have_the_same_steps() {
        let walks = [walk(&[5; 9]), walk(&[5, 5, 4]), walk(&[5; 9]), walk(&[])];
        let walks: Vec<&Walk> = walks.iter().collect();
        let next = |going: &[usize], reached: [usize; 4]| {
            let found = legs(&walks, (going, &reached), 8);
            let each = found.into_iter();
            each.map(|s| (s.from, s.rows, s.substeps, s.walks))
                .collect::<Vec<_>>()
        };
        let all = [0, 1, 2, 3];
        let first = [(0, 2, 5, vec![1]), (0, 8, 5, vec![0, 2])];
        assert_eq!(next(&all, [0; 4]), first);
        let second = [(2, 1, 4, vec![1]), (8, 1, 5, vec![0, 2])];
        assert_eq!(next(&all, [8, 2, 8, 0]), second);
        assert_eq!(next(&[1, 2], [8, 3, 8, 0]), [(8, 1, 5, vec![2])]);
        assert_eq!(next(&all, [9, 3, 9, 0]), []);
    }
}
