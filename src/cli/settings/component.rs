//! An algorithm with its settings: its defaults, overridden by the task's, then by the given ones.

use anyhow::Result;
use asid_core::Task;
use asid_core::registry::{self, AlgorithmEntry, Entry, Settings};
use serde::Serialize;

use super::table::{section, text, wrong};

/// An algorithm by name, with its settings.
#[derive(Clone, Debug, Serialize)]
pub struct Component {
    /// Name in the registry.
    pub name: String,
    /// All settings, defaults filled in.
    #[serde(flatten)]
    pub settings: Settings,
}

/// The algorithm of a section with all its settings.
///
/// Settings in the file belong to the algorithm that the file names. Another algorithm on the
/// command line starts from its defaults.
pub fn component<T: ?Sized + 'static>(
    task: &dyn Task,
    table: &toml::Table,
    key: &str,
    option: Option<&str>,
    default: &str,
) -> Result<Component>
where
    AlgorithmEntry<T>: Entry,
{
    let mut given = section(table, key)?;
    let named = text(&given, "name")?;
    given.remove("name");
    let name = option
        .map(str::to_owned)
        .or_else(|| named.clone())
        .unwrap_or_else(|| default.to_owned());
    if named.is_some_and(|n| n != name) {
        given.clear();
    }
    let entry = registry::find::<AlgorithmEntry<T>>(&name).map_err(|unknown| {
        crate::cli::list::missing(AlgorithmEntry::<T>::KIND, &name).unwrap_or(unknown)
    })?;
    let mut settings = (entry.defaults)();
    merge(key, &mut settings, task.settings(key, &name))?;
    merge(key, &mut settings, given)?;
    (entry.make)(&settings)?;
    Ok(Component { name, settings })
}

/// Merges settings into their defaults, which determine the type of each value.
pub fn merge(section: &str, into: &mut toml::Table, from: toml::Table) -> Result<()> {
    use toml::Value::{Boolean, Float, Integer, String, Table};
    for (key, value) in from {
        let full = format!("{section}.{key}");
        let value = match (into.get_mut(&key), value) {
            (Some(Table(a)), Table(b)) => {
                merge(&full, a, b)?;
                continue;
            }
            (Some(Float(_)), Integer(i)) => Float(i as f64),
            (Some(Float(_)), Float(x)) => Float(x),
            (Some(Float(_)), other) => {
                return Err(wrong(&full, format!("{other} is not a number")));
            }
            (Some(Integer(_)), Integer(i)) if i >= 0 => Integer(i),
            (Some(Integer(_)), other) => {
                return Err(wrong(
                    &full,
                    format!("{other} is not a whole number from 0 up"),
                ));
            }
            (Some(Boolean(_)), other) if !other.is_bool() => {
                return Err(wrong(&full, format!("{other} is neither true nor false")));
            }
            (Some(String(_)), other) if !other.is_str() => {
                return Err(wrong(&full, format!("{other} is not a text in quotes")));
            }
            (Some(Table(_)), other) => {
                return Err(wrong(
                    &full,
                    format!("{other} is not a section of settings"),
                ));
            }
            (_, other) => other,
        };
        into.insert(key, value);
    }
    Ok(())
}
