//! Generates Python dataclasses from JSON schemas.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use schemars::Schema;
use serde_json::{Map, Value};

/// Beginning of the file.
const HEAD: &str = "\
\"\"\"What the program writes as ``result.json``, as dataclasses.

Generated from the program's own types: ``ASID_WRITE=1 cargo test --test python_types`` in the repository.
A number that was not finite is NaN; a field that may be missing is ``None`` then.
\"\"\"

# Lines are as long as the sentences of the program's own documentation.
# ruff: noqa: E501

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from asid.records import Record, Result

#: Numbers, in as many dimensions as the field has.
Array = NDArray[np.float64]
";

/// Attributes of every result besides its fields.
const TAKEN: [&str; 6] = ["folder", "frame", "from_json", "log", "read", "report"];

/// Generated classes and kinds, by name.
#[derive(Default)]
pub struct Generator {
    /// Name and text of each class, in the order of the results.
    classes: Vec<(String, String)>,
    /// Names of kinds: sets of texts, one of which is given.
    kinds: BTreeMap<String, String>,
}

impl Generator {
    /// Adds the classes of a result.
    pub fn add(&mut self, schema: &Schema) {
        let root = schema.as_object().expect("a result is an object");
        let empty = Map::new();
        let parts = root.get("$defs").and_then(Value::as_object);
        for (name, part) in parts.unwrap_or(&empty) {
            let part = part.as_object().expect("a type");
            if let Some(choice) = choice(part) {
                self.kinds.insert(name.clone(), choice);
            } else {
                self.class(name, part, "Record");
            }
        }
        let title = root["title"].as_str().expect("a result has a name");
        self.class(title, root, "Result");
    }

    /// Returns the whole file.
    pub fn text(&self) -> String {
        let mut text = HEAD.to_owned();
        for (name, choice) in &self.kinds {
            let _ = write!(text, "\n{name} = {choice}\n");
        }
        for (_, class) in &self.classes {
            let _ = write!(text, "\n\n{class}");
        }
        text
    }

    fn class(&mut self, name: &str, schema: &Map<String, Value>, base: &str) {
        let mut text =
            format!("@dataclasses.dataclass(frozen=True, eq=False)\nclass {name}({base}):\n");
        let about = described(schema).unwrap_or_else(|| format!("{name}."));
        let _ = writeln!(text, "    \"\"\"{about}\"\"\"\n");
        let required: Vec<&str> = schema
            .get("required")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .filter_map(Value::as_str)
            .collect();
        let properties = schema["properties"]
            .as_object()
            .expect("a class has fields");
        // Optional fields come after required ones, as Python demands.
        let (given, optional): (Vec<_>, Vec<_>) = properties
            .iter()
            .partition(|(name, _)| required.contains(&name.as_str()));
        for (name, field) in given {
            assert!(!TAKEN.contains(&name.as_str()), "a result has a `{name}`");
            let _ = writeln!(text, "    {name}: {}", hint(field));
            documented(&mut text, field);
        }
        for (name, field) in optional {
            let hint = hint(field);
            let missing = if hint.starts_with("list[") {
                format!("{hint} = dataclasses.field(default_factory=list)")
            } else if hint == "bool" {
                "bool = False".to_owned()
            } else if hint.ends_with("| None") {
                format!("{hint} = None")
            } else {
                format!("{hint} | None = None")
            };
            let _ = writeln!(text, "    {name}: {missing}");
            documented(&mut text, field);
        }
        match self.classes.iter().find(|(n, _)| n == name) {
            Some((_, known)) => assert_eq!(known, &text, "two types have the name {name}"),
            None => self.classes.push((name.to_owned(), text)),
        }
    }
}

fn described(schema: &Map<String, Value>) -> Option<String> {
    let text = schema.get("description")?.as_str()?;
    Some(text.split_whitespace().collect::<Vec<_>>().join(" "))
}

fn documented(text: &mut String, field: &Value) {
    if let Some(about) = field.as_object().and_then(described) {
        let _ = writeln!(text, "    \"\"\"{about}\"\"\"");
    }
}

/// Returns the type of a value that is one of several texts; `None` for other types.
fn choice(schema: &Map<String, Value>) -> Option<String> {
    let texts: Vec<&str> = match (schema.get("enum"), schema.get("oneOf")) {
        (Some(all), _) => all.as_array()?.iter().filter_map(Value::as_str).collect(),
        (_, Some(all)) => (all.as_array()?.iter())
            .filter_map(|one| one.get("const").and_then(Value::as_str))
            .collect(),
        _ => return None,
    };
    let quoted: Vec<String> = texts.iter().map(|t| format!("\"{t}\"")).collect();
    Some(format!("Literal[{}]", quoted.join(", ")))
}

/// The type of a field.
fn hint(schema: &Value) -> String {
    let Some(schema) = schema.as_object() else {
        return "Any".to_owned();
    };
    if let Some(name) = schema.get("$ref").and_then(Value::as_str) {
        return name.rsplit('/').next().unwrap_or(name).to_owned();
    }
    if let Some(all) = schema.get("anyOf").and_then(Value::as_array) {
        let some: Vec<&Value> = all.iter().filter(|s| s["type"] != "null").collect();
        assert_eq!(some.len(), 1, "{schema:?}");
        return format!("{} | None", hint(some[0]));
    }
    match schema.get("type") {
        Some(Value::Array(types)) => {
            let some = types.iter().find(|t| *t != "null").expect("a type");
            let mut one = schema.clone();
            one.insert("type".to_owned(), some.clone());
            format!("{} | None", hint(&Value::Object(one)))
        }
        Some(Value::String(name)) => named(name, schema),
        _ => "Any".to_owned(),
    }
}

fn named(name: &str, schema: &Map<String, Value>) -> String {
    match name {
        "number" => "float".to_owned(),
        "integer" => "int".to_owned(),
        "boolean" => "bool".to_owned(),
        "string" => "str".to_owned(),
        "array" => {
            if let Some(parts) = schema.get("prefixItems").and_then(Value::as_array) {
                let parts: Vec<String> = parts.iter().map(hint).collect();
                return format!("tuple[{}]", parts.join(", "));
            }
            match schema.get("items").map(hint).as_deref() {
                // Arrays of numbers, and of rows of numbers.
                Some("float" | "Array") => "Array".to_owned(),
                Some(item) => format!("list[{item}]"),
                None => "list[Any]".to_owned(),
            }
        }
        "object" => match schema.get("additionalProperties") {
            Some(value @ Value::Object(_)) => format!("dict[str, {}]", hint(value)),
            _ => "dict[str, Any]".to_owned(),
        },
        other => unreachable!("no type of Python for {other}"),
    }
}
