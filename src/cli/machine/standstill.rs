//! Refuses a motion that leaves the machine at rest.

use anyhow::Result;
use asid_core::Error;
use asid_sysid::design::Designed;

use super::setup::Setup;

/// Size of a motion, in standard deviations of the noise of all its readings together, below which
/// the machine stands still.
///
/// At one standard deviation the best detector errs in three of ten plays (the tail of the normal
/// distribution beyond half a deviation), so that the motion itself can hardly be seen.
const STILL: f64 = 1.0;

impl Setup<'_> {
    /// Refuses a motion that the sensors cannot tell from standing still.
    ///
    /// # Errors
    /// [`Error::Failed`] with the limit that keeps the motion so small, or if the engine fails.
    pub fn refuse_standstill(&mut self, found: &Designed) -> Result<()> {
        // A motion that breaks limits at any size is told as such.
        if !found.excess.is_none() {
            return Ok(());
        }
        let size = self
            .player
            .size_of(&found.commands, self.substeps, &self.values)?;
        if size >= STILL {
            return Ok(());
        }
        let binding = match &found.next_limit {
            Some(limit) => format!("a larger motion would break: {limit}; widen that limit"),
            None => "the ranges of the commands keep it so small; widen them in the model".into(),
        };
        Err(Error::Failed(format!(
            "the machine would stand still: all readings of the motion together are within {size:.1e} standard deviations of those at rest; {binding}"
        ))
        .into())
    }
}
