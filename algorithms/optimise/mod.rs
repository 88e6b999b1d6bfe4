//! Optimisers of a sampled cost: they draw candidates and are told what each cost.
//!
//! They know nothing of simulators, so a whole population is one batch call of
//! the caller's.

pub mod cem;
pub mod gaussian;
pub mod reps;

pub use cem::{Cem, CemSettings};
pub use gaussian::Gaussian;
pub use reps::{Reps, RepsSettings};

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
