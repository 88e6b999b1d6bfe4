//! Settings of algorithms: tables as in a configuration file.

use crate::error::{Error, Result};

/// Settings of an algorithm, as in a configuration file.
pub type Settings = toml::Table;

/// Reads an algorithm's settings; unknown keys, wrong types and numbers that are
/// not finite are errors.
///
/// # Errors
/// [`Error::Config`] naming `section` and the key.
pub fn settings<S: serde::de::DeserializeOwned>(section: &str, table: &Settings) -> Result<S> {
    check_finite(section, table)?;
    S::deserialize(toml::Value::Table(table.clone())).map_err(|e| Error::Config {
        key: section.to_owned(),
        message: crate::scene::one_line(e.message()),
    })
}

fn check_finite(section: &str, table: &Settings) -> Result<()> {
    for (key, value) in table {
        let key = format!("{section}.{key}");
        match value {
            toml::Value::Table(inner) => check_finite(&key, inner)?,
            toml::Value::Float(x) if !x.is_finite() => {
                return Err(Error::Config {
                    key,
                    message: format!("{value} is not a finite number"),
                });
            }
            _ => {}
        }
    }
    Ok(())
}

/// The default settings of an algorithm as a table.
#[must_use]
pub fn defaults<S: Default + serde::Serialize>() -> Settings {
    toml::Table::try_from(S::default()).unwrap_or_default()
}
