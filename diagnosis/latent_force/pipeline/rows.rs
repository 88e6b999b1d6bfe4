//! Which rows of the logs are smoothed, and which are taken in segments.

use asid_core::{Layout, Result};

use crate::bench::Bench;
use crate::latent_force::context::Taken;
use crate::latent_force::initial::{from_readings, scales};
use crate::latent_force::segments::cut;
use crate::latent_force::touching::touching;
use crate::latent_force::walk::Walk;
use crate::starts::given_start;
use crate::study::Study;
use crate::trajectory::Trajectory;

/// Physics steps of one walk along all logs times degrees of freedom, at most: a walk is taken once a coordinate and once a
/// candidate, and both grow with the degrees of freedom.
const BUDGET: f64 = 72_000.0;
/// The same times the square of the degrees of freedom, for from some six on the time of a step grows with them too: a screening of
/// a machine of 22 takes 500 walks at 50 us a step.
const SQUARE_BUDGET: f64 = 432_000.0;
/// Rows of a log that are walked in any case.
const FEWEST: usize = 150;

/// What the model does along some states.
pub(super) fn along(
    bench: &Bench,
    walks: &[Walk],
    theta: &[f64],
    states: &[Vec<f64>],
) -> Result<Trajectory> {
    let model = bench.machine.with(&[])?;
    let plant = &bench.machine.plant;
    let values = (&bench.parameters[..], theta);
    let rows: Vec<(usize, &[usize])> = walks.iter().map(|w| (w.episode, &w.rows[..])).collect();
    Trajectory::along(&*model, plant, values, &bench.train.logs, states, &rows)
}

/// Rows of the training logs that are taken, and what touches in them.
pub(super) struct Rows {
    /// One walk a log.
    walks: Vec<Walk>,
    /// Whether something touches, one flag a row.
    touches: Vec<Vec<bool>>,
    /// Largest magnitude of each tangent coordinate.
    scale: Vec<f64>,
}

impl Rows {
    /// Takes rows within the budget.
    pub(super) fn of(bench: &Bench, nominal: &[f64]) -> Result<Self> {
        let layout = bench.layout();
        let plant = &bench.machine.plant;
        let logs = &bench.train.logs;
        let whole = |e| Walk::new(logs, e, layout.timestep);
        let walks = within_budget((0..logs.episodes.len()).map(whole).collect(), layout.nv);
        let first = from_readings(plant, logs, &walks, &at_home(layout, &walks));
        let shown = along(bench, &walks, nominal, &first)?;
        Ok(Self {
            touches: touching(plant, logs, &shown),
            scale: scales(plant, &first),
            walks,
        })
    }

    /// Whether something touches in any of them.
    pub(super) fn touches(&self) -> bool {
        self.touches.iter().flatten().any(|t| *t)
    }

    /// Them in segments of a duration, s, where something touches.
    pub(super) fn cut(&self, study: &Study, bench: &Bench, duration: f64) -> Taken {
        let plant = &bench.machine.plant;
        let each = self.walks.iter().zip(&self.touches);
        let walks: Vec<Walk> = each.flat_map(|(walk, t)| cut(walk, t, duration)).collect();
        let given = |w: &Walk| {
            let episode = &study.train[w.episode].1;
            let known = w.rows[0] == 0 && episode.initial.is_some();
            known.then(|| given_start(plant, episode))
        };
        Taken {
            given: walks.iter().map(given).collect(),
            open: bench.open.clone(),
            otherwise: at_home(bench.layout(), &walks),
            scale: self.scale.clone(),
            walks,
        }
    }
}

/// The first keyframe at rest in each row of some walks.
fn at_home(layout: &Layout, walks: &[Walk]) -> Vec<Vec<f64>> {
    let home = asid_core::problem::home(layout);
    let still = [&home.0[..], &home.1[..]].concat();
    walks.iter().map(|w| still.repeat(w.len())).collect()
}

/// The first rows of each walk, as many as the budget of physics steps allows: a screening takes all of them once a column.
fn within_budget(walks: Vec<Walk>, nv: usize) -> Vec<Walk> {
    let steps: usize = walks.iter().flat_map(|w| &w.substeps).sum();
    let nv = nv.max(1) as f64;
    let share = (BUDGET / nv).min(SQUARE_BUDGET / (nv * nv)) / steps.max(1) as f64;
    if share >= 1.0 {
        return walks;
    }
    let part = |w: &Walk| {
        let rows = (share * w.len() as f64).round() as usize;
        w.part(0..rows.max(FEWEST).min(w.len()))
    };
    walks.iter().map(part).collect()
}
