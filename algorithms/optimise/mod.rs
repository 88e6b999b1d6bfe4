//! Optimisers of a cost.
//!
//! [`Search`] is what `cem`, `reps` and `cma-es` have in common: a normal distribution inside a box, draws
//! from it, and the best that was seen. How the distribution follows what its draws cost is the
//! [`UpdateRule`], and all that tells one algorithm from another. [`gauss_newton`] minimises a sum of
//! squares whose terms it sees.
//!
//! They know nothing of simulators, so a whole population is one batch call of
//! the caller's.

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
