//! Columns of values, kept while they hardly change (a chord method); those of tolerances are kept
//! from one fit to the next too.
//!
//! Each column costs a simulation of all logs per linearisation. During a fit the trajectory stays
//! near the readings, so a column hardly changes while no value moves far. A machine has many
//! tolerances. A gram or a millimetre more has nearly the same effect throughout a search.

use std::sync::Arc;

use crate::latent_force::fitted_value::Unknown;
use crate::latent_force::step_map::LinearEpisode;

/// Linearisations for which the columns of tolerances are kept in one fit: a race of this length
/// computes none. A fit to the end computes them anew as its other values move.
const KEPT: usize = 4;
/// Largest move of any other value while columns are kept, relative to the smaller of its size and
/// its prior's standard deviation: a nonlinear law bends over either.
const KEPT_MOVE: f64 = 0.1;

/// Columns of one walk: of the next states, `(rows - 1) x nx x m`, and of the readings,
/// `rows x ns x m`.
#[derive(Debug, Default)]
struct Along {
    states: Vec<f64>,
    readings: Vec<f64>,
}

/// Columns of values, in standard deviations of their priors.
#[derive(Clone, Debug, Default)]
pub(super) struct KeptColumns {
    /// Names of the columns' parameters, and whether they are tolerances.
    names: Arc<Vec<String>>,
    of_tolerances: Arc<Vec<bool>>,
    walks: Arc<Vec<Along>>,
    /// All values of the model where the columns of values other than tolerances were taken; `None`
    /// for those of another fit.
    theta: Option<Vec<f64>>,
    /// Linearisations that have used the columns.
    used: usize,
}

/// Returns the largest move of a value, in standard deviations of its prior, without tolerances,
/// whose priors are narrow.
pub(super) fn furthest(from: &[f64], to: &[f64], unknowns: &[Unknown]) -> f64 {
    let moved = |((a, b), u): ((&f64, &f64), &Unknown)| (a - b).abs() / u.deviation;
    let pairs = from.iter().zip(to).zip(unknowns);
    let pairs = pairs.filter(|(_, u)| !u.is_tolerance);
    pairs.map(moved).fold(0.0, f64::max)
}

/// Whether every value other than a tolerance has moved by less than its columns allow.
fn is_near(from: &[f64], to: &[f64], unknowns: &[Unknown]) -> bool {
    let mut pairs = from.iter().zip(to).zip(unknowns);
    pairs.all(|((a, b), u)| {
        u.is_tolerance || (a - b).abs() <= KEPT_MOVE * u.deviation.min(a.abs().max(b.abs()))
    })
}

/// Copies columns of a row-major matrix of `n` columns to their places in one of `m` columns.
fn fill(to: &mut [f64], m: usize, (from, n): (&[f64], usize), places: &[Option<usize>]) {
    for (to, from) in to.chunks_exact_mut(m).zip(from.chunks_exact(n)) {
        for (to, place) in to.iter_mut().zip(places) {
            if let Some(place) = place {
                *to = from[*place];
            }
        }
    }
}

impl KeptColumns {
    /// Returns the columns for the beginning of another fit, whose values differ.
    pub(super) fn begun(&self) -> Self {
        Self {
            used: 0,
            theta: None,
            ..self.clone()
        }
    }

    /// Drops the columns of values other than tolerances.
    pub(super) fn renew(&mut self) {
        self.theta = None;
    }

    /// Returns the place of each fitted value's kept column; `None` where it must be computed.
    ///
    /// All are `None` if a tolerance has no kept column, or if the columns have been used for long.
    pub(super) fn places(
        &self,
        (unknowns, free): (&[Unknown], &[usize]),
        theta: &[f64],
    ) -> Vec<Option<usize>> {
        let is_near = (self.theta.as_ref()).is_some_and(|t| is_near(t, theta, unknowns));
        let place = |u: &Unknown| {
            let place = self.names.iter().position(|n| *n == u.parameter.name)?;
            (is_near || u.is_tolerance && self.of_tolerances[place]).then_some(place)
        };
        let mut places = Vec::with_capacity(free.len());
        for &i in free {
            let u = &unknowns[i];
            let kept = place(u);
            if u.is_tolerance && kept.is_none() || self.used >= KEPT {
                return vec![None; free.len()];
            }
            places.push(kept);
        }
        places
    }

    /// Inserts the kept columns at their `places` into a linearisation, except along walks whose
    /// columns were computed `anew`.
    pub(super) fn join(
        &mut self,
        linear: &mut [LinearEpisode],
        places: &[Option<usize>],
        anew: &[bool],
    ) {
        let (m, n) = (places.len(), self.names.len());
        if places.iter().all(Option::is_none) {
            return;
        }
        self.used += 1;
        let walks = linear.iter_mut().zip(self.walks.iter()).zip(anew);
        for ((linear, kept), _) in walks.filter(|(_, anew)| !**anew) {
            fill(&mut linear.state_columns, m, (&kept.states, n), places);
            fill(&mut linear.reading_columns, m, (&kept.readings, n), places);
        }
    }

