//! Search beyond the ends of a prior's range.
//!
//! A prior's range is where the unknown is expected; it is seldom a physical limit. Where a
//! posterior piles up at an end of it, prior and data contradict each other (Evans and Moshonov
//! 2006, "Checking for prior-data conflict"). The best value inside is then an artefact of the
//! range. So the range is widened at that end and the episodes are identified again, until the
//! posterior lies inside or the limit is reached. The result states the range that was finally
//! searched.
//!
//! A wider range contains the narrower one, so the best fit in it is at least as good. A search that
//! ends with a worse one was lost, and the previous answer stands. Two fits differ by chance too,
//! since each averages over rough simulations; [`behind`] says how much of the difference counts.

use super::evidence::{Evidence, behind};
use asid_core::identify::Identified;
use asid_core::parameter::{Parameter, Scale};
use asid_core::posterior::Edge;
use asid_core::{Error, Problem, Result};

/// Share of the prior's range by which an end moves at once. A truth just outside is then not
/// searched for far away, where draws would be wasted.
const STRIDE: f64 = 0.5;

/// Nats by which the fit of a wider search may be behind that of the narrower one. Odds of 20 to 1
/// are strong evidence (Kass and Raftery 1995, table on p. 777).
const LOST: f64 = 3.0;

/// How far a search goes, and how its fits are compared.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// How far an end of a range moves at most, in widths of the prior's range (on its scale).
    pub most: f64,
    /// Whether readings are weighted by the whole covariance of the roughness.
    pub correlated: bool,
}

