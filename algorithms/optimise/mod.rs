//! Optimisers of a cost.
//!
//! [`Search`] is the common part of `cem`, `reps` and `cma-es`: a normal distribution inside a box,
//! draws from it, and the best draw so far. The [`UpdateRule`] says how the distribution follows
//! the costs of its draws; the algorithms differ in nothing else. [`gauss_newton`] minimises a sum
//! of squares from its single terms.
//!
//! The optimisers do not know about simulators: the caller evaluates a whole population in one
//! batch.

pub mod cem;
pub mod cma_es;
pub mod gauss_newton;
pub mod gaussian;
pub mod reps;
pub mod search;

pub use cem::{Cem, CemSettings};
pub use cma_es::{CmaEs, CmaEsSettings};
pub use gauss_newton::GaussNewtonSettings;
pub use gaussian::Gaussian;
pub use reps::{Reps, RepsSettings};
pub use search::{Search, UpdateRule};

/// Refuses a setting that is out of its domain; `domain` says what it must be.
///
/// # Errors
/// [`asid_core::Error::Config`] naming `key` where `ok` is false.
pub fn require(ok: bool, key: &str, value: f64, domain: &str) -> asid_core::Result<()> {
    if ok {
        return Ok(());
    }
    Err(asid_core::Error::Config {
        key: key.to_owned(),
        message: format!("must be {domain}, not {value}"),
    })
}
