//! The table of known deviations of engines, as data beside the checks.

use std::sync::LazyLock;

use serde::Deserialize;

/// One known deviation.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deviation {
    /// Name of the backend.
    pub engine: String,
    /// Name of the check.
    pub check: String,
    /// Largest magnitude of the figure that is accepted.
    pub allowed: f64,
    /// Reason of the deviation.
    pub reason: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    #[serde(default)]
    deviation: Vec<Deviation>,
}

// A table that does not parse counts as empty, so that it excuses nothing. A test of this module
// parses it.
static TABLE: LazyLock<Vec<Deviation>> = LazyLock::new(|| {
    toml::from_str::<Table>(include_str!("deviations.toml"))
        .map(|table| table.deviation)
        .unwrap_or_default()
});

/// The known deviation of an engine in a check.
pub fn find(engine: &str, check: &str) -> Option<&'static Deviation> {
    TABLE
        .iter()
        .find(|d| d.engine == engine && d.check == check)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_names_checks_and_reasons() {
        let table: Table = toml::from_str(include_str!("deviations.toml")).unwrap();
        for deviation in table.deviation {
            assert!(
                crate::checks().any(|c| c.name == deviation.check),
                "no check is called {}",
                deviation.check
            );
            assert!(deviation.allowed.is_finite() && deviation.reason.len() > 20);
        }
    }
}
