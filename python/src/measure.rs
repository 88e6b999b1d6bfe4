//! How fast the same batch steps where no Python is between, to measure what Python costs.

use std::time::Instant;

use asid_algorithms::explore::environment::FisherEnvironment;
use asid_core::{BatchEnvironment as _, Result, Transition};
use pyo3::prelude::*;

use crate::episodes::fisher;
use crate::failure::exception;
use crate::opened::{Opened, Request};

/// Control steps a second, over all episodes, of a batch that Rust steps alone, with actions of 0.
#[pyfunction]
#[pyo3(signature = (task, episodes, steps, *, backend=None, threads=0, seed=0))]
pub fn measure(
    py: Python<'_>,
    task: String,
    episodes: usize,
    steps: usize,
    backend: Option<String>,
    threads: usize,
    seed: u64,
) -> PyResult<f64> {
    let request = Request {
        task,
        backend,
        episodes,
        fisher: fisher(None, None, None)?,
        threads,
        seed,
    };
    py.detach(|| steps_per_second(&request, steps))
        .map_err(|e| exception(&e))
}

fn steps_per_second(request: &Request, steps: usize) -> Result<f64> {
    let opened = Opened::new(request)?;
    let problem = opened.problem();
    let mut environment = FisherEnvironment::new(&problem, &request.fisher, request.episodes)?;
    let mut transition = Transition::new(request.episodes, environment.observation_len());
    let actions = vec![0.0; request.episodes * environment.action_len()];
    environment.reset(&mut transition.observation)?;
    let clock = Instant::now();
    for _ in 0..steps {
        environment.step(&actions, &mut transition)?;
    }
    Ok((steps * request.episodes) as f64 / clock.elapsed().as_secs_f64())
}
