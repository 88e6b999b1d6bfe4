//! Shared parts of the tests of diagnoses.

use std::sync::Arc;

use asid::core::registry::{BackendEntry, all};
use asid::core::{Backend, Capabilities};

/// Returns the default engine of a diagnosis: one in double precision, if one is built in.
pub fn engine() -> Arc<dyn Backend> {
    let mut made: Vec<Arc<dyn Backend>> = all::<BackendEntry>()
        .into_iter()
        .map(|e| (e.make)().unwrap().into())
        .collect();
    let double = |b: &Arc<dyn Backend>| b.capabilities().contains(Capabilities::DOUBLE_PRECISION);
    let at = made.iter().position(double).unwrap_or(0);
    made.swap_remove(at)
}
