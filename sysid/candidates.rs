//! Costs of candidate motions, with no more simulations than their ranking needs.
//!
//! A candidate is simulated at the middle of the unknowns. If it keeps the limits there, it is
//! simulated a step up and down in each unknown, for its information. Candidates are then simulated
//! far from the middle, in the order of their costs, with limits checked after every physics step.
//! This ends once enough of them keep the limits. The others keep their costs without that check.

use asid_algorithms::fisher::Objective;
use asid_core::Parameter;
use asid_core::error::Result;

use crate::limits::Excess;
use crate::motion::Family;
use crate::play::{Played, Player};
use crate::tells::{Told, of_plays, search_differences};

/// Most unknowns for which a search checks all corners of the ranges.
///
/// Eight plays for each candidate, where the ends are six.
const FEW: usize = 3;

/// A cost beyond that of any motion that keeps the limits.
pub const BROKEN: f64 = 1e6;

/// Ranks candidates.
pub struct Candidates<'p, 'a> {
    /// Simulates motions.
    pub player: &'p mut Player<'a>,
    /// The family of motions.
    pub family: Family,
    /// Unknowns, then nuisance entries.
    pub parameters: &'p [Parameter],
    /// Number of unknowns.
    pub sought: usize,
    /// The middle: values of the parameters about which the search is done.
    pub values: &'p [f64],
    /// Information beside the prior, such as from logs.
    pub known: &'p Told,
    /// Objective that is minimised.
    pub objective: Objective,
    /// Physics steps in a frame.
    pub substeps: usize,
    /// Points far from the middle.
    pub far: &'p [Vec<f64>],
}

impl Candidates<'_, '_> {
    /// Costs of candidates.
    ///
    /// The `wanted` lowest costs belong to candidates that keep the limits everywhere, if that many
    /// do.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn costs(&mut self, candidates: &[Vec<f64>], wanted: usize) -> Result<Vec<f64>> {
        let (near, widths) = search_differences(self.parameters, self.values);
        let commands = candidates.iter().map(|c| self.family.commands(c, 1.0));
        let commands: Vec<Vec<f64>> = commands.collect();
        let all: Vec<usize> = (0..candidates.len()).collect();
        let middle = self.plays(&commands, &all, &near[..1], self.substeps)?;
        let mut costs: Vec<f64> = middle.iter().map(|p| broken(p)).collect();
        let keep: Vec<usize> = all.into_iter().filter(|&k| costs[k] == 0.0).collect();
        let beside = self.plays(&commands, &keep, &near[1..], self.substeps)?;
        for (&k, beside) in keep.iter().zip(beside) {
            costs[k] = broken(&beside);
            if costs[k] == 0.0 {
                let plays = [middle[k].clone(), beside].concat();
                let told = of_plays(self.player, &plays, &widths, self.sought);
                costs[k] = told.and(1.0, self.known).cost(self.objective);
            }
        }
        // In the order of their costs, as many at a time as are still wanted.
        let mut order: Vec<usize> = keep.into_iter().filter(|&k| costs[k] < BROKEN).collect();
        order.sort_by(|&i, &j| costs[i].total_cmp(&costs[j]));
        let (mut found, mut rest) = (0, &order[..]);
        while found < wanted && !rest.is_empty() {
            let (now, later) = rest.split_at((wanted - found).min(rest.len()));
            let fine: Vec<Vec<f64>> = now.iter().map(|&k| self.fine(&commands[k])).collect();
            let all: Vec<usize> = (0..now.len()).collect();
            let plays = self.plays(&fine, &all, self.far, 1)?;
            for (&k, plays) in now.iter().zip(plays) {
                match broken(&plays) {
                    0.0 => found += 1,
                    cost => costs[k] = cost,
                }
            }
            rest = later;
        }
        Ok(costs)
    }

    /// Commands for every physics step.
    fn fine(&self, commands: &[f64]) -> Vec<f64> {
        let rows = commands.chunks_exact(self.family.base.len());
        rows.flat_map(|row| row.repeat(self.substeps)).collect()
    }

    /// Plays of the chosen motions, each at all points, in frames of `substeps` physics steps.
    fn plays(
        &mut self,
        commands: &[Vec<f64>],
        chosen: &[usize],
        points: &[Vec<f64>],
        substeps: usize,
    ) -> Result<Vec<Vec<Played>>> {
        let pairs = chosen
            .iter()
            .flat_map(|&k| points.iter().map(move |p| (k, p)));
        let jobs: Vec<(&[f64], &[f64])> = pairs.map(|(k, p)| (&commands[k][..], &p[..])).collect();
        let plays = self.player.play(&jobs, substeps)?;
        Ok(plays
            .chunks_exact(points.len().max(1))
            .map(<[Played]>::to_vec)
            .collect())
    }
}

/// Whether a cost is that of a motion that breaks a limit.
pub(crate) fn breaks(cost: f64) -> bool {
    cost >= BROKEN
}

/// Cost of plays that break limits; zero where they keep all.
fn broken(plays: &[Played]) -> f64 {
    let mut excess = Excess::default();
    plays.iter().for_each(|p| excess.join(&p.excess));
    if excess.is_none() {
        0.0
    } else {
        BROKEN * (1.0 + excess.total)
    }
}

/// Points far from the middle at which a search first checks the limits.
///
/// All corners of the ranges where these are few, else the ends of each range.
pub fn far(parameters: &[Parameter], values: &[f64]) -> Vec<Vec<f64>> {
    let n = parameters.len();
    if n > FEW {
        return ends(parameters, values);
    }
    let corner = |k: usize| {
        let entries = parameters.iter().enumerate();
        entries.map(|(i, p)| p.range[k >> i & 1]).collect()
    };
    (0..1 << n).map(corner).collect()
}

/// The points that have one entry at an end of its range and the others at the middle.
pub fn ends(parameters: &[Parameter], values: &[f64]) -> Vec<Vec<f64>> {
    let mut points = Vec::with_capacity(2 * parameters.len());
    for (i, parameter) in parameters.iter().enumerate() {
        for end in parameter.range {
            let mut point = values.to_vec();
            point[i] = end;
            points.push(point);
        }
    }
    points
}
