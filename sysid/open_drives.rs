//! How far a drive's command may go if only the limits of its joint bound it.
//!
//! Such a drive has no range of commands, no range of a servo's joint and no limit of force. It is
//! simulated alone, in one slow swing to one side, larger and larger until a limit is broken. That
//! size times a margin, since motions swing there and back, is the largest that a search tries.

use asid_core::error::Result;

use crate::design::Designer;
use crate::motion::{Family, Shape};

/// Exponents of two of the swing's sizes, in the command's unit.
const SIZES: std::ops::RangeInclusive<i32> = -10..=20;

/// Factor by which a command may exceed that of the slow swing that breaks a limit.
///
/// A swing back and forth in a tenth of the time moves a mass a hundredth as far. A search reduces
/// a size that is too large.
const ROOM: f64 = 8.0;

impl Designer<'_, '_> {
    /// Replaces infinite amplitudes of the family by the sizes found; by 0 where no size breaks a
    /// limit.
    ///
    /// # Errors
    /// When the engine fails.
    pub(crate) fn bound_open_drives(&mut self) -> Result<()> {
        let open: Vec<usize> = (0..self.family.amplitude.len())
            .filter(|&a| self.family.amplitude[a].is_infinite())
            .collect();
        // Whether the machine comes to rest depends on the motion's shape.
        let rest = self.player.limits.rest.take();
        let found: Result<Vec<f64>> = open.iter().map(|&a| self.reach_of(a)).collect();
        self.player.limits.rest = rest;
        for (a, reach) in open.into_iter().zip(found?) {
            self.family.amplitude[a] = reach;
        }
        Ok(())
    }

    /// How far the command of one drive may go, all others at rest.
    fn reach_of(&mut self, drive: usize) -> Result<f64> {
        let alone = swing_of(&self.family, drive);
        let values = self.values.clone();
        for size in SIZES.map(|k| 2.0_f64.powi(k)) {
            let commands = alone.commands(&[1.0], size);
            let plays = self.player.play(&[(&commands, &values)], self.substeps)?;
            if plays.iter().any(|p| !p.excess.is_none()) {
                return Ok(ROOM * size);
            }
        }
        Ok(0.0)
    }
}

/// The family of motions of one drive alone: a single swing to one side, over the whole time.
fn swing_of(family: &Family, drive: usize) -> Family {
    let mut amplitude = vec![0.0; family.amplitude.len()];
    amplitude[drive] = 1.0;
    Family {
        shape: Shape::Spline(1),
        amplitude,
        ..family.clone()
    }
}
