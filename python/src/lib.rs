//! The Python module `asid._native`: batches of exploration episodes, stepped in this process.
//!
//! It contains only what a learner calls thousands of times a second. Whole runs (`asid.diagnose`
//! and the like) use the program `asid` in the same package, so that a fault of an engine ends that
//! program and not the calling notebook.

mod batch;
mod episodes;
mod failure;
mod opened;
mod worker;

use asid_core::registry::{BackendEntry, TaskEntry, all};
// Linked for the entries that they register.
#[cfg(feature = "mujoco")]
use asid_mujoco as _;
use asid_rapier as _;
use asid_tasks as _;
use pyo3::prelude::*;

/// The tasks that are registered: name and one line about each.
#[pyfunction]
fn tasks() -> Vec<(&'static str, &'static str)> {
    let entries = all::<TaskEntry>();
    entries.iter().map(|e| (e.name, e.about)).collect()
}

/// The engines that this module holds, by name.
#[pyfunction]
fn backends() -> Vec<&'static str> {
    all::<BackendEntry>().iter().map(|e| e.name).collect()
}

/// Batches of exploration episodes.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<episodes::Episodes>()?;
    module.add_function(wrap_pyfunction!(tasks, module)?)?;
    module.add_function(wrap_pyfunction!(backends, module)?)?;
    module.add("__version__", env!("CARGO_PKG_VERSION"))
}
