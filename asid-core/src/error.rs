//! The one error type of the libraries: what was wrong, where, and what to do.

use std::path::PathBuf;

/// Result of this crate's functions.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong, worded so that a user can act on it.
///
/// The message is one line. [`Error::is_usage`] distinguishes a wrong call (exit status 2) from
/// failed work (exit status 1).
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A name that no registered item has.
    #[error("unknown {kind} `{name}`{}", suggestion(.kind, .near, *.all))]
    UnknownName {
        /// The kind of thing that was looked up, such as `task`.
        kind: &'static str,
        /// The requested name.
        name: String,
        /// Similar names, nearest first; all names where none is similar.
        near: Vec<String>,
        /// Whether `near` holds all existing names.
        all: bool,
    },
    /// A scene that cannot be read or that an engine refuses.
    #[error("scene {scene}: {message}")]
    Scene {
        /// Name or path of the scene.
        scene: String,
        /// What is wrong and where in it.
        message: String,
    },
    /// A parameter target or its values that make no sense in this scene.
    #[error("parameter `{parameter}`: {message}")]
    Parameter {
        /// Name or target of the parameter.
        parameter: String,
        /// What is wrong.
        message: String,
    },
    /// A configuration value outside its domain.
    #[error("config {key}: {message}")]
    Config {
        /// The key, dotted.
        key: String,
        /// What is wrong and what is allowed.
        message: String,
    },
    /// A log that cannot be used.
    #[error("log {}: {message}", .path.display())]
    Log {
        /// File of the log.
        path: PathBuf,
        /// What is wrong, with row and column where known.
        message: String,
    },
    /// A plugin that cannot be used.
    #[error("plugin {}: {message}", .path.display())]
    Plugin {
        /// File of the plugin.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        message: String,
    },
    /// An engine or library that is not there.
    #[error("{what} is not available: {message}")]
    Missing {
        /// What is missing.
        what: String,
        /// Why, and how to get it.
        message: String,
    },
    /// A request that the engine cannot fulfil.
    #[error("backend `{backend}` cannot {what}")]
    Incapable {
        /// The engine.
        backend: String,
        /// What it cannot do.
        what: String,
    },
    /// A file could not be read or written.
    #[error("{}: {message}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What happened.
        message: String,
    },
    /// Work that had begun failed.
    #[error("{0}")]
    Failed(String),
    /// Arrays or indices from a caller of the library that do not fit.
    #[error("{0}")]
    Shape(String),
    /// The user interrupted the work.
    #[error("interrupted")]
    Interrupted,
}

impl Error {
    /// Whether the call was wrong rather than the work.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        !matches!(self, Self::Failed(_) | Self::Shape(_) | Self::Interrupted)
    }

    /// Whether something lacks that no run can do without: a registered item, a part of the build, an
    /// ability of the engine, or a plugin. Whatever else differs between runs, all of them fail.
    #[must_use]
    pub fn is_lack(&self) -> bool {
        matches!(
            self,
            Self::UnknownName { .. }
                | Self::Missing { .. }
                | Self::Incapable { .. }
                | Self::Plugin { .. }
        )
    }

    /// An error of kind [`Error::UnknownName`], with similar names.
    #[must_use]
    pub fn unknown<'a>(
        kind: &'static str,
        name: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) -> Self {
        let known: Vec<&str> = known.into_iter().collect();
        let near = near_names(name, &known);
        Self::UnknownName {
            kind,
            name: name.to_owned(),
            all: near.len() == known.len(),
            near,
        }
    }

    /// The nearest name among `known` within an edit distance of a third of its letters; a
    /// reordering of letters counts as one edit.
    #[must_use]
    pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
        let name = name.to_lowercase();
        let letters = |s: &str| {
            let mut letters: Vec<char> = s.chars().collect();
            letters.sort_unstable();
            letters
        };
        let distances = known.into_iter().map(|k| {
            let other = k.to_lowercase();
            let edits = edit_distance(&name, &other);
            let reordered = edits == 2 && letters(&name) == letters(&other);
            (if reordered { 1 } else { edits }, k)
        });
        let near = distances.filter(|(d, k)| 3 * d <= k.len().max(name.len()));
        near.min().map(|(_, k)| k.to_owned())
    }
}

/// Kinds whose names `asid list` shows completely.
const LISTED: [&str; 6] = [
    "task",
    "explorer",
    "identifier",
    "solver",
    "backend",
    "effect",
];

/// Text that suggests the similar names, or lists what there is.
fn suggestion(kind: &str, near: &[String], all: bool) -> String {
    let quoted: Vec<String> = near.iter().map(|n| format!("`{n}`")).collect();
    match &*quoted {
        [] => String::new(),
        [one] => format!("; did you mean {one}?"),
        many if all => {
            // What is listed may be a plugin's, and is unknown where that is not loaded.
            let more = if LISTED.contains(&kind) {
                "; one of a plugin takes --plugin FILE"
            } else {
                ""
            };
            format!("; known: {}{more}", many.join(", "))
        }
        [first @ .., last] => {
            let rest = if LISTED.contains(&kind) {
                " (`asid list` has all)"
            } else {
                ""
            };
            format!("; did you mean {} or {last}?{rest}", first.join(", "))
        }
    }
}

/// Names that contain `name` or whose edit distance is within a third of their length, nearest
/// first; all of `known` where none is near.
fn near_names(name: &str, known: &[&str]) -> Vec<String> {
    let mut near: Vec<(usize, &str)> = known
        .iter()
        .filter_map(|&k| {
            let distance = edit_distance(name, k);
            let close = distance <= k.len().max(name.len()) / 3;
            let part = name.len() >= 2 && (k.contains(name) || name.contains(k));
            (close || part).then_some((distance, k))
        })
        .collect();
    near.sort();
    if near.is_empty() {
        return known.iter().map(|&k| k.to_owned()).collect();
    }
    near.into_iter().map(|(_, k)| k.to_owned()).collect()
}

/// Levenshtein distance in characters.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, &cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// Prefix of every text that blames a plugin.
pub const BLAMES_PLUGIN: &str = "plugin ";

/// Whether the text of an error or panic blames a plugin and names its file.
#[must_use]
pub fn blames_a_plugin(text: &str) -> bool {
    text.starts_with(BLAMES_PLUGIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_typo_names_its_neighbour() {
        let error = Error::unknown("task", "rod-balancin", ["rod-balancing", "shuffleboard"]);
        assert_eq!(
            error.to_string(),
            "unknown task `rod-balancin`; did you mean `rod-balancing`?"
        );
        assert!(error.is_usage());
    }

    #[test]
    fn names_that_come_close_are_not_said_to_be_all() {
        let known = ["fisher-cem", "fisher-ppo", "random"];
        let error = Error::unknown("explorer", "fisher", known);
        assert_eq!(
            error.to_string(),
            "unknown explorer `fisher`; did you mean `fisher-cem` or `fisher-ppo`? (`asid list` has all)"
        );
        let error = Error::unknown("sensor", "tip", ["tip.0", "tip.1", "tip.2", "elbow"]);
        assert_eq!(
            error.to_string(),
            "unknown sensor `tip`; did you mean `tip.0`, `tip.1` or `tip.2`?"
        );
    }

    #[test]
    fn a_wild_guess_lists_everything() {
        let error = Error::unknown("backend", "zzz", ["mujoco", "rapier"]);
        assert_eq!(
            error.to_string(),
            "unknown backend `zzz`; known: `mujoco`, `rapier`; one of a plugin takes --plugin FILE"
        );
    }

    #[test]
    fn edit_distance_counts_edits() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("reps", "reps"), 0);
    }
}
