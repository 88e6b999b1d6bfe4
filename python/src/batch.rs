//! Messages to the thread that owns a batch of episodes, and its answers.

use asid_algorithms::explore::environment::FisherEnvironment;
use asid_core::{BatchEnvironment as _, Problem, Result, Transition};

use crate::opened::streams;

/// A request to a batch.
pub enum Call {
    /// Draw all further random numbers from this seed.
    Seed(u64),
    /// Restart all episodes.
    Reset,
    /// Take one control step with these actions, `n x action`, in [-1, 1].
    Step(Vec<f64>),
}

/// What stays constant over a batch's life.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Name and version of the engine.
    pub engine: String,
    /// Entries of an observation: their names and counts.
    pub entries: Vec<(String, usize)>,
    /// Entries of an action: name, unit, and the range to which [-1, 1] maps.
    pub actions: Vec<(String, String, [f64; 2])>,
    /// The unknowns: name and unit.
    pub unknowns: Vec<(String, String)>,
    /// Control steps of an episode.
    pub horizon: usize,
    /// Time of a control step, s.
    pub period: f64,
}

impl Shape {
    /// The shape of a problem's episodes.
    pub fn of(problem: &Problem<'_>, environment: &FisherEnvironment<'_>, engine: String) -> Self {
        let protocol = problem.task.exploration();
        let entries = environment.observer().entries().iter();
        let actions = protocol.action.iter();
        let unknowns = problem.parameters.iter();
        Self {
            engine,
            entries: entries.map(|e| (e.name.clone(), e.len)).collect(),
            actions: actions
                .map(|a| (a.name.clone(), a.unit.clone(), a.range))
                .collect(),
            unknowns: unknowns.map(|p| (p.name.clone(), p.unit.clone())).collect(),
            horizon: protocol.horizon,
            period: protocol.frames_per_step as f64 * protocol.frame_period,
        }
    }
}

/// Executes a request on a batch; `None` for a request without an answer.
pub fn answer(environment: &mut FisherEnvironment<'_>, call: Call) -> Option<Result<Transition>> {
    let (n, len) = (environment.batch_size(), environment.observation_len());
    let mut transition = Transition::new(n, len);
    let done = match call {
        Call::Seed(seed) => {
            environment.reseed(&streams(seed));
            return None;
        }
        Call::Reset => environment.reset(&mut transition.observation),
        Call::Step(actions) => environment.step(&actions, &mut transition),
    };
    Some(done.map(|()| transition))
}
