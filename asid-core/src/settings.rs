//! Settings of algorithms: tables as in a configuration file.

use std::collections::BTreeMap;

use schemars::{JsonSchema, SchemaGenerator};
use serde_json::Value;

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
        message: asid_documents::toml_text::keyed(&e),
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

/// Checks rules on settings: each is a key below `section`, whether its value is valid, and what it
/// must be.
///
/// # Errors
/// [`Error::Config`] naming the first key whose value is invalid.
pub fn require(section: &str, rules: &[(&str, bool, &str)]) -> Result<()> {
    match rules.iter().find(|(_, good, _)| !good) {
        None => Ok(()),
        Some((key, _, rule)) => Err(Error::Config {
            key: format!("{section}.{key}"),
            message: format!("must be {rule}"),
        }),
    }
}

/// The default settings of an algorithm as a table.
#[must_use]
pub fn defaults<S: Default + serde::Serialize>() -> Settings {
    toml::Table::try_from(S::default()).unwrap_or_default()
}

/// Meanings of settings, by key; keys of inner tables have dots, such as `cem.smoothing`.
pub type Meanings = BTreeMap<String, String>;

/// Meanings of the settings `S`: the first paragraphs of its fields' documentation.
#[must_use]
pub fn meanings<S: JsonSchema>() -> Meanings {
    let mut generator = SchemaGenerator::default();
    let schema = S::json_schema(&mut generator);
    let definitions = generator.definitions();
    let mut found = Meanings::new();
    describe(schema.as_value(), definitions, "", &mut found);
    found
}

/// The meanings of settings without documentation.
#[must_use]
pub fn unexplained() -> Meanings {
    Meanings::new()
}

/// Resolves a reference to a schema, also an optional one; other schemas are returned as they are.
fn resolved<'a>(schema: &'a Value, definitions: &'a serde_json::Map<String, Value>) -> &'a Value {
    let options = schema["anyOf"].as_array().into_iter().flatten();
    let mut references = std::iter::once(schema).chain(options);
    let named = references.find_map(|s| s["$ref"].as_str()?.rsplit('/').next());
    named
        .and_then(|name| definitions.get(name))
        .unwrap_or(schema)
}

/// The values of a choice, as `One of a, b.`; empty for a schema that is no choice.
fn choices(schema: &Value, definitions: &serde_json::Map<String, Value>) -> String {
    let schema = resolved(schema, definitions);
    let plain = schema["enum"].as_array().into_iter().flatten();
    let described = schema["oneOf"].as_array().into_iter().flatten();
    let values = plain.chain(described.map(|one| &one["const"]));
    let names: Vec<&str> = values.filter_map(Value::as_str).collect();
    if names.is_empty() {
        return String::new();
    }
    format!("One of {}.", names.join(", "))
}

/// Adds the properties of a schema, with `prefix` before their keys.
fn describe(
    schema: &Value,
    definitions: &serde_json::Map<String, Value>,
    prefix: &str,
    found: &mut Meanings,
) {
    let schema = resolved(schema, definitions);
    let Some(properties) = schema["properties"].as_object() else {
        return;
    };
    for (key, property) in properties {
        let key = format!("{prefix}{key}");
        let text = property["description"].as_str().unwrap_or_default();
        let paragraph = text.split("\n\n").next().unwrap_or(text);
        // Links to Rust items become the items' names.
        let plain = paragraph.replace("[`", "`").replace("`]", "`");
        let meaning =
            asid_documents::guard::one_line(&format!("{plain} {}", choices(property, definitions)));
        if !meaning.is_empty() {
            found.insert(key.clone(), meaning);
        }
        describe(property, definitions, &format!("{key}."), found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settings with an inner table.
    #[derive(JsonSchema)]
    #[allow(dead_code)]
    struct Outer {
        /// Rounds of the search,
        /// at least 1.
        ///
        /// More are slower.
        rounds: usize,
        /// How it is refitted.
        inner: Inner,
        /// Which way.
        way: Way,
        /// Where it may be left out.
        maybe: Option<Inner>,
        unexplained: f64,
    }

    #[derive(JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    #[allow(dead_code)]
    enum Way {
        /// Up.
        Up,
        /// Down.
        DownHill,
    }

    #[derive(JsonSchema)]
    #[allow(dead_code)]
    struct Inner {
        /// Share of the best.
        elite: f64,
    }

    #[test]
    fn meanings_are_the_fields_documentation() {
        let found = meanings::<Outer>();
        let of = |key: &str| found.get(key).map(String::as_str);
        assert_eq!(of("rounds"), Some("Rounds of the search, at least 1."));
        assert_eq!(of("inner"), Some("How it is refitted."));
        assert_eq!(of("inner.elite"), Some("Share of the best."));
        assert_eq!(of("maybe.elite"), Some("Share of the best."));
        assert_eq!(of("way"), Some("Which way. One of up, down-hill."));
        assert_eq!(of("unexplained"), None);
    }
}
