//! What a linearisation is asked for, and its result for one episode.

/// A value of the parameters, besides the present one, at which the model is evaluated.
///
/// The column is the change from the present value to this one, divided by `scale`.
#[derive(Clone, Debug)]
pub struct Variation {
    /// All parameters.
    pub theta: Vec<f64>,
    /// Divisor of the change.
    pub scale: f64,
}

/// What a pass computes besides the defects and residuals.
#[derive(Clone, Copy, Debug, Default)]
pub struct Derivatives {
    /// Derivatives with respect to the state.
    pub state: bool,
    /// Derivatives with respect to generalized forces held over the row (N or N m).
    pub force: bool,
    /// Derivatives with respect to generalized forces in the first physics step of a row.
    pub jolt: bool,
}

/// One episode, linearised about a trajectory.
///
/// Matrices are row-major, one per row of the log. States are in tangent coordinates (`nx = 2 nv`),
/// readings in the sensors' units.
#[derive(Clone, Debug, Default)]
pub struct LinearEpisode {
    /// Number of rows.
    pub rows: usize,
    /// `f(x_k) - x_{k+1}`, `(rows - 1) x nx`; not finite where the engine failed.
    pub defect: Vec<f64>,
    /// Derivative of `f` with respect to the state, `(rows - 1) x nx x nx`.
    pub a: Vec<f64>,
    /// Change at the end of a row per unit change in each of its physics steps,
    /// `(rows - 1) x nx x nx`.
    ///
    /// This is the sum of the powers of one step's derivative. Empty where the derivatives are not
    /// those of one step.
    pub carried: Vec<f64>,
    /// Derivative of `f` with respect to a generalized force held over the row,
    /// `(rows - 1) x nx x nv`.
    pub b: Vec<f64>,
    /// The same for a force in the first physics step of the row.
    pub jolt: Vec<f64>,
    /// `y_k - h(x_k)`, `rows x ns`; NaN where a reading is missing.
    pub residual: Vec<f64>,
    /// Derivative of `h` with respect to the state, `rows x ns x nx`; for a segment, with respect
    /// to its initial state.
    pub h: Vec<f64>,
    /// Number of readings of each entry, for a late sensor, that measure a time before the first
    /// row, or the row of a later reading; `ns`, or empty for none.
    pub early: Vec<f64>,
    /// Row that each reading measures, `rows x ns`; empty if no sensor remembers. `None` for a time
    /// before the first row, and for a missing reading of a late sensor.
    pub assigned: Vec<Option<usize>>,
    /// Change of `f` by each variation, `(rows - 1) x nx x m`.
    pub state_columns: Vec<f64>,
    /// Change of `h` by each variation, `rows x ns x m`; for a segment, over its whole replay.
    pub reading_columns: Vec<f64>,
}

impl LinearEpisode {
    /// Allocates the wanted arrays, without results.
    ///
    /// The sizes are `rows` rows, `nv` degrees of freedom, `ns` entries of a reading and `m`
    /// variations. A segment has no derivatives from row to row.
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
            assigned: Vec::new(),
            state_columns: vec![0.0; usize::from(!segment) * steps * nx * m],
            reading_columns: vec![0.0; rows * ns * m],
        }
    }
    /// Flags the coordinates of a segment's initial state about which its readings carry no
    /// information.
    ///
    /// The information is the sum of squared derivatives over the readings' variances `r`, times
    /// the coordinate's prior variance `open`. It has to reach `least`.
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
        // Two readings per row, of which those of the first row do not count.
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
        // 4 / 0.01 and 1e-4 / 0.01 per unit of variance.
        assert_eq!(blind([1.0; 3]), [false, true, true]);
        assert_eq!(blind([1e-6, 1.0, 100.0]), [true, true, false]);
    }
}
