//! The paper's tables as plans, and the quick look.

use asid_core::{Error, Result};

use crate::paper::STAND_IN;
use crate::plan::PERTURBED;

/// Default number of runs per row.
pub const SEEDS: u64 = 10;

/// Runs per row in a quick look: the fewest that allow an interval.
pub const QUICK_SEEDS: u64 = 3;

/// Divisor of the budgets of all searches in a quick look. Iterations and populations both shrink,
/// so a run costs about a quarter.
const QUICK: i64 = 2;

/// Settings that determine how long an algorithm searches.
const BUDGETS: [&str; 2] = ["iterations", "population"];

/// A table of the paper as a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Preset {
    /// Number of the paper's table.
    pub table: u8,
    /// Tasks with their conditions.
    pub tasks: &'static [(&'static str, &'static [&'static str])],
    /// Methods.
    pub methods: &'static [&'static str],
    /// World.
    pub world: &'static str,
}

const PRESETS: [Preset; 3] = [
    // Downstream results in simulation; both readings of the sphere, see `crate::paper`.
    Preset {
        table: 1,
        tasks: &[
            ("rod-balancing", &["left", "middle", "right"]),
            ("sphere-striking", &["in-range", "out-of-range"]),
            ("sphere-patches", &["in-range", "out-of-range"]),
        ],
        methods: &[
            "random",
            "maxmi",
            "dr",
            "asid-estimator",
            "asid",
            "asid-ppo",
            "oracle",
        ],
        world: PERTURBED,
    },
    // Rod balancing on a real arm.
    Preset {
        table: 2,
        tasks: &[("rod-balancing", &["left", "middle", "right"])],
        methods: &["dr", "asid"],
        world: STAND_IN,
    },
    // Shuffleboard on a real arm.
    Preset {
        table: 3,
        tasks: &[("shuffleboard", &["near", "far"])],
        methods: &["dr", "asid"],
        world: STAND_IN,
    },
];

/// The plan of a table of the paper.
///
/// # Errors
/// When the paper has no such table.
pub fn of_table(table: u8) -> Result<Preset> {
    PRESETS
        .into_iter()
        .find(|p| p.table == table)
        .ok_or_else(|| Error::Config {
            key: "--table".into(),
            message: format!("the paper has tables 1, 2 and 3, and no table {table}"),
        })
}

/// Budgets of a quick look for an algorithm's resolved settings, as `section.key` and value.
///
/// Each is half of the full budget, rounded up.
#[must_use]
pub fn quick(section: &str, settings: &toml::Table) -> Vec<(String, i64)> {
    BUDGETS
        .iter()
        .filter_map(|key| {
            let full = settings.get(*key)?.as_integer()?;
            Some((format!("{section}.{key}"), (full + QUICK - 1) / QUICK))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Method;
    use crate::paper::published;

    #[test]
    fn each_table_has_every_value_that_the_paper_prints() {
        let mut found = 0;
        for preset in PRESETS {
            assert!(preset.methods.iter().all(|m| Method::named(m).is_ok()));
            for (task, conditions) in preset.tasks {
                for condition in *conditions {
                    for method in preset.methods {
                        let value = published(task, condition, method, preset.world);
                        found += usize::from(value.is_some_and(|v| v.table == preset.table));
                    }
                }
            }
        }
        // 20 of Table 1, the sphere's 5 a second time, 6 of Table 2, 4 of Table 3.
        assert_eq!(found, 20 + 5 + 6 + 4);
        assert!(of_table(4).unwrap_err().to_string().contains("1, 2 and 3"));
    }

    #[test]
    fn a_quick_look_halves_budgets_and_nothing_else() {
        let settings = "iterations = 5\npopulation = 64\nnoise = 0.1\nname = 'cem'";
        let halved = quick("solver", &settings.parse().unwrap());
        assert_eq!(
            halved,
            [
                ("solver.iterations".to_owned(), 3),
                ("solver.population".to_owned(), 32)
            ]
        );
    }
}
