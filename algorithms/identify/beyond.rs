//! Search beyond the ends of a prior's range.
//!
//! A prior's range is where the unknown is expected; it is seldom a physical limit. Where a
//! posterior piles up at an end of it, prior and data contradict each other (Evans and Moshonov
//! 2006, "Checking for prior-data conflict"). The best value inside is then an artefact of the
//! range. So the range is widened at that end and the episodes are identified again, until the
//! posterior lies inside or the limit is reached. The result states the range that was finally
//! searched.

use asid_core::identify::Identified;
use asid_core::parameter::{Parameter, Scale};
use asid_core::posterior::Edge;
use asid_core::{Error, Problem, Result};

/// Share of the prior's range by which an end moves at once. A truth just outside is then not
/// searched for far away, where draws would be wasted.
const STRIDE: f64 = 0.5;

/// Identifies within the prior's ranges, and in wider ranges while the posterior of an unknown
/// piles up at an end.
///
/// A range grows by at most `most` widths of the prior's range (on its scale). If a wider search
/// fails, for example because no engine can simulate it, the previous answer stands.
///
/// # Errors
/// Those of the first call of `identify`, and [`Error::Interrupted`].
pub fn identify(
    problem: &Problem<'_>,
    most: f64,
    identify: impl Fn(&Problem<'_>) -> Result<Identified>,
) -> Result<Identified> {
    let mut found = identify(problem)?;
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
        let next = match identify(&wider) {
            Ok(next) => next,
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            Err(_) => break,
        };
        piles = self::piles(&next);
        found = merged(found, next, &parameters, problem.parameters);
    }
    Ok(found)
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
