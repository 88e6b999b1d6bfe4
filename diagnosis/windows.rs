//! Logs cut into short windows, each with an initial state of its own.
//!
//! Where sensors read the positions of the machine, any row can be an initial state, not only the
//! first. Over a window a model cannot drift far, whatever it lacks and however long the log is, so
//! that its gradient is reliable everywhere. What the machine does late in a log counts as much as
//! what it does first. The windows' initial states are nuisance parameters, like any unknown ones.

use asid_core::Result;
use asid_core::layout::JointKind;
use asid_core::progress::Silent;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use crate::bench::{Bench, Trial};
use crate::data::Logs;
use crate::fit::{Begin, Effort, fit};
use crate::predict::{Point, State};
use crate::record::Record;
use crate::starts::given_start;

/// Length of a window as a share of the longest log.
const SHARE: f64 = 0.1;
/// Fewest rows of a window: fewer do not determine an initial state and a speed.
const ROWS: usize = 10;

/// Returns the number of rows of a window; `None` if the logs give initial states, or do not show
/// where the machine is.
#[must_use]
pub fn rows(plant: &Plant, logs: &Logs, open: &[usize]) -> Option<usize> {
    let layout = &plant.layout;
    if open.len() < 2 * layout.nv || open.is_empty() {
        return None;
    }
    let read = |j: usize, kind: &str| {
        let joint = &layout.joints[j];
        layout.sensors.iter().enumerate().any(|(i, s)| {
            let of_it = match plant.sensors[i] {
                Reads::Joint(k) => k == j,
                Reads::Body(b) => joint.kind == JointKind::Free && plant.free_joint(b) == Some(j),
                Reads::Other => false,
            };
            of_it && s.kind == kind && logs.sensors.iter().any(|l| l.name == s.name)
        })
    };
    let known = (0..layout.joints.len()).all(|j| match layout.joints[j].kind {
        JointKind::Hinge | JointKind::Slide => read(j, "jointpos"),
        JointKind::Free => read(j, "framepos") && read(j, "framequat"),
        JointKind::Ball => false,
    });
    let longest = logs.episodes.iter().map(|e| e.plan.rows()).max()?;
    let window = ((SHARE * longest as f64).ceil() as usize).max(ROWS);
    // Logs hardly longer than a window are used whole.
    known.then_some(if longest < 3 * ROWS { longest } else { window })
}

/// Cuts logs into windows, whose initial states follow from the readings.
#[must_use]
pub fn cut(plant: &Plant, record: &Record, rows: usize) -> Record {
    let logs = record.logs.windows(&plant.layout, rows);
    let episodes = logs.episodes.iter();
    let starts = episodes.map(|e| given_start(plant, &e.episode)).collect();
    Record::new(logs, starts)
}

/// Fits the initial states of some windows in a model with some effects, at given values of the
/// study's parameters.
///
/// # Errors
/// When a rollout fails.
pub fn settle(
    bench: &Bench,
    windows: &Record,
    trials: &[Trial<'_>],
    theta: &[f64],
) -> Result<Vec<State>> {
    let mut unknowns = bench.unknowns(trials);
    unknowns.iter_mut().for_each(|u| u.free = false);
    let mut point = Point {
        theta: theta.to_vec(),
        starts: windows.starts.clone(),
    };
    trials.iter().for_each(|(_, v)| point.theta.extend(v));
    let mut predictor = bench.predictor(trials, windows)?;
    let effort = Effort {
        chord: true,
        ..Effort::BRIEF
    };
    let found = fit(
        &mut predictor,
        (bench.layout(), &unknowns),
        Begin::at(point, (&bench.open, &bench.reach)),
        (effort, &Silent),
    )?;
    Ok(found.point.starts)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use asid_core::episode::ChannelColumns;
    use asid_core::{Episode, Scene};

    const ARM: &str = r#"<mujoco><option timestep="0.01"/><worldbody>
      <body name="a"><joint name="a" type="hinge" axis="0 1 0"/><geom size="0.1" mass="1"/>
      <body name="b"><joint name="b" type="hinge" axis="0 1 0"/><geom size="0.1" mass="1"/></body></body>
      </worldbody><sensor><jointpos name="qa" joint="a"/><jointpos name="qb" joint="b"/></sensor></mujoco>"#;

    /// Makes a log of `rows` rows, 10 ms apart: angle `a` turns at 2 rad/s, `b` stands at 1 rad.
    fn logs(plant: &Plant, sensors: &[&str], rows: usize) -> Logs {
        let names: Vec<String> = sensors.iter().map(|s| (*s).to_owned()).collect();
        let column = |name: &String| ChannelColumns {
            name: name.clone(),
            len: 1,
        };
        let time: Vec<f64> = (0..rows).map(|k| 0.01 * k as f64).collect();
        let reading = |t: f64| {
            sensors
                .iter()
                .map(move |s| if *s == "qa" { 2.0 * t } else { 1.0 })
        };
        let episode = Episode {
            readings: time.iter().flat_map(|&t| reading(t)).collect(),
            channels: names.iter().map(column).collect(),
            time,
            ..Episode::default()
        };
        Logs::new(plant, &names, vec![("log".into(), episode)]).unwrap()
    }

    fn plant() -> Plant {
        Plant::of(&Scene::from_xml("arm", ARM, &[]).unwrap()).unwrap()
    }

    #[test]
    fn windows_are_cut_where_starts_are_open_and_every_joint_is_read() {
        let plant = plant();
        let open: Vec<usize> = (0..4).collect();
        let both = logs(&plant, &["qa", "qb"], 300);
        assert_eq!(rows(&plant, &both, &open), Some(30));
        assert_eq!(rows(&plant, &both, &[]), None, "given starts");
        assert_eq!(rows(&plant, &both, &open[..2]), None, "speeds are known");
        let one = logs(&plant, &["qa"], 300);
        assert_eq!(rows(&plant, &one, &open), None, "nobody reads b");
        let short = logs(&plant, &["qa", "qb"], 40);
        assert_eq!(rows(&plant, &short, &open), Some(10));
        let shorter = logs(&plant, &["qa", "qb"], 17);
        assert_eq!(rows(&plant, &shorter, &open), Some(17));
    }

    #[test]
    fn windows_hold_every_row_once_and_start_as_read() {
        let plant = plant();
        let whole = logs(&plant, &["qa", "qb"], 34);
        let record = cut(&plant, &Record::new(whole.clone(), Vec::new()), 10);
        // The last four rows are less than half a window.
        assert_eq!(record.logs.episodes.len(), 3);
        let readings: Vec<f64> = record
            .logs
            .episodes
            .iter()
            .flat_map(|e| e.readings.clone())
            .collect();
        assert_eq!(readings, whole.episodes[0].readings[..60]);
        for (k, start) in record.starts.iter().enumerate() {
            assert!((start.qpos[0] - 0.2 * k as f64).abs() < 1e-12 && start.qpos[1] == 1.0);
            assert!((start.qvel[0] - 2.0).abs() < 1e-9 && start.qvel[1] == 0.0);
        }
    }
}
