//! Message definitions of ROS 2, as recordings hold them.
//!
//! A definition is the text of a `.msg` file, followed by those of all types that it names. A line
//! of 80 `=` and a line `MSG: package/Type` precede each further one ([MCAP:
//! ros2msg](https://mcap.dev/spec/registry#ros2msg)). Bags of Humble and before hold no
//! definitions: `COMMON` has those of the common messages.

use std::collections::HashMap;

/// Definitions of the messages that robots usually log, without comments and defaults.
///
/// From common_interfaces, rcl_interfaces and control_msgs of ROS 2; Apache License 2.0.
const COMMON: &str = include_str!("common.msg");

/// Deepest nesting of records: those of ROS have at most six levels.
const DEEPEST: usize = 24;
/// Most records in one definition: the largest of ROS have about thirty.
const MOST_RECORDS: usize = 512;

/// A number or text, by its encoding in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    /// One byte, 0 or 1.
    Bool,
    /// Signed integer of this many bytes.
    Signed(usize),
    /// Unsigned integer of this many bytes.
    Unsigned(usize),
    /// Floating-point number of this many bytes.
    Float(usize),
    /// UTF-8 after its length, with a terminating zero.
    Text,
    /// UTF-16 after its length.
    WideText,
}

impl Primitive {
    /// Size in bytes, at least 1; for a text, the size of its length.
    #[must_use]
    pub fn size(self) -> usize {
        match self {
            Self::Bool => 1,
            Self::Signed(n) | Self::Unsigned(n) | Self::Float(n) => n,
            Self::Text | Self::WideText => 4,
        }
    }

    fn named(name: &str) -> Option<Self> {
        // Bounds of texts (`string<=10`) do not change the encoding.
        let name = name.split("<=").next().unwrap_or(name);
        Some(match name {
            "bool" => Self::Bool,
            "byte" | "char" | "uint8" => Self::Unsigned(1),
            "int8" => Self::Signed(1),
            "int16" => Self::Signed(2),
            "uint16" => Self::Unsigned(2),
            "int32" => Self::Signed(4),
            "uint32" => Self::Unsigned(4),
            "int64" => Self::Signed(8),
            "uint64" => Self::Unsigned(8),
            "float32" => Self::Float(4),
            "float64" => Self::Float(8),
            "string" => Self::Text,
            "wstring" => Self::WideText,
            _ => return None,
        })
    }
}

/// Type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number or text.
    Primitive(Primitive),
    /// A record, by index in [`Definition::records`].
    Record(usize),
}

/// Number of values in a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// One.
    One,
    /// A fixed number that the type states, at least 1.
    Fixed(usize),
    /// A number that the message states.
    Counted,
}

/// A field of a record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name.
    pub name: String,
    /// Its type.
    pub kind: Kind,
    /// Its number of values.
    pub count: Count,
}

/// A message type with all types that it contains.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Definition {
    /// Fields of each record; the first record is the message itself.
    pub records: Vec<Vec<Field>>,
}

/// Fields as written: type and name.
type Written<'a> = Vec<(&'a str, &'a str)>;

impl Definition {
    /// Parses the definition of the message type `name` (`package/msg/Type`) from a recording's
    /// text.
    ///
    /// An empty text stands for the common definition of that name.
    ///
    /// # Errors
    /// When a type is not defined, or contains itself; the message names it.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        let mut texts = written(COMMON, "");
        if text.trim().is_empty() {
            if !texts.contains_key(&canonical(name, "")) {
                return Err(format!(
                    "the definition of `{name}` is not in the recording"
                ));
            }
        } else {
            texts.extend(written(text, name));
        }
        let mut reader = Resolver {
            texts: &texts,
            places: HashMap::new(),
            definition: Self::default(),
        };
        reader.record(&canonical(name, ""), 0)?;
        Ok(reader.definition)
    }
}

/// The form `package/Type` of any spelling; a bare type belongs to `package`.
fn canonical(name: &str, package: &str) -> String {
    let parts: Vec<&str> = name.split('/').collect();
    match parts[..] {
        ["Header"] => "std_msgs/Header".to_owned(),
        ["time"] => "builtin_interfaces/Time".to_owned(),
        ["duration"] => "builtin_interfaces/Duration".to_owned(),
        [bare] => format!("{package}/{bare}"),
        [first, .., last] => format!("{first}/{last}"),
        [] => String::new(),
    }
}

