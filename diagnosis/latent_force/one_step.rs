//! Whether the derivatives of one physics step represent those of a whole row.
//!
//! They do where the machine hardly changes over a row. They do not where a stiff drive comes to
//! rest within one. Neither the model nor the log shows which is the case, so a few rows are
//! differentiated both ways. Once a drive turns out to be softer, one step is enough from then on.

use asid_core::{Parameter, Result};
use asid_effects::EffectSpec;

use super::context::Context;
use super::step_map::{Derivatives, LinearEpisode, StepMap};
use super::walk::Walk;

/// Rows in the middle of each walk that are differentiated both ways.
const ROWS: usize = 16;
/// Relative difference of the derivatives up to which the two ways agree in a row.
///
/// It is a Frobenius norm, with coordinates in units of their largest value. A chord method gains a
/// digit a round with derivatives that are right to a tenth.
const APART: f64 = 0.1;
/// Share of the rows that may differ by more, for example where a joint reaches a stop within the
/// row.
const ODD: f64 = 0.05;

/// State derivatives along a few rows, computed both ways, one a walk that is no segment.
pub struct BothWays {
    /// Derivatives over whole rows.
    pub by_rows: Vec<LinearEpisode>,
    /// Derivatives of one physics step of each row, extended to the row.
    by_steps: Vec<LinearEpisode>,
}

/// Whether the state derivatives of one physics step, extended to its row, are those of the row.
///
/// The model has some effects, and the rows are those of a trajectory.
///
/// # Errors
/// When the engine fails.
pub fn one_step_tells(
    context: &Context<'_>,
    model: (&[EffectSpec], &[Parameter]),
    along: (&[f64], &[Vec<f64>]),
) -> Result<bool> {
    Ok(both_ways(context, model, along)?.one_step_tells(&context.scale))
}

/// Computes state derivatives of a model along a few rows of a trajectory both ways.
///
/// # Errors
/// When the engine fails.
pub fn both_ways(
    context: &Context<'_>,
    (specs, parameters): (&[EffectSpec], &[Parameter]),
    (theta, trajectory): (&[f64], &[Vec<f64>]),
) -> Result<BothWays> {
    let layout = &context.plant().layout;
    let (nx, width) = (2 * layout.nv, layout.nq + layout.nv);
    let (mut walks, mut states): (Vec<Walk>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let whole = context.walks.iter().zip(trajectory);
    for (walk, trajectory) in whole.filter(|(w, _)| w.segment.is_none() && w.len() > 1) {
        let rows = walk.len().min(ROWS + 1);
        let first = (walk.len() - rows) / 2;
        walks.push(walk.part(first..first + rows));
        states.push(trajectory[first * width..(first + rows) * width].to_vec());
    }
    if walks.is_empty() {
        return Ok(BothWays {
            by_rows: Vec::new(),
            by_steps: Vec::new(),
        });
    }
    let of = (context.logs, &walks[..]);
    let mut map = StepMap::new(context.machine, specs, parameters, of, nx + 1)?;
    let want = Derivatives {
        state: true,
        ..Derivatives::default()
    };
    let by_rows = map.linearise(theta, &states, want, &[], &[])?;
    map.by_one_step(true);
    let by_steps = map.linearise(theta, &states, want, &[], &[])?;
    Ok(BothWays { by_rows, by_steps })
}

impl BothWays {
    /// Whether the two ways agree, with coordinates in units of their `scale`; false if there are
    /// no rows.
    #[must_use]
    pub fn one_step_tells(&self, scale: &[f64]) -> bool {
        let nx = scale.len();
        let (mut rows, mut odd) = (0_u32, 0_u32);
        for (a, b) in self.by_rows.iter().zip(&self.by_steps) {
            for (a, b) in a.a.chunks_exact(nx * nx).zip(b.a.chunks_exact(nx * nx)) {
                let (mut apart, mut size) = (0.0, 0.0);
                for (place, (x, y)) in a.iter().zip(b).enumerate() {
                    let unit = scale[place % nx] / scale[place / nx];
                    apart += ((x - y) * unit).powi(2);
                    size += (x * unit).powi(2);
                }
                rows += 1;
                odd += u32::from(apart.is_nan() || apart > APART * APART * size);
            }
        }
        rows > 0 && f64::from(odd) <= ODD * f64::from(rows)
    }
}
