//! A study: a model, logs of the real machine, and what the user fits already.

mod document;
mod files;

use std::collections::BTreeMap;
use std::path::PathBuf;

use asid_core::episode::InitialState;
use asid_core::problem::home;
use asid_core::{Episode, Error, Layout, Parameter, Result, Scene, Target, Task};
use asid_effects::EffectSpec;
use asid_effects::refined_model::RefinedModel;
use asid_logs::episode::{ColumnMapping, LogNotes};
use asid_mjcf::Plant;

/// What counts as noise of a task's own sensors, rad or m: the repeatability of the arm, 0.1 mm
/// (Franka Emika's data sheet). Simulated they have none, and a push that differs by the width of an atom
/// would be a gap.
const PROPRIOCEPTION: f64 = 1e-4;

/// A study, read and checked.
#[derive(Clone, Debug)]
pub struct Study {
    /// Name: that of its folder or file.
    pub name: String,
    /// Model file as the study names it, made absolute by the study's folder.
    pub model: PathBuf,
    /// The document.
    pub scene: Scene,
    /// Values that a refined model sets.
    pub fixed: Vec<(Target, f64)>,
    /// Effects that a refined model has.
    pub effects: Vec<EffectSpec>,
    /// What the user fits already.
    pub parameters: Vec<Parameter>,
    /// Logs to fit to, by file name.
    pub train: Vec<(String, Episode)>,
    /// Logs held out.
    pub test: Vec<(String, Episode)>,
    /// Noise by sensor, where it is given.
    pub noise: BTreeMap<String, f64>,
    /// What the columns of the logs mean, where they do not mean what their names say.
    pub columns: Vec<ColumnMapping>,
    /// What was passed over or mended as logs were read: file and notes.
    pub notes: Vec<(String, LogNotes)>,
    /// Whether the columns are known to mean what their names say: logs of a task's own runs.
    pub wired: bool,
}

impl Study {
    /// A built-in task as a study: its unknowns and the noise of its trackers, in a model: its
    /// scene, or one that fits the task. The machine begins where the model's first keyframe has
    /// it; where the object begins is estimated.
    ///
    /// # Errors
    /// When a log is wrong, or there is none to hold out.
    pub fn of_task(
        task: &dyn Task,
        model: RefinedModel,
        train: Vec<(String, Episode)>,
        test: Vec<(String, Episode)>,
    ) -> Result<Self> {
        let RefinedModel {
            scene,
            parameters: fixed,
            effects,
        } = model;
        let start = task_start(task, &Plant::of(&scene)?.layout)?;
        let begun = |mut logs: Vec<(String, Episode)>| {
            for (_, episode) in &mut logs {
                episode.initial.get_or_insert_with(|| start.clone());
            }
            logs
        };
        let exploration = task.exploration();
        let trackers = exploration.signals.iter();
        let own = exploration.proprioception.iter();
        Self {
            name: task.name().to_owned(),
            model: PathBuf::from(scene.name()),
            fixed,
            effects,
            parameters: task.parameters(),
            train: begun(train),
            test: begun(test),
            noise: own
                .map(|sensor| (sensor.clone(), PROPRIOCEPTION))
                .chain(trackers.map(|s| (s.sensor.clone(), s.noise)))
                .collect(),
            columns: Vec::new(),
            notes: Vec::new(),
            wired: true,
            scene,
        }
        .with_test()
    }

    /// A further mapping, of logs as this study reads them, as one of the files themselves: what replaces the study's own of
    /// that name.
    #[must_use]
    pub fn composed(&self, further: &ColumnMapping) -> ColumnMapping {
        let source = further.from.as_deref().unwrap_or(&further.name);
        let Some(own) = self.columns.iter().find(|m| m.name == source) else {
            return further.clone();
        };
        let mut whole = further.clone();
        whole.from = own.from.clone().or_else(|| further.from.clone());
        whole.sign = own.sign * further.sign;
        whole.offset = further.factor() * own.offset + further.offset;
        whole.delay = own.delay + further.delay;
        match (&own.unit, &further.unit) {
            (unit, None) | (None, unit) => {
                whole.unit.clone_from(unit);
                whole.scale = own.scale * further.scale;
            }
            // Two units make a factor.
            _ => {
                whole.unit = None;
                whole.scale = (own.factor() * further.factor()).abs();
            }
        }
        whole.in_one_unit()
    }

    /// Holds out whole episodes where the study names no test logs: a third of them, the last.
    ///
    /// # Errors
    /// When there is a single log and none to hold out.
    pub fn with_test(mut self) -> Result<Self> {
        if self.test.is_empty() {
            let n = self.train.len();
            if n < 2 {
                return Err(Error::Config {
                    key: "test".into(),
                    message: format!(
                        "study {}: one log cannot be both fitted and held out; give a second episode",
                        self.name
                    ),
                });
            }
            let held = (n / 3).max(1);
            self.test = self.train.split_off(n - held);
        }
        Ok(self)
    }
}

/// The scene's first keyframe, with what a start pose of the object changes left open: of a
/// puck on a board the place on it and the turn about its normal, not its height.
fn task_start(task: &dyn Task, layout: &Layout) -> Result<InitialState> {
    let (home, qvel) = home(layout);
    let coordinates = &task.exploration().start;
    let place = |u: f64| -> Result<Vec<f64>> {
        let start: Vec<f64> = coordinates.iter().map(|c| c.at(u)).collect();
        let mut qpos = home.clone();
        task.place(layout, &start, &mut qpos)?;
        Ok(qpos)
    };
    let (low, high) = (place(0.2)?, place(0.9)?);
    let open = |(here, (a, b)): (f64, (&f64, &f64))| if a == b { here } else { f64::NAN };
    let qpos = home
        .into_iter()
        .zip(low.iter().zip(&high))
        .map(open)
        .collect();
    Ok(InitialState { qpos, qvel })
}
