//! The rest of a clock or an offset that the correction of the wiring underestimated.
//!
//! The correction is estimated over short windows of the model as given. The fit to whole logs is
//! more accurate, and its verdict then has the rest of the fault as an effect. It belongs into the
//! same line of the study's file.

use asid_core::registry::find;
use asid_core::{Layout, Result};
use asid_effects::{Effect, EffectEntry, EffectSpec};
use asid_logs::episode::ColumnMapping;

use super::{CLOCK, Intake, ZERO};
use crate::result::WiringResult;
use crate::wiring;
use crate::wiring::view::rounded;

/// The rest of the corrected faults.
#[derive(Clone, Debug, PartialEq)]
pub struct Short {
    /// Additional delay of all readings, s.
    pub clock: Option<f64>,
    /// Additional offsets of columns, each with its name, in the unit of the reading.
    pub zeros: Vec<(String, f64)>,
}

/// The values of an effect of some kind at a sensor.
fn values_at<'e>(
    effects: &'e [EffectSpec],
    sensor: &str,
    kind: impl Fn(&dyn Effect) -> bool,
) -> Option<&'e [(String, f64)]> {
    let is_kind =
        |e: &EffectSpec| find::<EffectEntry>(&e.name).is_ok_and(|entry| kind(&*(entry.make)()));
    let own = effects.iter().find(|e| e.site == sensor && is_kind(e))?;
    Some(&own.values)
}

/// Index of a column among the values of a shift: that of a scalar first, then those of a vector's
/// entries.
pub(super) fn place_of<'c>(column: &'c str, sensor: &'c str) -> Option<usize> {
    match column.strip_prefix(sensor)? {
        "" => Some(0),
        entry => Some(1 + entry.strip_prefix('.')?.parse::<usize>().ok()?),
    }
}

impl Intake {
    /// Returns what is left of a corrected clock or offset, according to a verdict.
    ///
    /// A verdict shows it if it has every sensor late after a clock was corrected, or if it shifts
    /// a reading whose offset was. `None` if it does neither.
    #[must_use]
    pub fn estimated_short(&self, effects: &[EffectSpec]) -> Option<Short> {
        let short = Short {
            clock: self.clock_short(effects),
            zeros: self.zeros_short(effects),
        };
        (short.clock.is_some() || !short.zeros.is_empty()).then_some(short)
    }

    /// Mean delay of all sensors, s.
    fn clock_short(&self, effects: &[EffectSpec]) -> Option<f64> {
        let clock = self.clock()?;
        let late = |sensor: &String| {
            let delay = values_at(effects, sensor, |e| e.delays())?.first()?;
            Some(delay.1)
        };
        let delays: Vec<f64> = clock.columns.iter().map(late).collect::<Option<_>>()?;
        Some(delays.iter().sum::<f64>() / delays.len().max(1) as f64)
    }

    /// Offsets that remove a verdict's shifts from the columns whose zero was corrected.
    fn zeros_short(&self, effects: &[EffectSpec]) -> Vec<(String, f64)> {
        let zeros = self.wiring.iter().filter(|w| w.fault == ZERO);
        let columns = zeros.flat_map(|w| &w.columns);
        let short = |column: &String| {
            let sensor = column.split('.').next()?;
            let shift = values_at(effects, sensor, |e| e.shifts_readings())?;
            let (_, by) = shift.get(place_of(column, sensor)?)?;
            (*by != 0.0).then(|| (column.clone(), -by))
        };
        columns.filter_map(short).collect()
    }

    /// Corrects the rest of the faults, in the logs and in the lines for the study's file.
    ///
    /// # Errors
    /// When the logs are too short for it.
    pub fn mend_further(&mut self, short: &Short, layout: &Layout) -> Result<()> {
        let columns = self.clock().map(|clock| clock.columns.clone());
        let mut further: Vec<ColumnMapping> = Vec::new();
        for mapping in &mut self.mappings {
            let of_clock = (columns.as_ref())
                .is_some_and(|columns| wiring::mend::concerns_any(mapping, columns));
            if let Some(seconds) = short.clock.filter(|_| of_clock) {
                mapping.delay = rounded(mapping.delay + seconds);
            }
            if let Some((_, by)) = short.zeros.iter().find(|(name, _)| *name == mapping.name) {
                let before = mapping.offset;
                mapping.offset = rounded(before + by);
                further.push(ColumnMapping {
                    offset: mapping.offset - before,
                    ..ColumnMapping::of(&mapping.name)
                });
            }
        }
        let mappings = if let Some(before) = &self.before {
            self.study = before.clone();
            &self.mappings
        } else {
            &further
        };
        wiring::mend::apply(&mut self.study, layout, mappings)?;
        wiring::mend::write_lines(&mut self.wiring, &self.study, layout, &self.mappings);
        Ok(())
    }

    /// The corrected clock.
    pub(super) fn clock(&self) -> Option<&WiringResult> {
        self.wiring.iter().find(|w| w.fault == CLOCK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_first_value_of_a_shift_and_the_entries_of_a_vector_the_others() {
        assert_eq!(place_of("q", "q"), Some(0));
        assert_eq!(place_of("ball.2", "ball"), Some(3));
        assert_eq!(place_of("ballast", "ball"), None);
    }
}
