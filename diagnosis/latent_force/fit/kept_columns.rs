//! Columns of tolerances, kept while they hardly change (a chord method), from one fit to the next too.
//!
//! A machine has many tolerances, and each is a simulation of all logs in each linearisation. A gram more, or a millimetre, does nearly the
//! same all along a search, for the trajectory stays near the readings.

use std::sync::Arc;

use crate::latent_force::fitted_value::Unknown;
use crate::latent_force::step_map::LinearEpisode;

/// Linearisations that they are kept for in one fit: a race of so many takes none, a fit to the end takes them anew as its other values move.
const KEPT: usize = 4;

/// Columns of one walk: of the next states, `(rows - 1) x nx x m`, and of the readings, `rows x ns x m`.
#[derive(Debug, Default)]
struct Along {
    states: Vec<f64>,
    readings: Vec<f64>,
}

/// Columns of tolerances, in deviations of their priors.
#[derive(Clone, Debug, Default)]
pub(super) struct KeptColumns {
    /// Names of their parameters.
    names: Arc<Vec<String>>,
    walks: Arc<Vec<Along>>,
    /// Linearisations that have used them.
    used: usize,
}

/// The numbers of some columns of a row-major matrix of `m`.
fn picked(all: &[f64], m: usize, columns: &[usize]) -> Vec<f64> {
    let rows = all.chunks_exact(m);
    rows.flat_map(|row| columns.iter().map(|&c| row[c]))
        .collect()
}

/// A row-major matrix of two: `from` has for each column its place in the second (of `n`), or none for the next of the first (of `m`).
fn woven(
    (fresh, m): (&[f64], usize),
    (kept, n): (&[f64], usize),
    from: &[Option<usize>],
) -> Vec<f64> {
    let rows = kept.len() / n;
    let mut out = Vec::with_capacity(rows * from.len());
    for k in 0..rows {
        let (mut fresh, kept) = (fresh[k * m..(k + 1) * m].iter(), &kept[k * n..(k + 1) * n]);
        out.extend(from.iter().map(|place| match place {
            Some(place) => kept[*place],
            None => fresh.next().copied().unwrap_or(0.0),
        }));
    }
    out
}

impl KeptColumns {
    /// The same at the beginning of another fit.
    pub(super) fn begun(&self) -> Self {
        Self {
            used: 0,
            ..self.clone()
        }
    }

    /// The place here of each of the values that are fitted; none for all where one that is a tolerance has no column here, or they have
    /// been used for long.
    pub(super) fn places(&self, unknowns: &[Unknown], free: &[usize]) -> Vec<Option<usize>> {
        let place = |name: &String| self.names.iter().position(|n| n == name);
        let mut places = Vec::with_capacity(free.len());
        for &i in free {
            let u = &unknowns[i];
            let kept = u.is_tolerance.then(|| place(&u.parameter.name)).flatten();
            if u.is_tolerance && kept.is_none() || self.used >= KEPT {
                return vec![None; free.len()];
            }
            places.push(kept);
        }
        places
    }

    /// Puts the kept columns at their `places` among the fresh ones of a linearisation.
    pub(super) fn join(&mut self, linear: &mut [LinearEpisode], places: &[Option<usize>]) {
        let n = self.names.len();
        let fresh = places.iter().filter(|p| p.is_none()).count();
        if fresh == places.len() {
            return;
        }
        self.used += 1;
        for (linear, kept) in linear.iter_mut().zip(self.walks.iter()) {
            linear.state_columns = woven((&linear.state_columns, fresh), (&kept.states, n), places);
            linear.reading_columns = woven(
                (&linear.reading_columns, fresh),
                (&kept.readings, n),
                places,
            );
        }
    }

    /// Keeps the columns of the tolerances of a linearisation, all of which are fresh.
    pub(super) fn keep(&mut self, linear: &[LinearEpisode], unknowns: &[Unknown], free: &[usize]) {
        let m = free.len();
        let columns: Vec<usize> = (0..m).filter(|&k| unknowns[free[k]].is_tolerance).collect();
        if columns.is_empty() {
            return;
        }
        let name = |&k: &usize| unknowns[free[k]].parameter.name.clone();
        let along = |linear: &LinearEpisode| Along {
            states: picked(&linear.state_columns, m, &columns),
            readings: picked(&linear.reading_columns, m, &columns),
        };
        self.names = Arc::new(columns.iter().map(name).collect());
        self.walks = Arc::new(linear.iter().map(along).collect());
        self.used = 1;
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

    /// Two rows of states and of readings: the number of a column is its name's, its row's tens.
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

    #[test]
    fn kept_columns_come_between_fresh_ones_by_name() {
        let all = ["mass", "slip", "delay", "spring"];
        let unknowns: Vec<Unknown> = [(0, true), (1, false), (2, true), (3, false)]
            .map(|(i, t)| unknown(all[i], t))
            .to_vec();
        let mut kept = KeptColumns::default();
        kept.keep(&[linear(&[0.0, 1.0, 2.0])], &unknowns, &[0, 1, 2]);
        // Another model, in another order: of four values two are kept.
        let free = [3, 2, 1, 0];
        let places = kept.places(&unknowns, &free);
        assert_eq!(places, [None, Some(1), None, Some(0)]);
        let mut fresh = [linear(&[3.0, 1.0])];
        kept.join(&mut fresh, &places);
        assert_eq!(
            fresh[0].state_columns,
            linear(&[3.0, 2.0, 1.0, 0.0]).state_columns
        );
        assert_eq!(fresh[0].reading_columns, fresh[0].state_columns);
    }

    #[test]
    fn columns_that_were_used_for_long_are_taken_anew() {
        let unknowns = [unknown("mass", true)];
        let mut kept = KeptColumns::default();
        assert_eq!(kept.places(&unknowns, &[0]), [None]);
        kept.keep(&[linear(&[0.0])], &unknowns, &[0]);
        while kept.places(&unknowns, &[0]) == [Some(0)] {
            kept.join(&mut [linear(&[])], &[Some(0)]);
        }
        assert_eq!(kept.used, KEPT);
        assert_eq!(kept.begun().places(&unknowns, &[0]), [Some(0)]);
    }
}
