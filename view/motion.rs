//! Motions of a scene's machines, as frames of an episode.

use asid_results::trace::ForceTrace;
use asid_results::view::{Machine, Origin, Take};
use nalgebra::Isometry3;

use crate::Stage;
use crate::force;
use crate::pack::{Cube, text};

/// Highest frame rate, 1/s. A viewer that draws 60 a second interpolates one frame between any two,
/// which looks smooth.
pub const RATE: f64 = 30.0;
/// Largest number of frames of an episode: 20 s at [`RATE`].
pub const FRAMES: usize = 600;
/// Fewest frames of an episode, whatever the budget.
const FEWEST: usize = 40;
/// Poses of all episodes and machines together: 14 bytes each, in base64 about 1 MB of a report.
pub const POSES: usize = 55_000;

/// How far other machines are followed beyond the first machine's motion, in units of its size or
/// that of the largest shape.
const ASTRAY: f64 = 5.0;

/// A machine's motion through an episode.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Where it is from.
    pub origin: Origin,
    /// Name, such as `refined model`.
    pub label: String,
    /// Positions at the rows of the episode, `rows x nq`; non-finite values are missing.
    pub qpos: Vec<f64>,
}

impl Motion {
    /// A machine's motion.
    pub fn new(origin: Origin, label: &str, qpos: Vec<f64>) -> Self {
        Self {
            origin,
            label: label.to_owned(),
            qpos,
        }
    }
}

/// An episode to show.
#[derive(Clone, Copy, Debug)]
pub struct Played<'a> {
    /// Name of the episode, as in plots.
    pub name: &'a str,
    /// A short description.
    pub what: &'a str,
    /// Times of its rows, s, increasing.
    pub time: &'a [f64],
    /// The machines.
    pub motions: &'a [Motion],
    /// Forces that the model lacks.
    pub missing: &'a [ForceTrace],
}

impl Stage<'_> {
    /// The view with some episodes; those without a row or a machine are left out.
    #[must_use]
    pub fn with(&self, episodes: &[Played<'_>]) -> asid_results::view::View {
        let machines: usize = episodes.iter().map(|e| e.motions.len()).sum();
        let poses = machines * (self.heads.len() - 1);
        let most = (POSES / poses.max(1)).clamp(FEWEST, FRAMES);
        let seen = episodes
            .iter()
            .filter(|e| !e.time.is_empty() && !e.motions.is_empty());
        let mut view = self.view();
        view.takes = seen.map(|e| self.take(e, most)).collect();
        view
    }

    /// An episode with at most `most` frames.
    #[must_use]
    pub fn take(&self, played: &Played<'_>, most: usize) -> Take {
        let nq = self.plant.layout.nq;
        let rows = frames(played.time, most);
        let start = played.time[0];
        let poses: Vec<Vec<Vec<Isometry3<f64>>>> = played
            .motions
            .iter()
            .map(|m| {
                rows.iter()
                    .map(|&k| self.poses(&m.qpos[k * nq..(k + 1) * nq]))
                    .collect()
            })
            .collect();
        let touching: Vec<Vec<Vec<[f64; 3]>>> = poses
            .iter()
            .map(|frames| {
                frames
                    .iter()
                    .map(|parts| self.touch.points(parts))
                    .collect()
            })
            .collect();
        let of = |poses: &[Vec<Vec<Isometry3<f64>>>]| {
            Cube::around((poses.iter().flatten().flatten()).map(|p| p.translation.vector.into()))
        };
        let first = of(&poses[..1]);
        let most = ASTRAY * first.size.max(self.reach);
        // Contact points lie within the shapes that touch.
        let points = touching.iter().flatten().flatten().copied();
        let all = Cube::around(of(&poses).corners().into_iter().chain(points));
        let cube = all.near(first, most);
        let machine =
            |motion: &crate::Motion, poses: &[Vec<Isometry3<f64>>], points: &[Vec<[f64; 3]>]| {
                let numbers: Vec<u16> = poses.iter().flatten().flat_map(|p| cube.pose(p)).collect();
                let contacts: Vec<u16> = points
                    .iter()
                    .flatten()
                    .flat_map(|p| cube.point(*p))
                    .collect();
                Machine {
                    origin: motion.origin,
                    label: motion.label.clone(),
                    poses: text(&numbers),
                    touching: points.iter().map(|p| p.len() as u16).collect(),
                    contacts: text(&contacts),
                }
            };
        let time: Vec<f64> = rows.iter().map(|&k| played.time[k] - start).collect();
        let mut take = Take {
            name: played.name.to_owned(),
            what: played.what.to_owned(),
            machines: (played.motions.iter())
                .zip(poses.iter().zip(&touching))
                .map(|(motion, (poses, points))| machine(motion, poses, points))
                .collect(),
            forces: (played.missing.iter())
                .filter_map(|m| force::at(m, self, &time))
                .collect(),
            // A tenth of a millisecond is far below a frame.
            time: time
                .iter()
                .map(|t| ((t * 1e4).round() / 1e4) as f32)
                .collect(),
            ..Take::default()
        };
        cube.tell(&mut take);
        take
    }
}

