//! Methods: an explorer, an identifier and a solver under one name.

use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

/// Name of the explorer or identifier of a method that has none.
pub const NONE: &str = "none";

/// Name of the identifier of the oracle, which knows the truth.
pub const TRUTH: &str = "truth";

/// A method; its rows have its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Method {
    /// Name in the tables.
    pub name: String,
    /// Explorer, or [`NONE`].
    pub explorer: String,
    /// Identifier, [`NONE`], or [`TRUTH`].
    pub identifier: String,
    /// Solver.
    pub solver: String,
}

/// Predefined methods: the paper's, and the oracle, which shows what a task allows.
pub const NAMED: [(&str, [&str; 3]); 8] = [
    ("asid", ["fisher-cem", "reps", "cem"]),
    ("asid-ppo", ["fisher-ppo", "reps", "cem"]),
    ("asid-estimator", ["fisher-ppo", "estimator", "cem"]),
    ("maxmi", ["maxmi", "estimator", "cem"]),
    ("max", ["max", "reps", "cem"]),
    ("random", ["random", "reps", "cem"]),
    ("dr", [NONE, NONE, "cem"]),
    (ORACLE, [NONE, TRUTH, "cem"]),
];

/// The method whose solver knows the truth.
pub const ORACLE: &str = "oracle";

/// Methods of a comparison that names none: those that need no network.
pub const BY_DEFAULT: [&str; 3] = ["asid", "random", "dr"];

impl Method {
    /// The predefined method of this name.
    ///
    /// # Errors
    /// When there is no method of this name.
    pub fn named(name: &str) -> Result<Self> {
        let found = NAMED.iter().find(|(n, _)| *n == name);
        let Some((name, [explorer, identifier, solver])) = found else {
            return Err(Error::unknown(
                "method",
                name,
                NAMED.iter().map(|(n, _)| *n),
            ));
        };
        Ok(Self {
            name: (*name).to_owned(),
            explorer: (*explorer).to_owned(),
            identifier: (*identifier).to_owned(),
            solver: (*solver).to_owned(),
        })
    }

    /// Parses a name of [`NAMED`], or `NAME=explorer+identifier+solver`.
    ///
    /// # Errors
    /// When it is neither, uses a predefined name for other parts, or gives no valid method.
    pub fn parse(text: &str) -> Result<Self> {
        let Some((name, parts)) = text.split_once('=') else {
            return Self::named(text);
        };
        let wrong = |message: String| {
            Err(Error::Config {
                key: format!("--method {text}"),
                message,
            })
        };
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if name.is_empty() || !name.chars().all(plain) {
            return wrong("a name is made of letters, digits, `-`, `_` and `.`".into());
        }
        let parts: Vec<&str> = parts.split('+').collect();
        let &[explorer, identifier, solver] = &*parts else {
            return wrong(format!(
                "is not NAME=explorer+identifier+solver; {NONE} stands for one that is left out"
            ));
        };
        let method = Self {
            name: name.to_owned(),
            explorer: explorer.to_owned(),
            identifier: identifier.to_owned(),
            solver: solver.to_owned(),
        };
        match Self::named(name) {
            Ok(own) if own == method => return Ok(own),
            Ok(own) => {
                return wrong(format!(
                    "`{name}` is the name of {}; choose another name",
                    own.parts()
                ));
            }
            Err(_) => {}
        }
        if parts.contains(&"") || solver == NONE {
            return wrong(
                "a method has a solver, and its explorer and identifier may be none".into(),
            );
        }
        if parts.contains(&TRUTH) {
            return wrong(format!("only `{ORACLE}` is told the truth"));
        }
        match (method.explores(), method.identifies()) {
            (false, true) => wrong(format!("`{identifier}` has no episode to identify from")),
            (true, false) => {
                wrong("an episode that nothing is identified from changes nothing".into())
            }
            _ => Ok(method),
        }
    }

    /// Whether it plays an exploration episode in the real world before the task.
    #[must_use]
    pub fn explores(&self) -> bool {
        self.explorer != NONE
    }

    /// Whether it identifies the unknowns.
    #[must_use]
    pub fn identifies(&self) -> bool {
        self.identifier != NONE && !self.knows_the_truth()
    }

    /// Whether it knows the truth.
    #[must_use]
    pub fn knows_the_truth(&self) -> bool {
        self.identifier == TRUTH
    }

    /// The parts as `explorer+identifier+solver`.
    #[must_use]
    pub fn parts(&self) -> String {
        format!("{}+{}+{}", self.explorer, self.identifier, self.solver)
    }
}

impl From<Method> for String {
    /// Writes the form that [`Method::parse`] reads.
    fn from(method: Method) -> Self {
        match Method::named(&method.name) {
            Ok(_) => method.name,
            Err(_) => format!("{}={}", method.name, method.parts()),
        }
    }
}

impl TryFrom<String> for Method {
    type Error = Error;

    fn try_from(text: String) -> Result<Self> {
        Self::parse(&text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_method_and_any_other_triple_reads_back() {
        for (name, parts) in NAMED {
            let method = Method::parse(name).unwrap();
            assert_eq!(method.parts(), parts.join("+"));
            assert_eq!(String::from(method), name);
        }
        let mine = Method::parse("mine=random+cem+cem").unwrap();
        assert!(mine.explores() && mine.identifies() && !mine.knows_the_truth());
        assert_eq!(Method::parse(&String::from(mine.clone())).unwrap(), mine);
        let plain = Method::parse("prior=none+none+ppo").unwrap();
        assert!(!plain.explores() && !plain.identifies());
    }

    #[test]
    fn a_name_stands_for_one_triple_and_only_the_oracle_is_told_the_truth() {
        let refused = |text: &str| Method::parse(text).unwrap_err().to_string();
        assert!(refused("asid=random+reps+cem").contains("fisher-cem+reps+cem"));
        assert!(refused("x=none+truth+cem").contains("only `oracle`"));
        assert!(refused("x=none+reps+cem").contains("no episode"));
        assert!(refused("x=random+reps").contains("NAME=explorer+identifier+solver"));
        assert!(refused("asdi").contains("asid"));
        assert!(refused("a b=random+reps+cem").contains("letters"));
    }
}
