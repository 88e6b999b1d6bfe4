//! How hard a task is: numbers of a task that can be set.
//!
//! A task that every method solves, or none, does not distinguish methods. Each task therefore
//! names the numbers that make it easier or harder: the size of its goal, the noise and the rate of
//! its trackers, the speed of the hand. A value applies everywhere: to the real world, the method's
//! simulator, and the rule of success.

use std::collections::BTreeMap;

use crate::error::{Error, Result};

/// Names of the presets: the task's own values, and those of the paper or its published code.
pub const PRESETS: [&str; 2] = ["default", "published"];

/// One number that determines how hard a task is.
#[derive(Clone, Debug, PartialEq)]
pub struct Difficulty {
    /// Name in `difficulty.NAME`.
    pub name: String,
    /// SI unit; may be empty.
    pub unit: String,
    /// One-line description.
    pub about: String,
    /// The task's own value.
    pub default: f64,
    /// Value in the paper or its published code, if any.
    pub published: Option<f64>,
    /// Smallest and largest value that the task can be set to.
    pub range: [f64; 2],
}

impl Difficulty {
    /// A number of this name, unit, default and range, without a published value.
    #[must_use]
    pub fn new(name: &str, unit: &str, default: f64, range: [f64; 2], about: &str) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            about: about.into(),
            default,
            published: None,
            range,
        }
    }

    /// The same with a value from the paper or its published code.
    #[must_use]
    pub fn published(self, value: f64) -> Self {
        Self {
            published: Some(value),
            ..self
        }
    }

    /// Checks that the task can be set to a value.
    ///
    /// # Errors
    /// [`Error::Config`] naming `difficulty.NAME` and the range.
    pub fn check(&self, value: f64) -> Result<()> {
        let [low, high] = self.range;
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let unit = if self.unit.is_empty() {
            String::new()
        } else {
            format!(" {}", self.unit)
        };
        Err(Error::Config {
            key: format!("difficulty.{}", self.name),
            message: format!("{value} is out of range, {low} to {high}{unit}"),
        })
    }
}

/// A value for each difficulty of a task.
#[derive(Clone, Debug, PartialEq)]
pub struct Levels {
    all: Vec<Difficulty>,
    values: Vec<f64>,
}

impl Levels {
    /// The defaults.
    #[must_use]
    pub fn new(all: Vec<Difficulty>) -> Self {
        let values = all.iter().map(|d| d.default).collect();
        Self { all, values }
    }

    /// The values of a preset. A difficulty without a published value takes its default.
    ///
    /// # Errors
    /// When there is no such preset; the message lists them.
    pub fn preset(all: Vec<Difficulty>, name: &str) -> Result<Self> {
        let mut levels = Self::new(all);
        match name {
            "default" => {}
            "published" => {
                for (value, d) in levels.values.iter_mut().zip(&levels.all) {
                    *value = d.published.unwrap_or(d.default);
                }
            }
            _ => return Err(Error::unknown("preset", name, PRESETS)),
        }
        Ok(levels)
    }

    /// The same with some values changed.
    ///
    /// # Errors
    /// When a name is unknown (the message lists the known ones) or a value is out of range.
    pub fn with(mut self, given: &BTreeMap<String, f64>) -> Result<Self> {
        for (name, &value) in given {
            let i = self.place(name)?;
            self.all[i].check(value)?;
            self.values[i] = value;
        }
        Ok(self)
    }

    fn place(&self, name: &str) -> Result<usize> {
        let known = || self.all.iter().map(|d| &*d.name);
        known().position(|n| n == name).ok_or_else(|| {
            if self.all.is_empty() {
                return Error::Config {
                    key: format!("difficulty.{name}"),
                    message: "this task has no difficulty that can be set".into(),
                };
            }
            Error::unknown("difficulty", name, known())
        })
    }

    /// The difficulties to which the values belong.
    #[must_use]
    pub fn all(&self) -> &[Difficulty] {
        &self.all
    }

    /// A value by name.
    ///
    /// # Errors
    /// When there is none of this name.
    pub fn get(&self, name: &str) -> Result<f64> {
        self.place(name).map(|i| self.values[i])
    }

    /// All values by name.
    #[must_use]
    pub fn values(&self) -> BTreeMap<String, f64> {
        let names = self.all.iter().map(|d| d.name.clone());
        names.zip(self.values.iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels() -> Levels {
        Levels::new(vec![
            Difficulty::new("width", "m", 0.04, [0.01, 0.1], "width of the ledge"),
            Difficulty::new("noise", "m", 0.002, [0.0, 0.02], "noise").published(0.01),
        ])
    }

    #[test]
    fn a_preset_takes_the_published_values_that_there_are() {
        let all = levels().all;
        let published = Levels::preset(all.clone(), "published").unwrap();
        assert_eq!(
            published.values(),
            [("width", 0.04), ("noise", 0.01)]
                .map(|(n, v)| (n.into(), v))
                .into()
        );
        assert_eq!(Levels::preset(all.clone(), "default").unwrap(), levels());
        let error = Levels::preset(all, "hard").unwrap_err().to_string();
        assert!(
            error.contains("default") && error.contains("published"),
            "{error}"
        );
    }

    #[test]
    fn what_is_given_wins_and_what_cannot_be_is_refused_in_a_line() {
        let given = |name: &str, value| levels().with(&[(name.to_owned(), value)].into());
        assert_eq!(given("width", 0.02).unwrap().get("width").unwrap(), 0.02);
        let out = given("width", 0.2).unwrap_err().to_string();
        assert!(
            out.contains("difficulty.width") && out.contains("0.01 to 0.1 m"),
            "{out}"
        );
        assert!(given("width", f64::NAN).is_err());
        let unknown = given("widht", 0.02).unwrap_err().to_string();
        assert!(
            unknown.contains("width") && !unknown.contains('\n'),
            "{unknown}"
        );
        let none = Levels::new(Vec::new()).with(&[("width".to_owned(), 1.0)].into());
        assert!(none.unwrap_err().to_string().contains("no difficulty"));
    }
}