/// Rows that are drawn: about [`RATE`] a second and at most `most`, including the first and the
/// last.
#[must_use]
pub fn frames(time: &[f64], most: usize) -> Vec<usize> {
    let (Some(&first), Some(&last)) = (time.first(), time.last()) else {
        return Vec::new();
    };
    let step = (1.0 / RATE).max((last - first) / (most.max(2) - 1) as f64);
    let mut rows = vec![0];
    let mut due = first + step;
    for k in 1..time.len() {
        // The tolerance of a millionth of a step allows for rounded times in logs.
        if time[k] >= due - 1e-6 * step {
            rows.push(k);
            due = (due + step).max(time[k] + 0.5 * step);
        }
    }
    let end = time.len() - 1;
    if rows.last() != Some(&end) {
        if rows.len() >= most.max(2) {
            rows.pop();
        }
        rows.push(end);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Scene;
    use asid_mjcf::Plant;

    #[test]
    fn frames_are_evenly_spread_few_and_reach_the_end() {
        let time: Vec<f64> = (0..2001).map(|k| f64::from(k) * 0.005).collect();
        let rows = frames(&time, 600);
        assert_eq!((rows[0], *rows.last().unwrap()), (0, 2000));
        assert!((298..=303).contains(&rows.len()), "{}", rows.len());
        assert!(rows.windows(2).all(|w| (5..=8).contains(&(w[1] - w[0]))));
        assert!(frames(&time, 50).len() <= 50);
        assert_eq!(frames(&[1.0], 50), [0]);
        assert!(frames(&[], 50).is_empty());
    }

    #[test]
    fn a_ball_touches_the_floor_where_it_stands_on_it() {
        let xml = r#"<mujoco><worldbody><geom type="plane" size="1 1 1"/>
          <body name="ball"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;
        let scene = Scene::from_xml("ball", xml, &[]).unwrap();
        let plant = Plant::of(&scene).unwrap();
        let stage = Stage::of(&scene, &plant).unwrap();
        let at = |x: f64, z: f64| [x, 0.0, z, 1.0, 0.0, 0.0, 0.0];
        let qpos = [at(0.0, 0.5), at(0.3, 0.1), [f64::NAN; 7]].concat();
        let motions = [Motion::new(Origin::Real, "as logged", qpos)];
        let played = Played {
            name: "a",
            what: "",
            time: &[5.0, 6.0, 7.0],
            motions: &motions,
            missing: &[],
        };
        let view = stage.with(&[played]);
        let take = &view.takes[0];
        assert_eq!(take.time, [0.0, 1.0, 2.0]);
        assert_eq!(take.machines[0].touching, [0, 1, 0]);
        // 3 poses of 7 and a point of 3, 2 bytes each, 4 characters for 3 bytes.
        assert_eq!(take.machines[0].poses.len(), 56);
        assert_eq!(take.machines[0].contacts.len(), 8);
    }
}