/// The definitions in a text, by canonical name; the first belongs to `root`.
fn written<'a>(text: &'a str, root: &str) -> HashMap<String, Written<'a>> {
    let mut found = HashMap::new();
    let mut own = canonical(root, "");
    let mut fields = Vec::new();
    for line in text.lines() {
        if let Some(next) = line.trim().strip_prefix("MSG:") {
            found.insert(
                std::mem::replace(&mut own, canonical(next.trim(), "")),
                fields,
            );
            fields = Vec::new();
            continue;
        }
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_whitespace();
        let (Some(kind), Some(name)) = (words.next(), words.next()) else {
            continue;
        };
        // `TYPE NAME=VALUE` is a constant, in any spacing; text after a field's name is its
        // default.
        let constant = name.contains('=') || words.next().is_some_and(|w| w.starts_with('='));
        if !constant {
            fields.push((kind, name));
        }
    }
    found.insert(own, fields);
    found
}

struct Resolver<'a> {
    texts: &'a HashMap<String, Written<'a>>,
    /// Index of each record; `None` while its fields are being read.
    places: HashMap<String, Option<usize>>,
    definition: Definition,
}

impl Resolver<'_> {
    fn record(&mut self, name: &str, depth: usize) -> Result<usize, String> {
        match self.places.get(name) {
            Some(Some(place)) => return Ok(*place),
            Some(None) => return Err(format!("type `{name}` contains itself")),
            None => {}
        }
        let place = self.definition.records.len();
        if depth > DEEPEST || place >= MOST_RECORDS {
            return Err(format!("type `{name}` is nested too deeply"));
        }
        let fields = self.texts.get(name);
        let fields = fields.ok_or_else(|| format!("type `{name}` is not defined"))?;
        self.places.insert(name.to_owned(), None);
        self.definition.records.push(Vec::new());
        let package = name.split('/').next().unwrap_or_default();
        for (kind, field) in fields {
            let (bare, count) = counted(kind)?;
            let kind = match Primitive::named(bare) {
                Some(primitive) => Kind::Primitive(primitive),
                None => Kind::Record(self.record(&canonical(bare, package), depth + 1)?),
            };
            self.definition.records[place].push(Field {
                name: (*field).to_owned(),
                kind,
                count,
            });
        }
        // A record without fields takes one byte.
        if self.definition.records[place].is_empty() {
            self.definition.records[place].push(Field {
                name: "structure_needs_at_least_one_member".into(),
                kind: Kind::Primitive(Primitive::Unsigned(1)),
                count: Count::One,
            });
        }
        self.places.insert(name.to_owned(), Some(place));
        Ok(place)
    }
}

/// Splits a type into the type without brackets and the count in them.
fn counted(kind: &str) -> Result<(&str, Count), String> {
    let Some((bare, rest)) = kind.split_once('[') else {
        return Ok((kind, Count::One));
    };
    let inside = rest.trim_end_matches(']');
    if inside.is_empty() || inside.starts_with("<=") {
        return Ok((bare, Count::Counted));
    }
    match inside.parse() {
        Ok(n) if n > 0 => Ok((bare, Count::Fixed(n))),
        _ => Err(format!("`{kind}` is no type")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_common_definition_resolves() {
        for name in written(COMMON, "")
            .keys()
            .filter(|n| n.contains('/') && n.len() > 1)
        {
            Definition::parse(name, "").unwrap_or_else(|e| panic!("{name}: {e}"));
        }
        let joints = Definition::parse("sensor_msgs/msg/JointState", "").unwrap();
        let names: Vec<&str> = joints.records[0].iter().map(|f| &*f.name).collect();
        assert_eq!(names, ["header", "name", "position", "velocity", "effort"]);
    }

    #[test]
    fn a_definition_of_the_recording_wins_over_the_common_one() {
        let text = "# a comment\nuint8 OK=0\nstring<=8 WORD = \"x # y\"\nHeader header\nfloat64[<=3] position 1.0 # default\nInner[2] parts\n\
                    ================================================================================\n\
                    MSG: sensor_msgs/Inner\nint16 a\n";
        let definition = Definition::parse("sensor_msgs/msg/JointState", text).unwrap();
        let own = &definition.records[0];
        assert_eq!(own.len(), 3);
        assert_eq!(own[1].count, Count::Counted);
        assert_eq!(own[2].count, Count::Fixed(2));
        assert_eq!(own[1].name, "position");
    }

    #[test]
    fn what_contains_itself_or_is_not_there_is_refused() {
        for (text, said) in [
            ("Own a\n====\nMSG: p/Own\nOwn b", "contains itself"),
            ("q/Other a", "`q/Other` is not defined"),
            ("int8[0] a", "is no type"),
        ] {
            let error = Definition::parse("p/msg/T", text).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
        let deep: String = (0..400)
            .map(|i| format!("T{} a\n====\nMSG: p/T{}\n", i + 1, i + 1))
            .collect();
        assert!(Definition::parse("p/T0", &(deep + "int8 a")).is_err());
    }
}
