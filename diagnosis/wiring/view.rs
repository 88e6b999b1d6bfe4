//! A view of the columns of a log: one hypothesis about what they mean.

use asid_logs::episode::ColumnMapping;

/// How one quantity of the model is read from the log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColumnView {
    /// Column of the log, counted like the quantities themselves.
    pub from: usize,
    /// Factor applied to the column.
    pub factor: f64,
    /// Added after the factor, in the quantity's unit.
    pub offset: f64,
    /// How late the column is, s.
    pub delay: f64,
}

impl ColumnView {
    /// Returns the view of the quantity's own column, unchanged.
    #[must_use]
    pub fn own(column: usize) -> Self {
        Self {
            from: column,
            factor: 1.0,
            offset: 0.0,
            delay: 0.0,
        }
    }

    /// Returns the view of the same column in another unit: its value times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self {
            factor: self.factor * factor,
            offset: self.offset * factor,
            ..self
        }
    }
}

/// A view of all columns.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// One view for each entry of a row of readings.
    pub readings: Vec<ColumnView>,
    /// One view for each actuator.
    pub commands: Vec<ColumnView>,
}

impl View {
    /// Returns the view of the log as it is given.
    #[must_use]
    pub fn as_given(readings: usize, commands: usize) -> Self {
        Self {
            readings: (0..readings).map(ColumnView::own).collect(),
            commands: (0..commands).map(ColumnView::own).collect(),
        }
    }
}

/// Largest relative difference from a unit's factor at which a factor counts as that unit.
const SAME_FACTOR: f64 = 1e-9;

/// Returns the mapping that reads the quantity `name` as a view says; `None` if it changes nothing.
///
/// The log's columns are named `columns`. The mapping names one of `units` if the factor is that of
/// the unit.
#[must_use]
pub fn mapping(
    name: &str,
    own: usize,
    view: ColumnView,
    columns: &[String],
    units: &[(&str, f64)],
) -> Option<ColumnMapping> {
    if view == ColumnView::own(own) {
        return None;
    }
    let mut mapping = ColumnMapping::of(name);
    if view.from != own {
        mapping.from = Some(columns[view.from].clone());
    }
    mapping.sign = view.factor.signum();
    let size = view.factor.abs();
    let same = |factor: f64| (size / factor - 1.0).abs() < SAME_FACTOR;
    let named = |(unit, factor): &&(&str, f64)| !unit.is_empty() && same(*factor);
    match units.iter().find(named) {
        Some((unit, _)) if !same(1.0) => mapping.unit = Some((*unit).to_owned()),
        _ if same(1.0) => {}
        _ => mapping.scale = size,
    }
    mapping.offset = rounded(view.offset);
    mapping.delay = rounded(view.delay);
    Some(mapping)
}

/// Significant digits of an estimate in a mapping line: what is rounded off is below the noise of
/// any log.
const DIGITS: usize = 5;

/// Rounds a number to a few significant digits.
pub fn rounded(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let text = format!("{x:.*e}", DIGITS - 1);
    text.parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mapping_says_what_the_view_does() {
        let columns = ["a".to_owned(), "b".to_owned()];
        let degrees = std::f64::consts::PI / 180.0;
        let units = [("deg", degrees)];
        let of = |view| mapping("a", 0, view, &columns, &units);
        assert_eq!(of(ColumnView::own(0)), None);
        let swapped = of(ColumnView::own(1)).unwrap();
        assert_eq!(swapped.from.as_deref(), Some("b"));
        let turned = of(ColumnView::own(0).times(-degrees)).unwrap();
        assert_eq!((turned.sign, turned.unit.as_deref()), (-1.0, Some("deg")));
        let scaled = of(ColumnView::own(0).times(25.0)).unwrap();
        assert_eq!((scaled.scale, scaled.unit), (25.0, None));
    }
}
