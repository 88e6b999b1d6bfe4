//! Selects the rows of the logs, and decides which are smoothed and which are cut into segments.

use asid_core::Result;
use asid_mjcf::Plant;

use crate::bench::Bench;
use crate::latent_force::context::Taken;
use crate::latent_force::initial::{from_readings, position_noise, scales};
use crate::latent_force::segments::{cut, whole};
use crate::latent_force::touching::{pairs_touching, touching};
use crate::latent_force::walk::Walk;
use crate::predict::Point;
use crate::starts::given_start;
use crate::study::Study;
use crate::trajectory::{Path, Trajectory};

/// Most physics steps of one walk along all logs, times degrees of freedom.
///
/// A walk is simulated once for each coordinate and each candidate, and both numbers grow with the
/// degrees of freedom.
const BUDGET: f64 = 72_000.0;
/// Most physics steps times the square of the degrees of freedom.
///
/// From about six degrees of freedom on, the time of a step also grows with their number. A
/// screening of a machine with 22 takes 500 walks at 50 us a step.
const SQUARE_BUDGET: f64 = 432_000.0;
/// Fewest rows of a log that are used, whatever the budget.
const FEWEST: usize = 150;

/// Trajectory quantities of the model along given states.
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

/// Replay of the training logs with the model as given.
fn replayed(bench: &Bench, nominal: &[f64]) -> Result<Trajectory> {
    let machine = &bench.machine;
    let model = machine.with(&[])?;
    let point = Point {
        theta: nominal.to_vec(),
        starts: bench.train.starts.clone(),
    };
    let (plant, logs) = (&machine.plant, &bench.train.logs);
    let (parameters, threads) = (&bench.parameters, machine.threads);
    Trajectory::of(&*model, plant, parameters, logs, &point, threads)
}

/// Takes the contacts of a free body from the replays if the body touches nothing along its
/// readings.
///
/// Such readings are offset from the coordinates of the model, because a tracker has another zero.
/// The body seems to float, but it rests on something.
fn support(plant: &Plant, shown: &mut Trajectory, replayed: &Trajectory, walks: &[Walk]) {
    let along_readings = pairs_touching(shown);
    let n = shown.pairs.len();
    for (i, pair) in shown.pairs.iter().enumerate() {
        let is_free = |body: &usize| plant.free_joint(*body).is_some();
        if along_readings.contains(pair) || !pair.iter().any(is_free) {
            continue;
        }
        for (path, walk) in shown.episodes.iter_mut().zip(walks) {
            let forces = path.contact.iter_mut().skip(i).step_by(n);
            for (force, row) in forces.zip(&walk.rows) {
                *force = replayed.episodes[walk.episode].contact[row * n + i];
            }
        }
    }
}

/// Rows of the training logs that are used, and the contacts in them.
pub(super) struct Rows {
    /// One walk for each log.
    walks: Vec<Walk>,
    /// Whether bodies touch, one flag for each row.
    touches: Vec<Vec<bool>>,
    /// Pairs of bodies that touch in some row.
    pairs: Vec<[usize; 2]>,
    /// Largest magnitude of each tangent coordinate.
    scale: Vec<f64>,
    /// States of the coordinates that no sensor reads.
    unread: Unread,
}

impl Rows {
    /// Selects rows within the budget.
    pub(super) fn of(bench: &Bench, nominal: &[f64]) -> Result<Self> {
        let layout = bench.layout();
        let plant = &bench.machine.plant;
        let logs = &bench.train.logs;
        let whole = |e| Walk::new(logs, e, layout.timestep);
        let walks = within_budget((0..logs.episodes.len()).map(whole).collect(), layout.nv);
        let replayed = replayed(bench, nominal)?;
        let unread = Unread::of(bench, &replayed);
        let first = from_readings(plant, logs, &walks, &unread.along(&walks));
        let mut shown = along(bench, &walks, nominal, &first)?;
        support(plant, &mut shown, &replayed, &walks);
        Ok(Self {
            touches: touching(plant, logs, &shown),
            pairs: pairs_touching(&shown),
            scale: scales(plant, &first),
            walks,
            unread,
        })
    }

