//! What a linearisation is asked for, and what it gives for one episode.

/// A value of the parameters at which the model is evaluated besides the present one: the column is the
/// change from there to here, divided by `scale`.
#[derive(Clone, Debug)]
pub struct Variation {
    /// All parameters.
    pub theta: Vec<f64>,
    /// What the change is divided by.
    pub scale: f64,
}

/// What a pass computes besides the defects and residuals.
#[derive(Clone, Copy, Debug, Default)]
pub struct Derivatives {
    /// Slopes in the state.
    pub state: bool,
    /// Slopes in generalized forces, with the size of each force (N or N m) that differences are taken over.
    pub force: bool,
    /// Slopes in such forces that act in the first physics step of a row.
    pub jolt: bool,
}

/// One episode, linearised about a trajectory. Matrices are row-major, one a row of the log; states are counted
/// in tangent coordinates (`nx = 2 nv`), readings in the sensors' units.
#[derive(Clone, Debug, Default)]
pub struct LinearEpisode {
    /// Number of rows.
    pub rows: usize,
    /// `f(x_k) - x_{k+1}`, `(rows - 1) x nx`; not finite where the engine failed.
    pub defect: Vec<f64>,
    /// Slope of `f` in the state, `(rows - 1) x nx x nx`.
    pub a: Vec<f64>,
    /// What a change in each physics step of a row comes to at its end, `(rows - 1) x nx x nx`: the sum of the powers of the slope of one
    /// step. Empty where the slopes are not those of one step.
    pub carried: Vec<f64>,
    /// Slope of `f` in a generalized force held over the row, `(rows - 1) x nx x nv`.
    pub b: Vec<f64>,
    /// The same of a force in the first physics step of the row.
    pub jolt: Vec<f64>,
    /// `y_k - h(x_k)`, `rows x ns`; NaN where a reading is missing.
    pub residual: Vec<f64>,
    /// Slope of `h` in the state, `rows x ns x nx`; of a segment the slope in its start.
    pub h: Vec<f64>,
    /// Readings of each entry that tell of before the first row, where a sensor is late; `ns`, or empty for none.
    pub early: Vec<f64>,
    /// How late the readings of each entry are, s; `ns`, or empty for none.
    pub late: Vec<f64>,
    /// Change of `f` by each variation, `(rows - 1) x nx x m`.
    pub state_columns: Vec<f64>,
    /// Change of `h` by each variation, `rows x ns x m`; of a segment that of its whole replay.
    pub reading_columns: Vec<f64>,
}

impl LinearEpisode {
    /// Arrays of what is wanted for so many rows, with nothing in them yet: of `nv` degrees of freedom, `ns` entries of a reading and
    /// `m` variations. A segment has no slopes from row to row.
    pub(super) fn empty(
        rows: usize,
        (nv, ns, m): (usize, usize, usize),
        want: Derivatives,
        segment: bool,
    ) -> Self {
        let nx = 2 * nv;
        let (steps, state) = (rows - 1, usize::from(want.state && !segment));
        Self {
            rows,
            defect: vec![0.0; steps * nx],
            a: vec![0.0; state * steps * nx * nx],
            carried: Vec::new(),
            b: vec![0.0; usize::from(want.force) * steps * nx * nv],
            jolt: vec![0.0; usize::from(want.jolt) * steps * nx * nv],
            residual: vec![f64::NAN; rows * ns],
            h: vec![0.0; usize::from(want.state) * rows * ns * nx],
            early: Vec::new(),
            late: Vec::new(),
            state_columns: vec![0.0; usize::from(!segment) * steps * nx * m],
            reading_columns: vec![0.0; rows * ns * m],
        }
    }
    /// Coordinates of the start of a segment that its readings tell nothing of: whose slopes, squared, over the readings' variances `r` and times
    /// how `open` the coordinate is (a variance), add up to less than `least`.
    #[must_use]
    pub fn blind(&self, open: &[f64], r: &[f64], least: f64) -> Vec<bool> {
        let (nx, ns) = (open.len(), r.len());
        let mut information = vec![0.0; nx];
        for (at, h) in self.h.chunks_exact(nx).enumerate() {
            if self.residual[at].is_finite() {
                let each = information.iter_mut().zip(h).zip(open);
                each.for_each(|((sum, h), open)| *sum += h * h * open / r[at % ns]);
            }
        }
        information.iter().map(|sum| *sum < least).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_is_blind_where_no_reading_that_counts_tells_of_it() {
        // Two readings a row, of which the first row's do not count.
        let episode = LinearEpisode {
            rows: 2,
            residual: vec![f64::NAN, f64::NAN, 0.1, f64::NAN],
            h: [
                [9.0, 9.0, 9.0],
                [9.0, 9.0, 9.0],
                [2.0, 0.0, 0.01],
                [0.0, 9.0, 0.0],
            ]
            .concat(),
            ..LinearEpisode::default()
        };
        let blind = |open: [f64; 3]| episode.blind(&open, &[0.01, 0.01], 0.1);
        // 4 / 0.01 and 1e-4 / 0.01 for each unit of variance.
        assert_eq!(blind([1.0; 3]), [false, true, true]);
        assert_eq!(blind([1e-6, 1.0, 100.0]), [true, true, false]);
    }
}
