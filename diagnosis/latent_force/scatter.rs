//! What replays of a segment scatter by, though nothing is missing.
//!
//! A replay is known only as well as its start and its integrator. Within what the readings leave open of a start, a puck that is
//! pushed at an edge turns left or right: its replays are far apart, and slopes tell nothing of it. What replays from starts drawn of
//! the posterior do *beyond* their slopes is the error of the linearisation, and its covariance is added to that of the readings, as
//! in posterior linearisation (García-Fernández, Svensson, Morelande and Särkkä 2015). The covariance is of low rank: each draw is a
//! direction with a coefficient of its own, `N(0, 1)`, that is projected out together with the start. What half the time
//! step changes is one direction more.

use asid_core::Result;
use asid_core::rng::Streams;
use nalgebra::DVector;
use rand::Rng as _;
use rand_distr::StandardNormal;

use crate::machine::Machine;

use super::context::Context;
use super::estimate::Estimate;
use super::fit::Hypothesis;
use super::step_map::{Derivatives, LinearEpisode, StepMap};
use super::tangent::retract;
use super::walk::Walk;

/// Starts that are drawn: the least with which the deviation of a reading is known to a quarter of itself.
const DRAWS: usize = 8;
/// Share of what half the time step changes that each segment may have of its own: another integrator errs otherwise, and not in the
/// same proportion everywhere.
const OWN_INTEGRATOR: f64 = 0.3;

/// Directions in which the replays of each walk scatter, `rows x readings x directions` in the sensors' units.
#[derive(Clone, Debug, Default)]
pub struct Scatter {
    /// Of each walk; empty for one that is no segment.
    pub directions: Vec<Vec<f64>>,
    /// Share of the rows in segments whose readings scatter by more than their noise.
    pub lost: f64,
}

impl Scatter {
    /// Of the segments about a model at some values and an estimate of it; `finer` is the machine at half its time step, where the engine takes it.
    ///
    /// # Errors
    /// When the engine fails.
    pub fn of(
        context: &Context<'_>,
        (hypothesis, theta): (&Hypothesis, &[f64]),
        estimate: &Estimate,
        finer: Option<&Machine>,
    ) -> Result<Self> {
        let parameters = hypothesis.parameters();
        let specs = &hypothesis.specs;
        let layout = &context.plant().layout;
        let (nx, width) = (2 * layout.nv, layout.nq + layout.nv);
        let mut map = context.map(specs, &parameters, nx + 1)?;
        let slopes = Derivatives {
            state: true,
            ..Derivatives::default()
        };
        let at = |map: &mut StepMap<'_>, trajectory: &[Vec<f64>], want| {
            map.linearise(theta, trajectory, want, &context.start_steps(), &[])
        };
        let here = at(&mut map, &estimate.trajectory, slopes)?;
        let roots = estimate.start_roots(context, &here);
        let mut random = Streams::new(estimate.rolls).stream("scatter of segments");
        let mut directions = vec![Vec::new(); here.len()];
        for _ in 0..DRAWS {
            let mut trajectory = estimate.trajectory.clone();
            let mut changes = Vec::with_capacity(here.len());
            for (states, root) in trajectory.iter_mut().zip(&roots) {
                let normal =
                    DVector::from_fn(root.ncols(), |_, _| random.sample::<f64, _>(StandardNormal));
                let change = if root.ncols() == 0 {
                    DVector::zeros(nx)
                } else {
                    root * normal
                };
                retract(layout, &mut states[..width], change.as_slice());
                changes.push(change);
            }
            let there = at(&mut map, &trajectory, Derivatives::default())?;
            let share = (DRAWS as f64).sqrt().recip();
            for (w, change) in changes.iter().enumerate() {
                let beyond = beyond_slopes(&here[w], &there[w], change);
                directions[w].push(beyond.iter().map(|x| share * x).collect());
            }
        }
        if let Some(finer) = finer {
            let walks: Vec<Walk> = context.walks.iter().map(Walk::halved).collect();
            let rows = (context.logs, &walks[..]);
            let mut map = StepMap::new(finer, specs, &parameters, rows, 1)?;
            let there = at(&mut map, &estimate.trajectory, Derivatives::default())?;
            let still = DVector::zeros(nx);
            for (w, there) in there.iter().enumerate() {
                let change = beyond_slopes(&here[w], there, &still);
                directions[w].push(change.iter().map(|x| OWN_INTEGRATOR * x).collect());
            }
        }
        let mut lost = (0, 0);
        for (walk, directions) in context.walks.iter().zip(&mut directions) {
            if walk.segment.is_none() {
                directions.clear();
                continue;
            }
            let ns = estimate.noise.r.len();
            for row in 0..walk.len() {
                let square = |d: &Vec<f64>| -> f64 {
                    let own = d[row * ns..(row + 1) * ns].iter().zip(&estimate.noise.r);
                    own.map(|(x, r)| x * x / r).sum()
                };
                let power: f64 = directions.iter().map(square).sum();
                lost.0 += usize::from(power > ns as f64);
                lost.1 += 1;
            }
        }
        Ok(Self {
            directions: directions.into_iter().map(side_by_side).collect(),
            lost: lost.0 as f64 / f64::max(lost.1 as f64, 1.0),
        })
    }
}

/// What the readings of a replay from a start moved by a change do beyond what slopes say; zero where one of them is missing.
fn beyond_slopes(here: &LinearEpisode, there: &LinearEpisode, change: &DVector<f64>) -> Vec<f64> {
    let nx = change.len();
    let each = here.residual.iter().zip(&there.residual).enumerate();
    each.map(|(at, (a, b))| {
        let slopes = &here.h[at * nx..(at + 1) * nx];
        let linear: f64 = slopes.iter().zip(change.iter()).map(|(h, c)| h * c).sum();
        let beyond = a - b - linear;
        if beyond.is_finite() { beyond } else { 0.0 }
    })
    .collect()
}

/// Directions as the columns of one array.
fn side_by_side(directions: Vec<Vec<f64>>) -> Vec<f64> {
    let n = directions.first().map_or(0, Vec::len);
    (0..n)
        .flat_map(|at| directions.iter().map(move |d| d[at]).collect::<Vec<_>>())
        .collect()
}
