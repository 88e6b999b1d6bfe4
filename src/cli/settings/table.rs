//! Reads settings from TOML, with errors that name the key.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use asid_core::Error;
use asid_documents::toml_text;
use serde::de::DeserializeOwned;

use crate::cli::options::Common;

/// An error about the setting or the option `key`.
pub fn wrong(key: &str, message: impl Into<String>) -> anyhow::Error {
    Error::Config {
        key: key.to_owned(),
        message: message.into(),
    }
    .into()
}

/// The table of a TOML file.
pub fn read_table(path: &Path) -> Result<toml::Table> {
    let file = |message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    let text = std::fs::read_to_string(path).map_err(|e| file(e.to_string()))?;
    Ok(toml_text::read(&text).map_err(|e| file(toml_text::located(&text, &e)))?)
}

/// The configuration file of a command, or the table that replaces it.
pub fn configured(common: &Common) -> Result<toml::Table> {
    match &common.config {
        Some(path) => read_table(path),
        None => Ok(common.base.clone()),
    }
}

/// The configuration file of a command, then its `--set`.
pub fn given(common: &Common) -> Result<toml::Table> {
    let mut table = configured(common)?;
    for assignment in &common.set {
        set(&mut table, assignment)?;
    }
    Ok(table)
}

/// Deserialises settings into a type that names the keys.
pub fn parsed<T: DeserializeOwned>(table: toml::Table) -> Result<T> {
    let wrong = |e: toml::de::Error| wrong("--config, --set", toml_text::keyed(&e));
    table.try_into().map_err(wrong)
}

/// The settings of a file that may hold these keys and no others.
pub fn read(path: &Path, known: &[&'static str]) -> Result<toml::Table> {
    let table = read_table(path)?;
    check_keys(&path.display().to_string(), &table, known)?;
    Ok(table)
}

/// A list of texts; empty where the key is missing.
pub fn texts(table: &toml::Table, key: &str) -> Result<Vec<String>> {
    match table.get(key) {
        None => Ok(Vec::new()),
        Some(value) => value
            .as_array()
            .and_then(|a| a.iter().map(|v| v.as_str().map(str::to_owned)).collect())
            .ok_or_else(|| wrong(key, format!("{value} is not a list of texts"))),
    }
}

/// Applies `key.key=value`; a value that is not valid TOML is taken as text.
pub fn set(table: &mut toml::Table, assignment: &str) -> Result<()> {
    let (key, value) = assignment
        .split_once('=')
        .ok_or_else(|| wrong("--set", format!("`{assignment}` is not KEY=VALUE")))?;
    let value = toml_text::read::<toml::Table>(&format!("x = {value}"))
        .ok()
        .and_then(|mut t| t.remove("x"))
        .unwrap_or_else(|| toml::Value::String(value.trim().to_owned()));
    let mut parts: Vec<&str> = key.trim().split('.').collect();
    let last = parts.pop().unwrap_or_default();
    let mut at = table;
    for part in parts {
        at = at
            .entry(part)
            .or_insert_with(|| toml::Value::Table(toml::Table::new()))
            .as_table_mut()
            .ok_or_else(|| {
                wrong(
                    key,
                    format!("`{part}` is a value and has no settings below it"),
                )
            })?;
    }
    at.insert(last.to_owned(), value);
    Ok(())
}

pub fn text(table: &toml::Table, key: &str) -> Result<Option<String>> {
    table
        .get(key)
        .map(|v| {
            v.as_str()
                .map(str::to_owned)
                .ok_or_else(|| wrong(key, format!("{v} is not a text in quotes")))
        })
        .transpose()
}

/// The seed that a table states.
pub fn seed(table: &toml::Table) -> Result<Option<u64>> {
    let whole = |value: &toml::Value| {
        let seed = value.as_integer().and_then(|s| u64::try_from(s).ok());
        seed.ok_or_else(|| wrong("seed", format!("{value} is not a whole number from 0 up")))
    };
    table.get("seed").map(whole).transpose()
}

pub fn section(table: &toml::Table, key: &str) -> Result<toml::Table> {
    match table.get(key) {
        None => Ok(toml::Table::new()),
        Some(toml::Value::Table(t)) => Ok(t.clone()),
        Some(other) => Err(wrong(key, format!("{other} is not a section of settings"))),
    }
}

pub fn check_keys(name: &str, table: &toml::Table, known: &[&'static str]) -> Result<()> {
    for key in table.keys() {
        if !known.contains(&key.as_str()) {
            let unknown = Error::unknown("setting", key, known.iter().copied());
            return Err(wrong(name, unknown.to_string()));
        }
    }
    Ok(())
}

pub fn numbers(name: &str, table: &toml::Table) -> Result<BTreeMap<String, f64>> {
    table
        .iter()
        .map(|(key, value)| {
            value
                .as_float()
                .or_else(|| value.as_integer().map(|i| i as f64))
                .filter(|x| x.is_finite())
                .map(|x| (key.clone(), x))
                .ok_or_else(|| {
                    wrong(
                        &format!("{name}.{key}"),
                        format!("{value} is not a finite number"),
                    )
                })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: an error at the beginning of a line named the line before. Cause: the lines of the
    /// text before it were counted, of which the last had just ended.
    #[test]
    fn an_error_at_the_beginning_of_a_line_names_that_line() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        for (text, expected) in [
            ("seed = 1\nseed = 2\n", "line 2: "),
            ("= 2\n", "line 1: "),
            ("seed = 1\n\nworld = matched\n", "line 3: "),
        ] {
            std::fs::write(&file, text).unwrap();
            let error = read_table(&file).unwrap_err().to_string();
            assert!(error.contains(expected), "{text:?}: {error}");
        }
    }
}
