//! Settings of a single run, as a comparison takes them: some vary among its cells, and the kind of
//! real world follows from others where none is named.

use anyhow::Result;
use asid_worlds::WorldKind;

use crate::cli::settings::{seed, text, wrong};

/// Settings of a single run that the plan takes over, because they vary among the cells.
pub struct OfRun {
    /// Task.
    pub task: Option<String>,
    /// Condition of the task.
    pub condition: Option<String>,
    /// Engine of the simulator.
    pub backend: Option<String>,
    /// Kind of real world.
    pub world: Option<String>,
    /// Seed.
    pub seed: Option<u64>,
}

impl OfRun {
    /// Takes them out of the settings.
    ///
    /// # Errors
    /// When one has another type than it must have.
    pub fn take(settings: &mut toml::Table) -> Result<Self> {
        let text = |table: &mut toml::Table, key: &str| -> Result<Option<String>> {
            let found = text(table, key);
            table.remove(key);
            found
        };
        text(settings, "command")?;
        let seed = seed(settings)?;
        settings.remove("seed");
        let backend = text(settings, "backend")?;
        let world = match settings.get_mut("real").and_then(toml::Value::as_table_mut) {
            None => None,
            Some(real) => {
                // A run's file names the engine of its real world even where it is the simulator's.
                if backend.is_some()
                    && real.get("backend").and_then(|b| b.as_str()) == backend.as_deref()
                {
                    real.remove("backend");
                }
                text(real, "world")?
            }
        };
        Ok(Self {
            task: text(settings, "task")?,
            condition: text(settings, "condition")?,
            backend,
            world,
            seed,
        })
    }
}

/// Kind of the real world where none is named: `custom` where the settings make it other than the
/// simulator, as in a single run.
///
/// # Errors
/// When it has the engine of one simulator and not of another.
pub fn unnamed_world(settings: &toml::Table, backends: &[String]) -> Result<String> {
    let nothing = toml::Table::new();
    let real = settings.get("real").and_then(toml::Value::as_table);
    let real = real.unwrap_or(&nothing);
    let effects = real.get("effects").and_then(toml::Value::as_array);
    let models = settings.contains_key("model") || real.contains_key("model");
    let made = models || effects.is_some_and(|list| !list.is_empty());
    let engine = text(real, "backend")?;
    let is_other = |backend: &&String| engine.as_ref().is_some_and(|own| own != *backend);
    let others = backends.iter().filter(is_other).count();
    let kind = if made || (others > 0 && others == backends.len()) {
        WorldKind::Custom
    } else if others == 0 {
        WorldKind::Matched
    } else {
        let message = "is the engine of one simulator and not of another: compare on one \
                       --backend at a time, or name the kind of world by --world";
        return Err(wrong("--real-backend", message));
    };
    Ok(kind.name().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a table called a world matched whose rod was twice as heavy as the simulator's.
    /// Cause: a world without a name was the matched one, whatever the settings made of it.
    #[test]
    fn a_world_that_settings_make_another_is_no_matched_one() {
        let engines =
            |names: &[&str]| -> Vec<String> { names.iter().map(|n| (*n).to_owned()).collect() };
        let world = |settings: &str, backends: &[&str]| {
            unnamed_world(&settings.parse().unwrap(), &engines(backends))
        };
        for (settings, expected) in [
            ("", "matched"),
            (
                "[real]\ntruth = { mass_offset = 0.1 }\neffects = []",
                "matched",
            ),
            ("[real]\nbackend = 'a'", "matched"),
            ("[real]\nbackend = 'b'", "custom"),
            ("[real]\neffects = ['mass@rod:factor=2']", "custom"),
            ("[real]\nmodel = 'a.xml'", "custom"),
            ("model = 'a.xml'", "custom"),
        ] {
            assert_eq!(world(settings, &["a"]).unwrap(), expected, "{settings}");
        }
        let of_one = "[real]\nbackend = 'a'";
        let said = world(of_one, &["a", "b"]).unwrap_err().to_string();
        assert!(said.contains("--real-backend"), "{said}");
        // With a change besides it is another world for both.
        let changed = format!("{of_one}\nmodel = 'a.xml'");
        assert_eq!(world(&changed, &["a", "b"]).unwrap(), "custom");
    }

    #[test]
    fn settings_of_a_run_are_taken_out() {
        let read = |text: &str| -> toml::Table { text.parse().unwrap() };
        let mut settings = read(
            "seed = 3\nbackend = 'a'\n[real]\nbackend = 'a'\nworld = 'crossed'\n[solver]\nn = 1",
        );
        let taken = OfRun::take(&mut settings).unwrap();
        assert_eq!(taken.seed, Some(3));
        assert_eq!(
            (taken.backend.as_deref(), taken.world.as_deref()),
            (Some("a"), Some("crossed"))
        );
        assert_eq!(settings, read("[real]\n[solver]\nn = 1"));
    }
}
