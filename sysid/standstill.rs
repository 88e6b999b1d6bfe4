//! How far a motion stands out from standing still, for the machine's sensors.

use asid_core::error::Result;

use crate::play::Player;

impl Player<'_> {
    /// The size of a motion for the sensors: the root of the sum of the squared differences of its
    /// readings to those under the commands at rest, in standard deviations of their noise.
    ///
    /// Below one, not even all readings of a play together tell that the machine has moved.
    /// Commands are `frames x nu`, with frames of `substeps` physics steps. It is infinite where a
    /// simulation diverges.
    ///
    /// # Errors
    /// As [`Player::play`].
    pub fn size_of(&mut self, commands: &[f64], substeps: usize, values: &[f64]) -> Result<f64> {
        let frames = commands.len() / self.base.len().max(1);
        let still = self.base.repeat(frames);
        let plays = self.play(&[(commands, values), (&still, values)], substeps)?;
        let [moved, rest] = &plays[..] else {
            return Ok(f64::INFINITY);
        };
        if moved.readings.is_empty() || rest.readings.is_empty() {
            return Ok(f64::INFINITY);
        }
        let width = self.differences.width();
        let mut row = vec![0.0; self.differences.whitened_len()];
        let mut sum = 0.0;
        let pairs = moved.readings.chunks_exact(width);
        for (a, b) in pairs.zip(rest.readings.chunks_exact(width)) {
            self.differences.difference(a, b, &mut row);
            sum += row.iter().map(|x| x * x).sum::<f64>();
        }
        Ok(sum.sqrt())
    }
}
