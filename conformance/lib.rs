//! Is an engine right? Checks of a backend against theory, and against the
//! contract of [`asid_core::simulator`].
//!
//! A [`Check`] is a value: its name, the capability bits it needs, a function
//! from a backend to one figure, the tolerance of that figure and the reason
//! for the tolerance. A figure is a *deviation*: from a closed-form solution, or
//! a count of broken promises, so that zero is perfect for every check. Running
//! a check gives a [`Row`], and rows are all there is to read: what an engine
//! does not claim is a row too, and so is what it is known to get wrong.
//!
//! Two rules keep the suite honest. A check looks at capability bits and never
//! at an engine's name; what one engine is known to miss stands in the table
//! `deviations.toml`, with the figure that is allowed and the reason. And a
//! tolerance follows from the time step, the arithmetic or the softness that
//! the scene asks for, not from what some engine happens to give.
//!
//! ```no_run
//! # fn main() -> asid_core::Result<()> {
//! let entry = asid_core::registry::find::<asid_core::registry::BackendEntry>("mujoco")?;
//! let backend = (entry.make)()?;
//! let rows = asid_conformance::run(&*backend);
//! assert!(rows.iter().all(|row| !row.is_failure()), "{}", asid_conformance::table(&rows));
//! # Ok(())
//! # }
//! ```

mod actuators;
mod arrays;
mod check;
mod claims;
mod contact;
mod contact_parameters;
mod contact_rules;
mod deviations;
mod divergence;
mod dynamics;
mod equalities;
mod faults;
mod forces;
mod frames;
mod friction;
mod hooks;
mod joints;
mod layout;
mod lifetime;
mod mechanism_parameters;
mod pair;
mod parameters;
mod rig;
mod state;
mod subject;

pub use check::{Check, Outcome, Row, Tolerance, table};

use asid_core::Backend;

/// Every check, family after family.
pub fn checks() -> impl Iterator<Item = &'static Check> {
    [
        dynamics::CHECKS,
        joints::CHECKS,
        equalities::CHECKS,
        contact::CHECKS,
        contact_rules::CHECKS,
        friction::CHECKS,
        actuators::CHECKS,
        arrays::CHECKS,
        frames::CHECKS,
        contact_parameters::CHECKS,
        mechanism_parameters::CHECKS,
        parameters::CHECKS,
        forces::CHECKS,
        hooks::CHECKS,
        state::CHECKS,
        lifetime::CHECKS,
        divergence::CHECKS,
        faults::CHECKS,
        claims::CHECKS,
    ]
    .into_iter()
    .flatten()
}

/// Runs every check on a backend.
#[must_use]
pub fn run(backend: &dyn Backend) -> Vec<Row> {
    checks().map(|check| check.run(backend)).collect()
}
