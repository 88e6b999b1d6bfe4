//! A thread that owns a batch of episodes.
//!
//! The environment borrows the problem, which borrows the task and the engine. They lie in that
//! order on one thread's stack. Python holds the ends of the two channels, which borrow nothing. A
//! message costs some microseconds, a step of a batch a millisecond or more.

use std::sync::Mutex;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use asid_algorithms::explore::environment::FisherEnvironment;
use asid_core::{Result, Transition};
use pyo3::prelude::*;

use crate::batch::{Call, Shape, answer};
use crate::failure::{ended, exception};
use crate::opened::{Opened, Request};

/// Interval at which a wait checks Python for signals such as that of Ctrl-C: shorter than a person
/// notices.
const LOOK: Duration = Duration::from_millis(100);

/// An answer, and the simulator's time for it, s.
type Timed = (Result<Transition>, f64);

/// The ends of the channels.
pub struct Worker {
    calls: Sender<Call>,
    answers: Mutex<Receiver<Timed>>,
    /// Whether a call was interrupted whose answer is still to come.
    outstanding: bool,
    /// The simulator's time for all answers, s.
    pub seconds: f64,
}

impl Worker {
    /// Starts the thread, and waits until everything is loaded.
    ///
    /// # Errors
    /// As an exception, when the task, the engine or the settings are incompatible.
    pub fn start(py: Python<'_>, request: Request) -> PyResult<(Self, Shape)> {
        let (calls, called) = channel();
        let (answering, answers) = channel();
        let (opening, opened) = channel();
        std::thread::Builder::new()
            .name("asid episodes".into())
            .spawn(move || {
                let failed = match own(&request, &opening, &called, &answering) {
                    Ok(()) => return,
                    Err(error) => error,
                };
                // If the batch was already open, nobody waits for this message.
                let _ = opening.send(Err(failed));
            })?;
        let shape = wait(py, &Mutex::new(opened))?.map_err(|e| exception(&e))?;
        let worker = Self {
            calls,
            answers: Mutex::new(answers),
            outstanding: false,
            seconds: 0.0,
        };
        Ok((worker, shape))
    }

    /// Sends a call that has no answer.
    ///
    /// # Errors
    /// When the thread has ended.
    pub fn tell(&self, call: Call) -> PyResult<()> {
        self.calls.send(call).map_err(|_| ended())
    }

    /// Sends a call and waits for its answer, without holding the interpreter's lock.
    ///
    /// # Errors
    /// When the engine fails, or a signal handler raises, as for Ctrl-C.
    pub fn ask(&mut self, py: Python<'_>, call: Call) -> PyResult<Transition> {
        if self.outstanding {
            // Discard the answer to a call that was interrupted.
            let _ = wait(py, &self.answers)?;
            self.outstanding = false;
        }
        self.tell(call)?;
        self.outstanding = true;
        let (answer, seconds) = wait(py, &self.answers)?;
        self.outstanding = false;
        self.seconds += seconds;
        answer.map_err(|e| exception(&e))
    }
}

/// Body of the thread: opens everything, then answers one call after the other.
fn own(
    request: &Request,
    opening: &Sender<Result<Shape>>,
    called: &Receiver<Call>,
    answering: &Sender<Timed>,
) -> Result<()> {
    let opened = Opened::new(request)?;
    let problem = opened.problem();
    let mut environment = FisherEnvironment::new(&problem, &request.fisher, request.episodes)?;
    let shape = Shape::of(&problem, &environment, opened.engine());
    if opening.send(Ok(shape)).is_err() {
        return Ok(());
    }
    for call in called {
        let clock = Instant::now();
        if let Some(answer) = answer(&mut environment, call)
            && answering
                .send((answer, clock.elapsed().as_secs_f64()))
                .is_err()
        {
            break;
        }
    }
    Ok(())
}

/// Waits for a message without holding the interpreter's lock, and checks for signals periodically.
fn wait<T: Send>(py: Python<'_>, messages: &Mutex<Receiver<T>>) -> PyResult<T> {
    loop {
        let next = py.detach(|| match messages.lock() {
            Ok(messages) => messages.recv_timeout(LOOK),
            Err(_) => Err(RecvTimeoutError::Disconnected),
        });
        match next {
            Ok(message) => return Ok(message),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => return Err(ended()),
        }
    }
}
