//! What can go wrong while cases are made.

use std::path::PathBuf;

/// A failure of the generator.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// MuJoCo refuses a model.
    #[error("machine `{machine}`: MuJoCo refuses the model: {message}")]
    Model {
        /// Name of the machine.
        machine: String,
        /// MuJoCo's message, in one line.
        message: String,
    },
    /// A model that others wrote cannot be a machine.
    #[error("cannot be a machine: {why}")]
    Unfit {
        /// Which element is in the way, and why.
        why: String,
    },
    /// A model has no such element.
    #[error("machine `{machine}` has no {element} `{name}`")]
    Element {
        /// Name of the machine.
        machine: String,
        /// Tag of the element.
        element: String,
        /// Name that was looked for.
        name: String,
    },
    /// A simulation left all bounds.
    #[error("a simulation of `{machine}` diverged at {time:.3} s")]
    Diverged {
        /// Name of the machine.
        machine: String,
        /// Time, s.
        time: f64,
    },
    /// No draw of a case was usable.
    #[error("case {case}: none of {attempts} draws was usable; the last one: {reason}")]
    Exhausted {
        /// Number of the case.
        case: usize,
        /// Draws tried.
        attempts: u32,
        /// Why the last one was left out.
        reason: String,
    },
    /// A set is asked for that cannot be.
    #[error("{message}")]
    Wanted {
        /// What there is none of.
        message: String,
    },
    /// A file cannot be written or read.
    #[error("{path}: {message}")]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
}

/// Result of the generator.
pub type Result<T, E = Error> = std::result::Result<T, E>;
