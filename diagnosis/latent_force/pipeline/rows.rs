//! Selects the rows of the logs, and decides which are smoothed and which are cut into segments.

use asid_core::layout::JointKind;
use asid_core::{Layout, Result};
use asid_mjcf::Plant;

use crate::bench::Bench;
use crate::latent_force::budget::within_budget;
use crate::latent_force::context::Taken;
use crate::latent_force::initial::{from_readings, position_noise, scales};
use crate::latent_force::segments::{cut, whole};
use crate::latent_force::touching::{pairs_touching, touching};
use crate::latent_force::walk::Walk;
use crate::predict::Point;
use crate::starts::given_start;
use crate::study::Study;
use crate::trajectory::{Path, Trajectory};

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
    /// States by the readings, `rows x (nq + nv)`, one array for each log.
    states: Vec<Vec<f64>>,
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
            states: first,
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
        let width = bench.layout().nq + bench.layout().nv;
        Taken {
            given: walks.iter().map(given).collect(),
            open: bench.open.clone(),
            states: walks.iter().map(|w| self.states_along(w, width)).collect(),
            scale: self.scale.clone(),
            touching: self.pairs.clone(),
            walks,
        }
    }

    /// The states by the readings along a part of a log, each of so many numbers.
    ///
    /// An object that the part never reads is where readings before and after it show it. A speed
    /// at the first row follows from rows on both sides.
    fn states_along(&self, part: &Walk, width: usize) -> Vec<f64> {
        let rows = &self.walks[part.episode].rows;
        let first = rows.partition_point(|row| *row < part.rows[0]);
        self.states[part.episode][first * width..(first + part.len()) * width].to_vec()
    }
}

/// States along the logs of the coordinates that no sensor reads.
enum Unread {
    /// The first keyframe, at rest: every hinge, slide and ball joint is read.
    Home(Vec<f64>),
    /// The first keyframe, with hinges, slides and ball joints as in replays of the model as given.
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
        let mut joints = layout.joints.iter().filter(|j| j.kind != JointKind::Free);
        if joints.all(|j| noise[j.qvel] > 0.0) {
            return Self::Home(still);
        }
        let states = |path: &Path| -> Vec<f64> {
            let rows = path.qpos.chunks_exact(nq).zip(path.qvel.chunks_exact(nv));
            rows.flat_map(|row| with_joints(layout, &still, row))
                .collect()
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

/// Returns a state with the joints at other positions and speeds, `qpos` and `qvel`; free bodies
/// stay.
///
/// A joint whose replay diverged stays too, since that carries no information.
fn with_joints(layout: &Layout, still: &[f64], (qpos, qvel): (&[f64], &[f64])) -> Vec<f64> {
    let mut state = still.to_vec();
    let joints = layout.joints.iter().filter(|j| j.kind != JointKind::Free);
    for joint in joints {
        let places = joint.qpos..joint.qpos + joint.kind.qpos_len();
        let speeds = joint.qvel..joint.qvel + joint.kind.qvel_len();
        let own = [&qpos[places.clone()], &qvel[speeds.clone()]];
        if own.iter().copied().flatten().all(|x| x.is_finite()) {
            state[places].copy_from_slice(own[0]);
            state[layout.nq + speeds.start..layout.nq + speeds.end].copy_from_slice(own[1]);
        }
    }
    state
}

#[cfg(test)]
mod tests {
    use asid_core::episode::ChannelColumns;
    use asid_core::{Episode, Scene};

    use crate::data::Logs;

    use super::*;

    /// Symptom: in segments in which its camera did not see a puck, the puck was replayed from
    /// where the document places it. Cause: each segment was taken from its own readings alone.
    #[test]
    fn what_a_segment_does_not_read_is_where_the_log_shows_it() {
        let scene = r#"<mujoco><worldbody><body>
            <joint name="slide" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
            <sensor><jointpos name="place" joint="slide"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("slide", scene, &[]).unwrap()).unwrap();
        // At 1 m/s, read in the first and in the last tenth of a second.
        let place = |k: u32| match k {
            10..40 => f64::NAN,
            _ => 0.3 + 0.01 * f64::from(k),
        };
        let episode = Episode {
            time: (0..50).map(|k| 0.01 * f64::from(k)).collect(),
            channels: vec![ChannelColumns {
                name: "place".into(),
                len: 1,
            }],
            readings: (0..50).map(place).collect(),
            ..Episode::default()
        };
        let named = vec![("log".into(), episode)];
        let logs = Logs::new(&plant, &["place".to_owned()], named).unwrap();
        let walks = vec![Walk::new(&logs, 0, plant.layout.timestep)];
        let home = vec![0.0; 2 * 50];
        let rows = Rows {
            touches: vec![vec![true; 50]],
            pairs: Vec::new(),
            scale: Vec::new(),
            states: from_readings(&plant, &logs, &walks, &[home]),
            walks,
        };
        let found = rows.states_along(&rows.walks[0].part(15..35), 2);
        assert_eq!(found.len(), 2 * 20);
        for (k, state) in found.chunks_exact(2).enumerate() {
            let want = [0.45 + 0.01 * k as f64, 1.0];
            for (got, want) in state.iter().zip(want) {
                assert!((got - want).abs() < 1e-9, "row {k}: {state:?}");
            }
        }
    }

    /// Symptom: a pendulum on a ball joint of which only the tip is read was smoothed from where
    /// the document places it, at rest. Cause: only hinges and slides were taken from replays.
    #[test]
    fn joints_that_no_sensor_reads_move_as_in_replays() {
        let scene = r#"<mujoco><worldbody>
            <body><joint name="ball" type="ball"/><geom size="0.1" mass="1"/></body>
            <body><joint name="hinge" type="hinge"/><geom size="0.1" mass="1"/></body>
            <body><freejoint name="free"/><geom size="0.1" mass="1"/></body></worldbody></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("scene", scene, &[]).unwrap()).unwrap();
        let layout = &plant.layout;
        let still = vec![0.0; layout.nq + layout.nv];
        let replayed: Vec<f64> = (1..=layout.nq + layout.nv).map(|i| i as f64).collect();
        let (mut qpos, qvel) = (replayed[..layout.nq].to_vec(), &replayed[layout.nq..]);
        let ball = 0..4;
        let of = |qpos: &[f64]| with_joints(layout, &still, (qpos, qvel));
        let found = of(&qpos);
        let (places, speeds) = found.split_at(layout.nq);
        assert_eq!(places[..5], qpos[..5]);
        assert_eq!(speeds[..4], qvel[..4]);
        assert!(places[5..].iter().chain(&speeds[4..]).all(|x| *x == 0.0));
        // The other joint of a replay that diverged still carries information.
        qpos[2] = f64::NAN;
        let found = of(&qpos);
        assert_eq!(found[ball], [0.0; 4]);
        assert_eq!((found[4], found[layout.nq + 3]), (qpos[4], qvel[3]));
    }
}
