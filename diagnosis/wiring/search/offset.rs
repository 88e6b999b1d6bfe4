//! A column with another zero, shifted by the offset that shrinks misses most.

use asid_core::Result;

use super::{Search, Tried};
use crate::wiring::hypotheses::{Fault, Hypothesis, Quantity, view_of, with};
use crate::wiring::record::Series;
use crate::wiring::size::{self, Fit};
use crate::wiring::view::View;
use crate::wiring::windows::Misses;

/// Finite-difference step of an offset, in the column's standard deviation.
const OFFSET_PROBE: f64 = 0.05;
/// Largest step of an offset, in the column's standard deviation.
const OFFSET_STEP: f64 = 1.0;

impl Search<'_> {
    /// Standard deviation of a column over all logs, in the quantity's unit.
    fn spread(&self, view: &View, quantity: &Quantity) -> f64 {
        let own = view_of(view, quantity);
        let all = self.record.iter().map(|r| &r.readings[own.from]);
        own.factor.abs() * Series::joined(all).spread()
    }

    /// Offset of a column that shrinks misses most; `None` if it is small.
    pub(super) fn offset(
        &mut self,
        view: &View,
        index: usize,
        given: &Misses,
    ) -> Result<Option<Tried>> {
        let quantity = &self.quantities[index];
        // The zero of a frame in space belongs to no column. Where bodies touch, any shift of it
        // changes what they do.
        if quantity.command || quantity.name != quantity.whole {
            return Ok(None);
        }
        let spread = self.spread(view, quantity);
        let at = |size: f64| shifted(view, quantity, size);
        // An initial state given by the log shows the offset directly, without the model's own
        // errors.
        let told = self.few.start_shift(view, quantity.place)?;
        let size = match told {
            Some(size) => size,
            None => size::fit(&mut self.few, &at, offset_fit(spread, 0.0))?.0,
        };
        if size.abs() < self.settings.offset * spread {
            return Ok(None);
        }
        let misses = self.few.misses(&at(size))?;
        let hypothesis = Hypothesis {
            fault: Fault::Offset,
            quantities: vec![index],
            rare: false,
            compound: false,
            view: at(size),
        };
        Ok(Some(self.judged(hypothesis, given, &misses)))
    }

    /// Whether the offset of a column is rejected because it changes between the halves of the
    /// logs.
    ///
    /// A reading that drifts has a mean as well. So the more the offset changes, relative to its
    /// size, the more it must shrink misses.
    pub(super) fn is_drift(
        &mut self,
        (view, hypothesis): (&View, &Hypothesis),
        (given, misses): (&Misses, &Misses),
    ) -> Result<bool> {
        if hypothesis.fault != Fault::Offset {
            return Ok(false);
        }
        let quantity = &self.quantities[hypothesis.quantities[0]];
        let size = view_of(&hypothesis.view, quantity).offset - view_of(view, quantity).offset;
        let probe = OFFSET_PROBE * self.spread(view, quantity);
        let larger = shifted(&hypothesis.view, quantity, probe);
        let larger = self.all.misses(&larger)?;
        let further = [false, true].map(|later| {
            let [here, there] = [misses, &larger].map(|m| self.all.of_half(m, later));
            size::further(&here, &there, probe)
        });
        let [Some(early), Some(late)] = further else {
            return Ok(false);
        };
        let change = (late - early).abs() / size.abs();
        let shrinkage = self.settings.shrinkage(given, misses);
        Ok(self.settings.probability(shrinkage, change) < self.settings.named)
    }

    /// Returns the same offset, fitted to all windows.
    pub(super) fn refined_offset(
        &mut self,
        view: &View,
        found: Tried,
        given: &Misses,
    ) -> Result<Tried> {
        let quantity = &self.quantities[found.hypothesis.quantities[0]];
        // Given initial states already determine it.
        if self.all.start_shift(view, quantity.place)?.is_some() {
            return Ok(found);
        }
        let spread = self.spread(view, quantity);
        let before = view_of(view, quantity).offset;
        let start = view_of(&found.hypothesis.view, quantity).offset - before;
        let at = |size: f64| shifted(view, quantity, size);
        let (size, misses) = size::fit(&mut self.all, &at, offset_fit(spread, start))?;
        let hypothesis = Hypothesis {
            view: at(size),
            ..found.hypothesis
        };
        Ok(self.judged(hypothesis, given, &misses))
    }
}

/// Settings of the fit of an offset to a column with some standard deviation.
fn offset_fit(spread: f64, start: f64) -> Fit {
    Fit {
        start,
        probe: OFFSET_PROBE * spread,
        longest: OFFSET_STEP * spread,
        parameters: false,
    }
}

/// Returns a view with the offset of one quantity changed.
fn shifted(view: &View, quantity: &Quantity, by: f64) -> View {
    let mut own = view_of(view, quantity);
    own.offset += by;
    with(view, quantity, own)
}