    /// Whether bodies touch in any row.
    pub(super) fn touches(&self) -> bool {
        self.touches.iter().flatten().any(|t| *t)
    }

    /// The rows, cut into segments of a duration, s, where bodies touch.
    pub(super) fn cut(&self, study: &Study, bench: &Bench, duration: f64) -> Taken {
        let each = self.walks.iter().zip(&self.touches);
        let walks = each.flat_map(|(walk, t)| cut(walk, t, duration));
        self.taken(study, bench, walks.collect())
    }

    /// The rows, with each log in which bodies touch as one segment.
    pub(super) fn whole(&self, study: &Study, bench: &Bench) -> Taken {
        let each = self.walks.iter().zip(&self.touches);
        let walks = each.map(|(walk, t)| whole(walk, t));
        self.taken(study, bench, walks.collect())
    }

    fn taken(&self, study: &Study, bench: &Bench, walks: Vec<Walk>) -> Taken {
        let plant = &bench.machine.plant;
        let given = |w: &Walk| {
            let episode = &study.train[w.episode].1;
            let known = w.rows[0] == 0 && episode.initial.is_some();
            known.then(|| given_start(plant, episode))
        };
        Taken {
            given: walks.iter().map(given).collect(),
            open: bench.open.clone(),
            otherwise: self.unread.along(&walks),
            scale: self.scale.clone(),
            touching: self.pairs.clone(),
            walks,
        }
    }
}

/// States along the logs of the coordinates that no sensor reads.
enum Unread {
    /// The first keyframe, at rest: every hinge and slide is read.
    Home(Vec<f64>),
    /// The first keyframe, with hinges and slides as in replays of the model as given.
    /// `rows x (nq + nv)` for each log.
    ///
    /// At rest, a joint that no sensor reads would seem never to move, and no smoother would let it
    /// move.
    Replayed { states: Vec<Vec<f64>>, width: usize },
}

impl Unread {
    fn of(bench: &Bench, replayed: &Trajectory) -> Self {
        let layout = bench.layout();
        let (nq, nv) = (layout.nq, layout.nv);
        let home = asid_core::problem::home(layout);
        let still = [&home.0[..], &home.1[..]].concat();
        let logs = &bench.train.logs;
        let plant = &bench.machine.plant;
        let noise = position_noise(plant, logs);
        let joints: Vec<_> = plant.scalar_joints().map(|j| &layout.joints[j]).collect();
        if joints.iter().all(|j| noise[j.qvel] > 0.0) {
            return Self::Home(still);
        }
        let states = |path: &Path| -> Vec<f64> {
            let rows = path.qpos.chunks_exact(nq).zip(path.qvel.chunks_exact(nv));
            let state = |(q, v): (&[f64], &[f64])| {
                let mut state = still.clone();
                for joint in &joints {
                    let own = [q[joint.qpos], v[joint.qvel]];
                    // A replay that diverged carries no information.
                    if own.iter().all(|x| x.is_finite()) {
                        (state[joint.qpos], state[nq + joint.qvel]) = (own[0], own[1]);
                    }
                }
                state
            };
            rows.flat_map(state).collect()
        };
        Self::Replayed {
            states: replayed.episodes.iter().map(states).collect(),
            width: nq + nv,
        }
    }

    /// The states along some walks, `rows x (nq + nv)` each.
    fn along(&self, walks: &[Walk]) -> Vec<Vec<f64>> {
        let along = |walk: &Walk| match self {
            Self::Home(still) => still.repeat(walk.len()),
            Self::Replayed { states, width } => {
                let rows = walk.rows.iter();
                let states = &states[walk.episode];
                rows.flat_map(|k| states[k * width..(k + 1) * width].to_vec())
                    .collect()
            }
        };
        walks.iter().map(along).collect()
    }
}

/// The first rows of each walk, as many as the budget of physics steps allows: a screening
/// simulates them once for each column.
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
