//! The ceiling: how much of the remainder a flexible model can predict, and from which variable.
//!
//! The remainder of a diagnosis (a missing force, a residual) is a series that is regressed on
//! variables of the motion. The model is additive, with a piecewise linear function of each
//! variable (Hastie and Tibshirani 1986) and a normal prior on its values at the knots. Only the
//! power that it predicts in cross-validation counts, of episodes left out in turn: noise and
//! chance are not predicted.

mod additive_model;

use additive_model::{foretold, knots, sums};

/// A variable on which a series may depend.
#[derive(Clone, Debug)]
pub struct Variable {
    /// Name, such as `speed`.
    pub name: String,
    /// Kinds of effects that depend on it.
    pub kinds: &'static [&'static str],
    /// Value in each row.
    pub values: Vec<f64>,
}

/// A series of one episode, with the variables on which it may depend; all series of a place have
/// the same variables.
#[derive(Clone, Debug)]
pub struct Course {
    /// The series.
    pub left: Vec<f64>,
    /// The variables.
    pub variables: Vec<Variable>,
}

/// How much of a series is predictable.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Foretold {
    /// Share of its power that all variables together predict, in episodes that the fit did not
    /// see.
    pub share: f64,
    /// The variable that predicts most by itself; `None` where none predicts any.
    pub variable: Option<String>,
    /// Kinds of effects that depend on that variable.
    pub kinds: Vec<String>,
}

/// The remainder at one place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Left {
    /// Name of the joint or sensor.
    pub place: String,
    /// Power of the remainder, relative to that of the other places.
    pub weight: f64,
    /// How much of it is predictable.
    pub foretold: Foretold,
}

/// Returns the predictable share of the power that remains at all places together.
#[must_use]
pub fn learnable(left: &[Left]) -> f64 {
    let sum: f64 = left.iter().map(|l| l.weight).sum();
    let foretold: f64 = left.iter().map(|l| l.weight * l.foretold.share).sum();
    if sum > 0.0 { foretold / sum } else { 0.0 }
}

/// Returns the place with the most predictable power; the one with the most power, where nothing is
/// predictable.
#[must_use]
pub fn most(left: &[Left]) -> Option<&Left> {
    let foretold = |l: &&Left| l.weight * l.foretold.share;
    let named = left.iter().filter(|l| l.foretold.variable.is_some());
    let most = named.max_by(|a, b| foretold(a).total_cmp(&foretold(b)));
    most.or_else(|| left.iter().max_by(|a, b| a.weight.total_cmp(&b.weight)))
}

/// Least share that a variable must predict by itself to be named: any two slow series have a
/// smaller share in common.
const NAMED: f64 = 0.05;

/// Returns how much of a series its variables predict.
#[must_use]
pub fn learn(courses: &[Course]) -> Foretold {
    let Some(first) = courses.first() else {
        return Foretold::default();
    };
    let knots: Vec<Vec<f64>> = (0..first.variables.len())
        .map(|v| {
            knots(
                courses
                    .iter()
                    .flat_map(|c| c.variables[v].values.iter().copied()),
            )
        })
        .collect();
    let parts = sums(courses, &knots);
    let all: Vec<usize> = (0..knots.iter().map(Vec::len).sum()).collect();
    let share = foretold(&parts, &all);
    let mut at = 0;
    let alone = knots.iter().map(|k| {
        let own: Vec<usize> = (at..at + k.len()).collect();
        at += k.len();
        foretold(&parts, &own)
    });
    let best = alone.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    match best.filter(|(_, s)| *s > NAMED) {
        Some((v, alone)) => Foretold {
            share: share.max(alone),
            variable: Some(first.variables[v].name.clone()),
            kinds: first.variables[v]
                .kinds
                .iter()
                .map(|&k| k.to_owned())
                .collect(),
        },
        None => Foretold {
            share,
            ..Foretold::default()
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look like noise, between -1 and 1.
    fn noise(seed: usize, k: usize) -> f64 {
        let x = (12.9898 * k as f64 + 78.233 * seed as f64).sin() * 43_758.545;
        2.0 * (x - x.floor()) - 1.0
    }

    /// Three episodes of a motion whose `left` is a function of position, speed and noise.
    fn courses(left: impl Fn(f64, f64, f64) -> f64) -> Vec<Course> {
        let variable = |name: &str, kinds, values: Vec<f64>| Variable {
            name: name.into(),
            kinds,
            values,
        };
        (0..3)
            .map(|e| {
                let t = |k: usize| 0.02 * k as f64 + 7.0 * e as f64;
                let position: Vec<f64> = (0..400).map(|k| (1.3 * t(k)).sin()).collect();
                let speed: Vec<f64> = (0..400).map(|k| (2.9 * t(k)).cos()).collect();
                Course {
                    left: (0..400)
                        .map(|k| left(position[k], speed[k], noise(e, k)))
                        .collect(),
                    variables: vec![
                        variable("position", &["stiffness-like"], position),
                        variable("speed", &["friction-like"], speed),
                    ],
                }
            })
            .collect()
    }

    #[test]
    fn dry_friction_goes_with_speed_and_is_foretold() {
        let found = learn(&courses(|_, v, _| -0.4 * v.signum()));
        assert!(found.share > 0.9, "{found:?}");
        assert_eq!(found.variable.as_deref(), Some("speed"));
        assert_eq!(found.kinds, ["friction-like"]);
    }

    #[test]
    fn a_spring_beside_noise_is_foretold_by_its_share_of_the_power() {
        // The power of the spring x^2 is 1/2, that of the noise 1/3.
        let found = learn(&courses(|x, _, n| x + n));
        assert!((found.share - 0.6).abs() < 0.06, "{found:?}");
        assert_eq!(found.variable.as_deref(), Some("position"));
    }

    #[test]
    fn noise_is_not_foretold() {
        let found = learn(&courses(|_, _, n| n));
        assert!(found.share < 0.02, "{found:?}");
        assert_eq!(found.variable, None);
    }

    #[test]
    fn places_count_by_the_power_that_is_left_there() {
        let left = |place: &str, weight, share, variable: Option<&str>| Left {
            place: place.into(),
            weight,
            foretold: Foretold {
                share,
                variable: variable.map(str::to_owned),
                kinds: Vec::new(),
            },
        };
        let all = [
            left("shoulder", 3.0, 0.1, Some("time")),
            left("elbow", 1.0, 0.9, Some("speed")),
        ];
        assert!((learnable(&all) - 0.3).abs() < 1e-12);
        assert_eq!(most(&all).unwrap().place, "elbow");
        let noise = [left("a", 1.0, 0.0, None), left("b", 2.0, 0.0, None)];
        assert_eq!(most(&noise).unwrap().place, "b");
        assert_eq!(learnable(&[]), 0.0);
    }

    #[test]
    fn one_episode_is_cut_into_parts_and_rows_without_a_value_are_passed_over() {
        let mut one = courses(|_, v, _| v);
        one.truncate(1);
        one[0].left[17] = f64::NAN;
        one[0].variables[0].values[40] = f64::NAN;
        assert!(learn(&one).share > 0.9);
        assert_eq!(learn(&[]), Foretold::default());
    }
}
