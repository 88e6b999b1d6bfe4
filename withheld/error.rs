//! Errors of the generator.

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
    /// A model of other authors cannot become a machine.
    #[error("cannot be a machine: {why}")]
    Unfit {
        /// The unsupported element, and the reason.
        why: String,
    },
    /// A model lacks an element.
    #[error("machine `{machine}` has no {element} `{name}`")]
    Element {
        /// Name of the machine.
        machine: String,
        /// Tag of the element.
        element: String,
        /// Name of the missing element.
        name: String,
    },
    /// A simulation diverged.
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
        /// Reason for which the last draw was left out.
        reason: String,
    },
    /// The requested set cannot exist.
    #[error("{message}")]
    Wanted {
        /// What the half does not have.
        message: String,
    },
    /// A file cannot be written or read.
    #[error("{path}: {message}")]
    File {
        /// The file.
        path: PathBuf,
        /// Reason.
        message: String,
    },
}

/// Result of the generator.
pub type Result<T, E = Error> = std::result::Result<T, E>;
