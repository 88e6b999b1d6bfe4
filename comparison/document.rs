//! `config.toml` of a comparison: its plan under `[compare]`, and beside it the settings of every
//! run in the format of a run's own `config.toml`.

use std::path::Path;

use asid_core::{Error, Result};
use asid_documents::toml_text;

use crate::plan::Plan;

/// Name of the section that holds the plan.
pub const SECTION: &str = "compare";

/// The plan of a comparison, with its settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// The plan.
    pub plan: Plan,
    /// Settings of every run; those of an algorithm apply to the methods that use it.
    pub settings: toml::Table,
}

impl Document {
    /// Returns the document as TOML text.
    ///
    /// # Errors
    /// When the plan cannot be written as TOML, for example because of a seed beyond 63 bits.
    pub fn text(&self) -> Result<String> {
        let wrong = |e: toml::ser::Error| Error::Config {
            key: SECTION.into(),
            message: e.to_string(),
        };
        let mut all = self.settings.clone();
        let plan = toml::Table::try_from(&self.plan).map_err(wrong)?;
        all.insert(SECTION.into(), plan.into());
        toml::to_string_pretty(&all).map_err(wrong)
    }

    /// Takes the plan out of a configuration; `None` where it has no `[compare]`.
    ///
    /// # Errors
    /// When the section is no valid plan.
    pub fn plan_of(table: &mut toml::Table) -> Result<Option<Plan>> {
        let Some(section) = table.remove(SECTION) else {
            return Ok(None);
        };
        section
            .try_into()
            .map(Some)
            .map_err(|e: toml::de::Error| Error::Config {
                key: SECTION.into(),
                message: toml_text::keyed(&e),
            })
    }

    /// Reads a comparison's `config.toml`.
    ///
    /// # Errors
    /// When it cannot be read or belongs to something else.
    pub fn read(path: &Path) -> Result<Self> {
        let wrong = |message: String| Error::File {
            path: path.to_owned(),
            message,
        };
        let text = std::fs::read_to_string(path)
            .map_err(|e| wrong(format!("{e}; is this the folder of a comparison?")))?;
        let mut settings: toml::Table =
            toml_text::read(&text).map_err(|e| wrong(toml_text::located(&text, &e)))?;
        let plan = Self::plan_of(&mut settings).map_err(|e| wrong(e.to_string()))?;
        let plan = plan.ok_or_else(|| wrong("is not the configuration of a comparison".into()))?;
        Ok(Self { plan, settings })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::tests::plan;

    #[test]
    fn a_comparison_reads_back_from_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let settings = "model = 'a.xml'\n[solver]\niterations = 3".parse().unwrap();
        let document = Document {
            plan: plan(),
            settings,
        };
        let path = folder.path().join("config.toml");
        std::fs::write(&path, document.text().unwrap()).unwrap();
        assert_eq!(Document::read(&path).unwrap(), document);
        std::fs::write(&path, "task = 'rod-balancing'").unwrap();
        let message = Document::read(&path).unwrap_err().to_string();
        assert!(message.contains("not the configuration of a comparison"));
    }
}