    /// Keeps the columns of a linearisation at given values; `kept` flags those that were already
    /// kept.
    pub(super) fn keep(
        &mut self,
        linear: &[LinearEpisode],
        (unknowns, free): (&[Unknown], &[usize]),
        (theta, kept): (&[f64], &[bool]),
    ) {
        if !kept.contains(&true) {
            self.used = 1;
        }
        let is_tolerance = |&i: &usize| unknowns[i].is_tolerance;
        let mut others = free.iter().zip(kept).filter(|(i, _)| !is_tolerance(i));
        if others.any(|(_, kept)| !kept) {
            self.theta = Some(theta.to_vec());
        }
        let along = |linear: &LinearEpisode| Along {
            states: linear.state_columns.clone(),
            readings: linear.reading_columns.clone(),
        };
        let name = |&i: &usize| unknowns[i].parameter.name.clone();
        self.names = Arc::new(free.iter().map(name).collect());
        self.of_tolerances = Arc::new(free.iter().map(is_tolerance).collect());
        self.walks = Arc::new(linear.iter().map(along).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::parameter::{Parameter, Scale};

    fn unknown(name: &str, is_tolerance: bool) -> Unknown {
        let parameter = Parameter {
            name: name.into(),
            targets: Vec::new(),
            range: [-1.0, 1.0],
            scale: Scale::default(),
            unit: String::new(),
        };
        Unknown {
            is_tolerance,
            ..Unknown::of_study(&parameter, 0.0)
        }
    }

    /// Two rows of states and of readings: the number of a column is its name's plus ten times its
    /// row.
    fn linear(names: &[f64]) -> LinearEpisode {
        let columns: Vec<f64> = [0.0, 10.0]
            .iter()
            .flat_map(|row| names.iter().map(move |n| row + n))
            .collect();
        LinearEpisode {
            state_columns: columns.clone(),
            reading_columns: columns,
            ..LinearEpisode::default()
        }
    }

    /// A mass, a slip, a delay and a spring, of which the mass and the delay are tolerances.
    fn four() -> Vec<Unknown> {
        [
            ("mass", true),
            ("slip", false),
            ("delay", true),
            ("spring", false),
        ]
        .map(|(name, is_tolerance)| unknown(name, is_tolerance))
        .to_vec()
    }

    /// Columns of the first three.
    fn kept(unknowns: &[Unknown]) -> KeptColumns {
        let mut kept = KeptColumns::default();
        let fresh = [linear(&[0.0, 1.0, 2.0])];
        let theta = [0.0, 0.5, 0.0, 0.0];
        kept.keep(&fresh, (unknowns, &[0, 1, 2]), (&theta, &[false; 3]));
        kept
    }

    #[test]
    fn columns_of_tolerances_of_another_fit_come_between_fresh_ones_by_name() {
        let unknowns = four();
        let mut kept = kept(&unknowns).begun();
        let free = [3, 2, 1, 0];
        let places = kept.places((&unknowns, &free), &[0.0; 4]);
        assert_eq!(places, [None, Some(2), None, Some(0)]);
        // Kept columns were not computed; those of the second walk are fresh.
        let mut fresh = [linear(&[3.0, 9.0, 1.0, 9.0]), linear(&[3.0, 9.0, 1.0, 9.0])];
        kept.walks = Arc::new(vec![
            Along {
                states: linear(&[0.0, 1.0, 2.0]).state_columns,
                readings: linear(&[0.0, 1.0, 2.0]).reading_columns,
            },
            Along::default(),
        ]);
        kept.join(&mut fresh, &places, &[false, true]);
        let joined = linear(&[3.0, 2.0, 1.0, 0.0]);
        assert_eq!(fresh[0].state_columns, joined.state_columns);
        assert_eq!(fresh[0].reading_columns, joined.reading_columns);
        assert_eq!(
            fresh[1].state_columns,
            linear(&[3.0, 9.0, 1.0, 9.0]).state_columns
        );
    }

    #[test]
    fn columns_of_a_fit_are_kept_while_no_value_but_a_tolerance_has_moved_far() {
        let unknowns = four();
        let kept = kept(&unknowns);
        let places = |theta: [f64; 4]| kept.places((&unknowns, &[0, 1, 2]), &theta);
        assert_eq!(places([0.9, 0.51, 0.0, 0.0]), [Some(0), Some(1), Some(2)]);
        assert_eq!(places([0.0, 0.56, 0.0, 0.0]), [Some(0), None, Some(2)]);
    }

    #[test]
    fn columns_that_were_used_for_long_are_taken_anew() {
        let unknowns = [unknown("mass", true)];
        let model = (&unknowns[..], &[0][..]);
        let mut kept = KeptColumns::default();
        assert_eq!(kept.places(model, &[0.0]), [None]);
        kept.keep(&[linear(&[0.0])], model, (&[0.0], &[false]));
        while kept.places(model, &[0.0]) == [Some(0)] {
            kept.join(&mut [linear(&[0.0])], &[Some(0)], &[false]);
        }
        assert_eq!(kept.used, KEPT);
        assert_eq!(kept.begun().places(model, &[0.0]), [Some(0)]);
    }
}
