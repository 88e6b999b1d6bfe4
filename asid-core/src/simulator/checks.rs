//! Checks that every engine applies to a call before it does anything.

use super::{Control, Rollout};
use crate::error::{Error, Result};
use crate::layout::Layout;

impl Rollout<'_> {
    /// Checks every array's length against the batch; engines call it first.
    ///
    /// # Errors
    /// [`crate::Error::Shape`], naming the array, or a body that has two forces.
    pub fn check(
        &self,
        layout: &Layout,
        batch_size: usize,
        columns: usize,
        out: &[f64],
    ) -> Result<()> {
        let (n, frames) = (self.sims.len(), self.frames);
        check_sims(self.sims, batch_size)?;
        let (control, rows) = match self.control {
            Control::Shared(all) => (all, 1),
            Control::PerSimulation(all) => (all, n),
        };
        check_len("control", control.len(), rows * frames * layout.nu())?;
        check_finite("control", control)?;
        for (i, force) in self.forces.iter().enumerate() {
            let body = force.body;
            if self.forces[..i].iter().any(|f| f.body == body) {
                return Err(Error::Shape(format!(
                    "external forces name body {body} twice"
                )));
            }
            if body == 0 || body >= layout.bodies.len() {
                let all = layout.bodies.len();
                return Err(Error::Shape(format!(
                    "external force on body {body} of {all}"
                )));
            }
            check_len("external force", force.wrench.len(), n * frames * 6)?;
            check_finite("external force", force.wrench)?;
        }
        for change in self.changes {
            if change.column >= columns || change.frame >= frames {
                return Err(Error::Shape(format!(
                    "parameter change of column {} at frame {}: there are {columns} columns and {frames} frames",
                    change.column, change.frame
                )));
            }
            check_len("parameter change", change.values.len(), n)?;
        }
        check_len("output", out.len(), n * frames * self.record.width())
    }
}

/// Checks the length of an array.
///
/// # Errors
/// [`Error::Shape`], naming it.
pub fn check_len(what: &str, have: usize, want: usize) -> Result<()> {
    if have == want {
        return Ok(());
    }
    Err(Error::Shape(format!(
        "{what} has {have} values where {want} are needed"
    )))
}

fn check_finite(what: &str, values: &[f64]) -> Result<()> {
    if values.iter().all(|x| x.is_finite()) {
        return Ok(());
    }
    Err(Error::Shape(format!(
        "{what} holds a value that is not finite"
    )))
}

/// Checks that `sims` are strictly increasing and within the batch.
///
/// # Errors
/// [`Error::Shape`] otherwise.
pub fn check_sims(sims: &[usize], batch_size: usize) -> Result<()> {
    if sims.windows(2).any(|w| w[0] >= w[1]) || sims.last().is_some_and(|&s| s >= batch_size) {
        return Err(Error::Shape(format!(
            "simulations must be strictly increasing and below {batch_size}"
        )));
    }
    Ok(())
}

/// Checks the positions (`sims x nq`) and velocities (`sims x nv`) to set in `sims` simulations of
/// a batch.
///
/// # Errors
/// [`Error::Shape`] when a length does not fit or a value is not finite.
pub fn check_state(layout: &Layout, sims: usize, qpos: &[f64], qvel: &[f64]) -> Result<()> {
    check_len("qpos", qpos.len(), sims * layout.nq)?;
    check_len("qvel", qvel.len(), sims * layout.nv)?;
    check_finite("qpos", qpos)?;
    check_finite("qvel", qvel)
}

/// Checks the simulations between which states are copied.
///
/// # Errors
/// [`Error::Shape`] when an index lies outside the batch, or is copied both from and to.
pub fn check_copy(from: &[usize], to: &[usize], batch_size: usize) -> Result<()> {
    check_sims(to, batch_size)?;
    check_len("from", from.len(), to.len())?;
    if let Some(sim) = from.iter().find(|&&s| s >= batch_size) {
        return Err(Error::Shape(format!("simulation {sim} of {batch_size}")));
    }
    if let Some(sim) = from.iter().find(|s| to.binary_search(s).is_ok()) {
        return Err(Error::Shape(format!(
            "simulation {sim} is copied from and to"
        )));
    }
    Ok(())
}
