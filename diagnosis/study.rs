//! A study: a model, logs of the real machine, and the parameters that the user already fits.

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

pub use document::named_as_written;

/// Standard deviation of the noise of a task's own sensors, rad or m: the arm's repeatability, 0.1
/// mm (Franka Emika's data sheet).
///
/// In simulation they have no noise, and a push that differs by the width of an atom would be a
/// gap.
const PROPRIOCEPTION: f64 = 1e-4;

/// A study, read and checked.
#[derive(Clone, Debug)]
pub struct Study {
    /// Name of the study: that of its folder or file.
    pub name: String,
    /// Path of the model file; a relative path in the study file is joined to the study's folder.
    pub model: PathBuf,
    /// The scene of the model.
    pub scene: Scene,
    /// Values that a refined model sets.
    pub fixed: Vec<(Target, f64)>,
    /// Effects that a refined model contains.
    pub effects: Vec<EffectSpec>,
    /// Parameters that the user already fits.
    pub parameters: Vec<Parameter>,
    /// Training logs, by file name.
    pub train: Vec<(String, Episode)>,
    /// Held-out logs, by file name.
    pub test: Vec<(String, Episode)>,
    /// Standard deviation of the noise by sensor, where it is given.
    pub noise: BTreeMap<String, f64>,
    /// Meaning of the logs' columns where it differs from what their names say.
    pub columns: Vec<ColumnMapping>,
    /// What was skipped or repaired as the logs were read: file and notes.
    pub notes: Vec<(String, LogNotes)>,
    /// Whether the columns are known to mean what their names say, as in logs of a task's own runs.
    pub wired: bool,
}

impl Study {
    /// Makes a study of a built-in task: its unknowns and the noise of its trackers, in the task's
    /// scene or in a model that fits the task.
    ///
    /// The machine begins at the model's first keyframe. The initial pose of the object is
    /// estimated.
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

    /// Composes a further mapping, of logs as this study reads them, with the study's own mappings.
    ///
    /// The results map the files themselves and replace the study's own mappings of their names.
    /// There is one for each entry of a vector if the study maps any of its entries, since these
    /// precede a mapping of the vector.
    #[must_use]
    pub fn composed(&self, further: &ColumnMapping, layout: &Layout) -> Vec<ColumnMapping> {
        let source = further.from.as_deref().unwrap_or(&further.name);
        let entry = |vector: &str, i: usize| format!("{vector}.{i}");
        let len = layout.sensor(&further.name).map_or(1, |s| s.len);
        let is_mapped = |i: usize| {
            let name = entry(source, i);
            self.columns.iter().any(|m| m.name == name)
        };
        if len > 1 && (0..len).any(is_mapped) {
            let each = (0..len).map(|i| ColumnMapping {
                name: entry(&further.name, i),
                from: further.from.as_ref().map(|from| entry(from, i)),
                ..further.clone()
            });
            return each.map(|m| self.composed_with_own(&m, layout)).collect();
        }
        vec![self.composed_with_own(further, layout)]
    }

    /// Returns the study's own mapping of a quantity, which for an entry may be that of its vector.
    fn own(&self, name: &str, layout: &Layout) -> Option<ColumnMapping> {
        let of = |name: &str| self.columns.iter().find(|m| m.name == name);
        if let Some(own) = of(name) {
            return Some(own.clone());
        }
        let (vector, entry) = name.rsplit_once('.')?;
        let i: usize = entry.parse().ok()?;
        let len = layout.sensor(vector).ok()?.len;
        let whole = of(vector).filter(|_| i < len)?;
        Some(ColumnMapping {
            name: name.to_owned(),
            from: whole.from.as_ref().map(|from| format!("{from}.{i}")),
            ..whole.clone()
        })
    }

    /// Composes a further mapping with the study's own one of the quantity that it reads.
    fn composed_with_own(&self, further: &ColumnMapping, layout: &Layout) -> ColumnMapping {
        let source = further.from.as_deref().unwrap_or(&further.name);
        let Some(own) = self.own(source, layout) else {
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
            // Two units combine into a factor.
            _ => {
                whole.unit = None;
                whole.scale = (own.factor() * further.factor()).abs();
            }
        }
        whole.in_one_unit()
    }

    /// Holds out the last third of the episodes if the study names no test logs.
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

/// Returns the scene's first keyframe with NaN where the object's initial pose is unknown.
///
/// For a puck on a board these are its place on the board and its rotation about the normal, not
/// its height.
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

#[cfg(test)]
pub(crate) mod tests;
