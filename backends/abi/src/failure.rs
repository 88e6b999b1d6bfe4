//! Errors across the ABI: a code, a subject and a message.

use std::path::Path;

use asid_core::{Error, Result};

use crate::table::{self, Code};
use crate::text;

impl table::Error {
    /// An error without content.
    #[must_use]
    pub fn empty() -> Self {
        Self {
            subject: [0; 256],
            message: [0; 1024],
        }
    }
}

/// Writes an error for the other side and returns its code.
pub fn encode(error: &Error, into: &mut table::Error) -> Code {
    let (code, subject, message) = match error {
        Error::Scene { scene, message } => (table::SCENE, scene.as_str(), message.clone()),
        Error::Parameter { parameter, message } => {
            (table::PARAMETER, parameter.as_str(), message.clone())
        }
        Error::UnknownName { name, .. } => (table::PARAMETER, name.as_str(), error.to_string()),
        Error::Config { key, message } => (table::CONFIG, key.as_str(), message.clone()),
        Error::Incapable { backend, what } => (table::INCAPABLE, backend.as_str(), what.clone()),
        Error::Missing { what, message } => (table::MISSING, what.as_str(), message.clone()),
        Error::Shape(message) => (table::SHAPE, "", message.clone()),
        other => (table::FAILED, "", other.to_string()),
    };
    text::into_buffer(subject, &mut into.subject);
    text::into_buffer(&message, &mut into.message);
    code
}

/// Turns the code of a call into a result.
///
/// `path` is the plugin's file and `call` the function's name in the table. `subject` is what the
/// call was about, where the plugin does not say.
///
/// # Errors
/// The plugin's own error, of the kind given by its code, naming the file.
pub fn decode(
    code: Code,
    error: &table::Error,
    call: &str,
    subject: &str,
    path: &Path,
) -> Result<()> {
    if code == table::OK {
        return Ok(());
    }
    let said = text::from_buffer(&error.message);
    let said = if said.is_empty() {
        format!("failed with code {code} and said nothing")
    } else {
        said
    };
    let theirs = text::from_buffer(&error.subject);
    let about = if theirs.is_empty() {
        subject.to_owned()
    } else {
        theirs
    };
    let signed = format!("{said} (plugin {})", path.display());
    Err(match code {
        table::SCENE => Error::Scene {
            scene: about,
            message: signed,
        },
        table::PARAMETER => Error::Parameter {
            parameter: about,
            message: signed,
        },
        table::CONFIG => Error::Config {
            key: about,
            message: signed,
        },
        table::INCAPABLE => Error::Incapable {
            backend: about,
            what: signed,
        },
        table::SHAPE => Error::Shape(signed),
        table::MISSING => Error::Missing {
            what: about,
            message: signed,
        },
        table::PANIC => broken(path, call, &format!("panicked: {said}")),
        _ => broken(path, call, &said),
    })
}

/// An error caused by the plugin itself, in a call.
#[must_use]
pub fn broken(path: &Path, call: &str, what: &str) -> Error {
    Error::Plugin {
        path: path.to_path_buf(),
        message: format!("{call}: {what}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn round_trip(error: &Error) -> String {
        let mut buffer = table::Error::empty();
        let code = encode(error, &mut buffer);
        decode(code, &buffer, "load", "scene.xml", Path::new("lib.so"))
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn kinds_of_errors_survive_and_name_the_file() {
        for (error, text) in [
            (
                Error::Scene {
                    scene: "arm".into(),
                    message: "no tendons".into(),
                },
                "scene arm: no tendons (plugin lib.so)",
            ),
            (
                Error::Shape("qpos has 1".into()),
                "qpos has 1 (plugin lib.so)",
            ),
            (
                Error::Failed("no memory".into()),
                "plugin lib.so: load: no memory",
            ),
        ] {
            assert_eq!(round_trip(&error), text);
        }
    }

    #[test]
    fn silence_is_worded() {
        let error = decode(7, &table::Error::empty(), "reset", "", Path::new("lib.so"));
        assert_eq!(
            error.unwrap_err().to_string(),
            "plugin lib.so: reset: failed with code 7 and said nothing"
        );
    }
}
