//! All topics of a recording, in any kind of file.

use std::collections::BTreeMap;

use serde_json::Value as Json;

use super::cdr::{LONGEST_LIST, Value, decode};
use super::definition::Definition;
use super::stream::Stream;
use crate::raw::RawLog;

/// Deepest nesting of a JSON message that is read; deeper values are not readings.
const DEEPEST: usize = 24;

/// How the messages of a topic are read.
#[derive(Debug)]
enum Reading {
    /// As CDR, with a definition.
    Cdr(Definition),
    /// As JSON.
    Json,
    /// Not at all; the reason.
    Not(String),
}

/// A topic.
#[derive(Debug)]
struct Topic {
    reading: Reading,
    stream: Stream,
    /// Number of messages that could not be decoded, and the fault of the first.
    spoilt: usize,
    fault: String,
    messages: usize,
}

/// The topics of a recording while it is read.
#[derive(Debug)]
pub struct Topics {
    /// Topics to read; all if empty.
    chosen: Vec<String>,
    found: BTreeMap<String, Topic>,
}

/// How a file describes a topic.
#[derive(Clone, Copy, Debug)]
pub struct Described<'a> {
    /// Name of the message type.
    pub kind: &'a str,
    /// Encoding of the messages, such as `cdr`.
    pub encoding: &'a str,
    /// Encoding of the definition, such as `ros2msg`; empty where there is none.
    pub schema: &'a str,
    /// The definition's text.
    pub text: &'a [u8],
}

impl Topics {
    /// Reads the topics `chosen`, or all if it is empty.
    #[must_use]
    pub fn new(chosen: &[String]) -> Self {
        Self {
            chosen: chosen.to_vec(),
            found: BTreeMap::new(),
        }
    }

    /// Whether a topic is to be read.
    #[must_use]
    pub fn wants(&self, topic: &str) -> bool {
        self.chosen.is_empty() || self.chosen.iter().any(|t| t == topic)
    }

    /// Adds a message of a topic, recorded at a time, ns.
    pub fn push(&mut self, topic: &str, described: Described<'_>, recorded: i64, data: &[u8]) {
        if !self.wants(topic) {
            return;
        }
        if !self.found.contains_key(topic) {
            let new = Topic {
                reading: Reading::of(described),
                stream: Stream::default(),
                spoilt: 0,
                fault: String::new(),
                messages: 0,
            };
            self.found.insert(topic.to_owned(), new);
        }
        let Some(found) = self.found.get_mut(topic) else {
            return;
        };
        found.messages += 1;
        let value = match &found.reading {
            Reading::Not(_) => return,
            Reading::Cdr(definition) => decode(definition, data),
            Reading::Json => {
                let json = serde_json::from_slice::<Json>(data).map_err(|e| e.to_string());
                json.map(|json| of_json(json, 0))
            }
        };
        match value {
            Ok(value) => found.stream.push(topic, recorded, &value),
            Err(fault) => {
                if found.spoilt == 0 {
                    found.fault = fault;
                }
                found.spoilt += 1;
            }
        }
    }

    /// The complete log.
    ///
    /// # Errors
    /// When a chosen topic is missing, or none of its messages can be read.
    pub fn finish(self, name: &str) -> Result<RawLog, String> {
        for chosen in &self.chosen {
            if !self.found.contains_key(chosen) {
                return Err(format!("has no messages of topic `{chosen}`"));
            }
        }
        let start = self.found.values().filter_map(|t| t.stream.first()).min();
        let start = start.unwrap_or(0);
        let mut log = RawLog {
            name: name.to_owned(),
            ..RawLog::default()
        };
        for (name, topic) in self.found {
            let (said, useless) = match topic.reading {
                Reading::Not(why) => (Some(format!("{name}: passed over, {why}")), true),
                _ if topic.spoilt > 0 => {
                    let (n, of, fault) = (topic.spoilt, topic.messages, topic.fault);
                    let said = format!("{name}: {n} of {of} messages cannot be read: {fault}");
                    (Some(said), n == of)
                }
                _ => (None, false),
            };
            if let (Some(said), true, false) = (&said, useless, self.chosen.is_empty()) {
                return Err(said.clone());
            }
            log.remarks.extend(said);
            let (series, remark) = topic.stream.series(&name, start);
            log.series.extend(series);
            log.remarks.extend(remark);
        }
        Ok(log)
    }
}

impl Reading {
    fn of(described: Described<'_>) -> Self {
        match (described.encoding, described.schema) {
            ("cdr", "ros2msg" | "") => {
                let text = String::from_utf8_lossy(described.text);
                match Definition::parse(described.kind, &text) {
                    Ok(definition) => Self::Cdr(definition),
                    Err(why) => Self::Not(why),
                }
            }
            ("json", _) => Self::Json,
            ("cdr", schema) => Self::Not(format!("its definition is `{schema}`, not ros2msg")),
            (encoding, _) => Self::Not(format!(
                "its messages are `{encoding}`; cdr and json are read"
            )),
        }
    }
}

/// Converts a JSON message; `true` becomes 1.
fn of_json(json: Json, depth: usize) -> Value {
    if depth > DEEPEST {
        return Value::Skipped;
    }
    match json {
        Json::Null => Value::Skipped,
        Json::Bool(x) => Value::Number(f64::from(u8::from(x))),
        Json::Number(x) => x.as_f64().map_or(Value::Skipped, Value::Number),
        Json::String(text) => Value::Text(text),
        Json::Array(entries) if entries.len() > LONGEST_LIST => Value::Skipped,
        Json::Array(entries) => {
            let entries = entries.into_iter().map(|e| of_json(e, depth + 1));
            Value::List(entries.collect())
        }
        Json::Object(fields) => {
            let fields = fields.into_iter();
            Value::Record(fields.map(|(n, v)| (n, of_json(v, depth + 1))).collect())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A topic whose messages are JSON.
    const JSON: Described<'static> = Described {
        kind: "any",
        encoding: "json",
        schema: "jsonschema",
        text: b"",
    };

    #[test]
    fn what_cannot_be_read_is_said_and_the_rest_is_read() {
        let mut topics = Topics::new(&[]);
        let protobuf = Described {
            encoding: "protobuf",
            ..JSON
        };
        topics.push("/a", JSON, 5, br#"{"x": 1.5, "on": true, "parts": [1, 2]}"#);
        topics.push("/a", JSON, 6, b"{");
        topics.push("/b", protobuf, 5, b"");
        let log = topics.finish("log").unwrap();
        let names: Vec<&str> = log.series.iter().map(|s| &*s.name).collect();
        assert_eq!(names, ["/a.on", "/a.parts.0", "/a.parts.1", "/a.x"]);
        assert_eq!(log.remarks.len(), 2, "{:?}", log.remarks);
        assert!(log.remarks[0].contains("1 of 2 messages"));
    }

    #[test]
    fn a_long_list_is_no_reading_in_json_either() {
        let mut topics = Topics::new(&[]);
        let ranges = vec!["1.5"; LONGEST_LIST + 1].join(",");
        let message = format!(r#"{{"ranges": [{ranges}], "x": 1}}"#);
        topics.push("/scan", JSON, 5, message.as_bytes());
        let log = topics.finish("log").unwrap();
        assert_eq!(log.series.len(), 1);
    }

    #[test]
    fn a_chosen_topic_must_be_there() {
        let error = Topics::new(&["/joint_states".into()])
            .finish("log")
            .unwrap_err();
        assert!(error.contains("`/joint_states`"));
    }
}
