//! The columns that are non-zero along an episode.
//!
//! Columns of another episode's values, or of a contact that the episode lacks, are zero throughout
//! and take no part in its regression.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use crate::latent_force::step_map::LinearEpisode;

/// The requested columns of an episode that are not zero throughout.
pub(super) struct Shown<'c> {
    /// Their places among the requested columns.
    places: Vec<usize>,
    /// Number of requested columns.
    asked: usize,
    /// Columns of the readings, `rows x ns x len`.
    pub(super) readings: Cow<'c, [f64]>,
    /// Columns of the states, `(rows - 1) x nx x len`.
    pub(super) states: Cow<'c, [f64]>,
}

/// Selects some places of each row of `m` numbers.
fn pick<'c>(rows: &'c [f64], m: usize, places: &[usize]) -> Cow<'c, [f64]> {
    if places.len() == m {
        return Cow::Borrowed(rows);
    }
    let picked = rows
        .chunks_exact(m)
        .flat_map(|row| places.iter().map(|&p| row[p]));
    Cow::Owned(picked.collect())
}

impl<'c> Shown<'c> {
    /// Selects from an episode's `m` columns: from `some` of them, in ascending order, or from all.
    pub(super) fn of(linear: &'c LinearEpisode, m: usize, some: Option<&[usize]>) -> Self {
        let (readings, states) = (&linear.reading_columns, &linear.state_columns);
        let all: Vec<usize> = some.map_or_else(|| (0..m).collect(), <[usize]>::to_vec);
        let mut shows = vec![false; all.len()];
        for row in [readings, states]
            .into_iter()
            .flat_map(|c| c.chunks_exact(m.max(1)))
        {
            let asked = shows.iter_mut().zip(&all);
            asked.for_each(|(s, &c)| *s |= row[c] != 0.0);
        }
        let places: Vec<usize> = (0..all.len()).filter(|&i| shows[i]).collect();
        let columns: Vec<usize> = places.iter().map(|&i| all[i]).collect();
        Self {
            readings: pick(readings, m, &columns),
            states: pick(states, m, &columns),
            places,
            asked: all.len(),
        }
    }

    /// Number of non-zero columns.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Returns their products, at their places among all requested columns.
    pub(super) fn spread(
        &self,
        gram: &DMatrix<f64>,
        moment: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.asked;
        let mut all = (DMatrix::zeros(n, n), DVector::zeros(n));
        for (i, &p) in self.places.iter().enumerate() {
            all.1[p] = moment[i];
            for (j, &q) in self.places.iter().enumerate() {
                all.0[(p, q)] = gram[(i, j)];
            }
        }
        all
    }
}
