//! `asid._native.Episodes`: a batch of exploration episodes as Python sees it.

use asid_algorithms::fisher::{FisherSettings, Objective};
use asid_core::Transition;
use numpy::{
    PyArray1, PyArray2, PyArrayMethods as _, PyReadonlyArray2, PyUntypedArrayMethods as _,
};
use pyo3::prelude::*;

use crate::batch::{Call, Shape};
use crate::failure::{exception, usage};
use crate::opened::Request;
use crate::worker::Worker;

/// Observations, rewards, terminated, truncated, and observations before any reset.
type Stepped<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray1<bool>>,
    Bound<'py, PyArray2<f32>>,
);

/// A batch of exploration episodes of a task, which step together; calls give the interpreter's
/// lock away.
#[pyclass(module = "asid._native")]
pub struct Episodes {
    worker: Worker,
    shape: Shape,
    episodes: usize,
}

/// The settings of an episode's reward, from their names.
fn fisher(
    objective: Option<&str>,
    form: Option<&str>,
    nuisance: Option<bool>,
) -> PyResult<FisherSettings> {
    let mut settings = FisherSettings::default();
    if let Some(name) = objective {
        settings.objective = name.parse::<Objective>().map_err(|e| exception(&e))?;
    }
    if let Some(name) = form {
        settings.form = name.parse().map_err(|e| exception(&e))?;
    }
    settings.nuisance = nuisance.unwrap_or(settings.nuisance);
    Ok(settings)
}

#[pymethods]
impl Episodes {
    /// Loads the task on an engine, `episodes` episodes side by side.
    #[new]
    #[pyo3(signature = (task, episodes, *, backend=None, objective=None, form=None, nuisance=None, threads=0, seed=0))]
    #[allow(clippy::too_many_arguments)] // they have names in Python
    fn new(
        py: Python<'_>,
        task: String,
        episodes: usize,
        backend: Option<String>,
        objective: Option<&str>,
        form: Option<&str>,
        nuisance: Option<bool>,
        threads: usize,
        seed: u64,
    ) -> PyResult<Self> {
        let request = Request {
            task,
            backend,
            episodes,
            fisher: fisher(objective, form, nuisance)?,
            threads,
            seed,
        };
        let (worker, shape) = Worker::start(py, request)?;
        Ok(Self {
            worker,
            shape,
            episodes,
        })
    }

    /// Episodes side by side.
    #[getter]
    fn episodes(&self) -> usize {
        self.episodes
    }

    /// Name and version of the engine.
    #[getter]
    fn engine(&self) -> &str {
        &self.shape.engine
    }

    /// Entries of an observation: what they are, and how many.
    #[getter]
    fn entries(&self) -> Vec<(String, usize)> {
        self.shape.entries.clone()
    }

    /// Entries of an action: name, unit, and the range that -1 to 1 stands for.
    #[getter]
    fn actions(&self) -> Vec<(String, String, (f64, f64))> {
        let actions = self.shape.actions.iter();
        actions
            .map(|(name, unit, [low, high])| (name.clone(), unit.clone(), (*low, *high)))
            .collect()
    }

    /// The unknowns: name and unit.
    #[getter]
    fn unknowns(&self) -> Vec<(String, String)> {
        self.shape.unknowns.clone()
    }

    /// Control steps of an episode.
    #[getter]
    fn horizon(&self) -> usize {
        self.shape.horizon
    }

    /// Time of a control step, s.
    #[getter]
    fn period(&self) -> f64 {
        self.shape.period
    }

    /// Time that the simulator took so far for steps and resets, s: all the rest is Python's.
    #[getter]
    fn seconds(&self) -> f64 {
        self.worker.seconds
    }

    /// Draws all further chance from this seed.
    fn seed(&mut self, seed: u64) -> PyResult<()> {
        self.worker.tell(Call::Seed(seed))
    }

    /// Begins all episodes anew: the first observations, episodes x entries.
    fn reset<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let reached = self.worker.ask(py, Call::Reset)?;
        self.rows(py, &reached.observation)
    }

    /// One control step: actions are episodes x entries from -1 to 1, and are clipped to that.
    ///
    /// Returns observations to act on next, rewards, terminated, truncated, and the observations
    /// before any reset.
    fn step<'py>(
        &mut self,
        py: Python<'py>,
        actions: PyReadonlyArray2<'py, f32>,
    ) -> PyResult<Stepped<'py>> {
        let wanted = [self.episodes, self.shape.actions.len()];
        if actions.shape() != wanted {
            return Err(usage(format!(
                "actions: the array must have the shape {wanted:?}, not {:?}",
                actions.shape()
            )));
        }
        let all: Vec<f64> = actions.as_array().iter().map(|&a| f64::from(a)).collect();
        if let Some(i) = all.iter().position(|a| !a.is_finite()) {
            return Err(usage(format!(
                "actions: that of episode {} is not finite",
                i / wanted[1]
            )));
        }
        let Transition {
            observation,
            reward,
            terminated,
            truncated,
            final_observation,
        } = self.worker.ask(py, Call::Step(all))?;
        Ok((
            self.rows(py, &observation)?,
            PyArray1::from_vec(py, reward),
            PyArray1::from_vec(py, terminated),
            PyArray1::from_vec(py, truncated),
            self.rows(py, &final_observation)?,
        ))
    }
}

impl Episodes {
    /// An array with one row an episode.
    fn rows<'py>(&self, py: Python<'py>, all: &[f64]) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let single: Vec<f32> = all.iter().map(|&x| x as f32).collect();
        PyArray1::from_vec(py, single).reshape([self.episodes, all.len() / self.episodes])
    }
}
