//! Effort of predicting what an episode tells.

use anyhow::Result;
use asid_algorithms::identify::expected::ExpectedSettings;
use schemars::JsonSchema;
use serde::Serialize;

use super::component::merge;
use super::table::{section, wrong};

/// Settings of the expected deviations that a run reports.
#[derive(Clone, Copy, Debug, Serialize, JsonSchema)]
pub struct ExpectedConfig {
    /// Fits, each some 70 simulated episodes over the region that the one before found. Fewer are
    /// quicker, and expect too much where the simulator is rough: [`ExpectedSettings::rounds`].
    /// With none, deviations are those that explorers are paid for.
    pub rounds: usize,
}

impl ExpectedConfig {
    /// The section `expected` over the defaults.
    pub fn of(table: &toml::Table) -> Result<Self> {
        let usual = Self {
            rounds: ExpectedSettings::default().rounds,
        };
        let mut all = toml::Table::try_from(usual)?;
        let given = section(table, SECTION)?;
        super::table::check_keys(SECTION, &given, &["rounds"])?;
        merge(SECTION, &mut all, given)?;
        let rounds = all.get("rounds").and_then(toml::Value::as_integer);
        let rounds = rounds.and_then(|r| usize::try_from(r).ok());
        let rounds = rounds.ok_or_else(|| wrong("expected.rounds", "is no number of fits"))?;
        Ok(Self { rounds })
    }

    /// The settings for the pipeline, which gets the rest from the identifier.
    pub fn settings(self) -> ExpectedSettings {
        ExpectedSettings {
            rounds: self.rounds,
            ..ExpectedSettings::default()
        }
    }
}

const SECTION: &str = "expected";
