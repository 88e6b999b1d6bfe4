//! Columns that show along an episode: those of another episode's values, or of a contact that it has not, are zero all along, and
//! take no part in its regression.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use crate::latent_force::step_map::LinearEpisode;

/// The columns of an episode that are not zero all along.
pub(super) struct Shown<'c> {
    /// Their places among all `m`.
    places: Vec<usize>,
    m: usize,
    /// Of the readings, `rows x ns x len`.
    pub(super) readings: Cow<'c, [f64]>,
    /// Of the states, `(rows - 1) x nx x len`.
    pub(super) states: Cow<'c, [f64]>,
}

/// Some places of each row of `m` numbers.
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
    /// Of an episode with `m` columns.
    pub(super) fn of(linear: &'c LinearEpisode, m: usize) -> Self {
        let (readings, states) = (&linear.reading_columns, &linear.state_columns);
        let mut shows = vec![false; m];
        for row in [readings, states]
            .into_iter()
            .flat_map(|c| c.chunks_exact(m.max(1)))
        {
            shows.iter_mut().zip(row).for_each(|(s, x)| *s |= *x != 0.0);
        }
        let places: Vec<usize> = (0..m).filter(|&i| shows[i]).collect();
        Self {
            readings: pick(readings, m, &places),
            states: pick(states, m, &places),
            places,
            m,
        }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Their products among all columns.
    pub(super) fn spread(
        &self,
        gram: &DMatrix<f64>,
        moment: &DVector<f64>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let mut all = (DMatrix::zeros(self.m, self.m), DVector::zeros(self.m));
        for (i, &p) in self.places.iter().enumerate() {
            all.1[p] = moment[i];
            for (j, &q) in self.places.iter().enumerate() {
                all.0[(p, q)] = gram[(i, j)];
            }
        }
        all
    }
}