/// Identifies within the prior's ranges, and in wider ranges while the posterior of an unknown
/// piles up at an end.
///
/// If a wider search fails, for example because no engine can simulate it, or is lost, the previous
/// answer stands.
///
/// # Errors
/// Those of the first call of `identify`, and [`Error::Interrupted`].
pub fn identify(
    problem: &Problem<'_>,
    limits: Limits,
    identify: impl Fn(&Problem<'_>) -> Result<(Identified, Evidence)>,
) -> Result<Identified> {
    let Limits { most, correlated } = limits;
    let (mut found, mut evidence) = identify(problem)?;
    let mut piles = piles(&found);
    let mut parameters = problem.parameters.to_vec();
    let mut gone = 0.0;
    while gone < most && piles.iter().any(Option::is_some) {
        let stride = STRIDE.min(most - gone);
        gone += stride;
        let ends = parameters.iter_mut().zip(problem.parameters).zip(&piles);
        let mut moved = false;
        for ((wide, prior), end) in ends {
            moved |= end.is_some_and(|end| move_end(wide, prior, end, stride));
        }
        if !moved {
            break;
        }
        let wider = Problem {
            parameters: &parameters,
            ..problem.clone()
        };
        let (next, its_evidence) = match identify(&wider) {
            Ok(next) => next,
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(_) => break,
        };
        if is_lost(&its_evidence, &evidence, correlated) {
            break;
        }
        evidence = its_evidence;
        piles = self::piles(&next);
        found = merged(found, next, &parameters, problem.parameters);
    }
    Ok(found)
}

/// Whether a wider search ended with a worse fit than the narrower one, by more than chance.
fn is_lost(wider: &Evidence, narrower: &Evidence, correlated: bool) -> bool {
    behind(&[wider, narrower], correlated)[0] > LOST
}

/// The end of its range at which each unknown's posterior piles up, if any.
fn piles(found: &Identified) -> Vec<Option<Edge>> {
    let marginals = &found.posterior.marginals;
    marginals.iter().map(|m| m.at_edge).collect()
}

/// The later answer with the iterations of both searches; widened unknowns keep their edge and
/// state the searched range.
fn merged(
    before: Identified,
    mut after: Identified,
    searched: &[Parameter],
    priors: &[Parameter],
) -> Identified {
    let both = after.posterior.marginals.iter_mut();
    let both = both.zip(before.posterior.marginals);
    for ((new, old), (wide, prior)) in both.zip(searched.iter().zip(priors)) {
        if wide.range != prior.range {
            new.at_edge = old.at_edge.or(new.at_edge);
            new.searched = Some(wide.range);
        }
    }
    let mut iterations = before.iterations;
    iterations.append(&mut after.iterations);
    Identified {
        iterations,
        ..after
    }
}

/// Moves an end of a range outwards by a share of the prior's width, on its scale; returns whether
/// it moved.
///
/// A range of one sign keeps its sign, since masses, frictions and times have no other: where the
/// end would cross zero, it moves half of the way to zero instead. An end at zero cannot move.
fn move_end(wide: &mut Parameter, prior: &Parameter, end: Edge, share: f64) -> bool {
    let (at, side) = match end {
        Edge::Low => (0, -1.0),
        Edge::High => (1, 1.0),
    };
    let [low, high] = prior.range;
    let was = wide.range[at];
    let moved = match prior.scale {
        Scale::Log => was * (high / low).powf(side * share),
        Scale::Linear => was + side * share * (high - low),
        Scale::Binary(_) => was,
    };
    let crossed = (low >= 0.0 && moved <= 0.0) || (high <= 0.0 && moved >= 0.0);
    wide.range[at] = if crossed { 0.5 * was } else { moved };
    wide.range[at] != was
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fisher::roughness::Roughness;
    use nalgebra::DMatrix;

    fn parameter(range: [f64; 2], scale: Scale) -> Parameter {
        Parameter {
            name: "p".into(),
            targets: vec!["geom/a/friction/0".parse().unwrap()],
            range,
            scale,
            unit: String::new(),
        }
    }

    fn moved(range: [f64; 2], scale: Scale, end: Edge) -> Option<[f64; 2]> {
        let prior = parameter(range, scale);
        let mut wide = prior.clone();
        move_end(&mut wide, &prior, end, 0.5).then_some(wide.range)
    }

    #[test]
    fn an_end_moves_by_half_a_width_on_its_scale() {
        assert_eq!(
            moved([1.0, 5.0], Scale::Linear, Edge::High),
            Some([1.0, 7.0])
        );
        assert_eq!(
            moved([-1.0, 1.0], Scale::Linear, Edge::Low),
            Some([-2.0, 1.0])
        );
        let log = moved([1.0, 100.0], Scale::Log, Edge::High).unwrap();
        assert!((log[1] - 1000.0).abs() < 1e-9);
    }

    /// Symptom: a search of the wider range that got lost replaced a better fit. Cause: any answer of a
    /// wider range was taken for the better one.
    #[test]
    fn a_wider_search_that_is_lost_is_told_from_one_that_is_less_lucky() {
        // 40 simulations, whose luck shifts all 200 readings together by 2 noises.
        let (count, readings) = (40, 200);
        let shift = |i: usize| if i.is_multiple_of(2) { 2.0 } else { -2.0 };
        let roughness = DMatrix::from_fn(count, readings, |i, _| shift(i));
        let left = |residual: &dyn Fn(usize) -> f64| Evidence {
            residual: (0..readings).map(residual).collect(),
            present: readings,
            roughness: Roughness::new(roughness.clone(), count as f64),
            scatter: 0.1,
            narrowing: 0.0,
        };
        let noise = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let narrower = left(&|k| 1.0 + noise(k));
        // Half of the roughness away, all readings together.
        let unlucky = left(&|k| 2.0 + noise(k));
        // A slope along the episode, which no luck makes.
        let lost = left(&|k| 1.0 + noise(k) + 4.0 * (k as f64 / 100.0 - 1.0));
        for correlated in [false, true] {
            assert!(!is_lost(&narrower, &narrower, correlated));
            assert!(!is_lost(&unlucky, &narrower, correlated));
            assert!(is_lost(&lost, &narrower, correlated));
            assert!(!is_lost(&narrower, &lost, correlated));
        }
    }

    #[test]
    fn a_range_of_one_sign_keeps_it() {
        assert_eq!(
            moved([1.0, 5.0], Scale::Linear, Edge::Low),
            Some([0.5, 5.0])
        );
        assert_eq!(moved([0.0, 5.0], Scale::Linear, Edge::Low), None);
        assert_eq!(
            moved([-5.0, -1.0], Scale::Linear, Edge::High),
            Some([-5.0, -0.5])
        );
    }
}
