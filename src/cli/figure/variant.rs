//! Explorers with settings of their own, as figures name them: `fisher-cem`, or
//! `fisher-cem:fisher.objective=trace+fisher.form=one-step`.

use std::collections::HashMap;

use anyhow::Result;
use asid_core::registry::{ExplorerEntry, find};
use asid_learned::learning::SHIPPED;
use asid_learned::shipped;

/// An explorer with settings that differ from its defaults.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variant<'t> {
    /// Name of the explorer.
    pub name: &'t str,
    /// Settings `key=value`, without `explorer.` before the key.
    settings: Vec<&'t str>,
}

impl<'t> Variant<'t> {
    /// Parses the text of a variant.
    pub fn of(text: &'t str) -> Self {
        let (name, settings) = text.split_once(':').unwrap_or((text, ""));
        Self {
            name,
            settings: settings.split('+').filter(|s| !s.is_empty()).collect(),
        }
    }

    /// Name for pictures and tables: the explorer and its values, such as `fisher-cem trace
    /// one-step`.
    pub fn label(&self) -> String {
        let values = self.settings.iter().map(|s| {
            let value = s.split_once('=').map_or(*s, |(_, value)| value);
            value.rsplit('/').next().unwrap_or(value).trim_matches('"')
        });
        let words: Vec<&str> = std::iter::once(self.name).chain(values).collect();
        words.join(" ")
    }

    /// As [`Variant::label`] with the keys, such as `fisher-cem fisher.objective=trace`, where the
    /// values alone are ambiguous.
    fn full_label(&self) -> String {
        let words: Vec<&str> = std::iter::once(self.name)
            .chain(self.settings.iter().copied())
            .collect();
        words.join(" ")
    }

    /// The settings as `--set` takes them.
    ///
    /// An explorer that learns plays the shipped policy unless a file is given: it is not trained
    /// for a single episode.
    ///
    /// # Errors
    /// When there is no such explorer.
    pub fn set(&self) -> Result<Vec<String>> {
        let mut set: Vec<String> = self
            .settings
            .iter()
            .map(|s| format!("explorer.{s}"))
            .collect();
        if self.learns()? && !self.is_told_a_policy() {
            set.push(format!("explorer.policy={SHIPPED:?}"));
        }
        Ok(set)
    }

    /// Why it cannot be played on a task: it learns, nothing is shipped for it, and no file is
    /// given.
    ///
    /// # Errors
    /// When there is no such explorer.
    pub fn lacks(&self, task: &str) -> Result<Option<String>> {
        let there = shipped::find(task, self.name).is_some();
        let plays = !self.learns()? || self.is_told_a_policy() || there;
        Ok((!plays).then(|| {
            format!(
                "Left out: {} on {task}, for which nothing that was trained ships; --explorer {}:policy=FILE plays a file",
                self.label(),
                self.name
            )
        }))
    }

    /// Whether it plays a policy that was trained before.
    ///
    /// # Errors
    /// When there is no such explorer.
    pub fn learns(&self) -> Result<bool> {
        let defaults = (find::<ExplorerEntry>(self.name)?.defaults)();
        Ok(defaults.contains_key("policy"))
    }

    fn is_told_a_policy(&self) -> bool {
        self.settings.iter().any(|s| s.starts_with("policy"))
    }
}

/// Labels of explorers that are shown side by side: no two are equal.
pub struct Labels(HashMap<String, String>);

impl Labels {
    /// Labels of these explorers: [`Variant::label`], with the keys where two would be equal.
    pub fn of(explorers: &[String]) -> Self {
        let short = |explorer: &String| Variant::of(explorer).label();
        let label = |explorer: &String| {
            let own = short(explorer);
            let mut others = explorers.iter().filter(|e| *e != explorer);
            if others.any(|e| short(e) == own) {
                return Variant::of(explorer).full_label();
            }
            own
        };
        Self(explorers.iter().map(|e| (e.clone(), label(e))).collect())
    }

    /// The label of one of them; any other explorer gets the label it has alone.
    pub fn get(&self, explorer: &str) -> String {
        let known = self.0.get(explorer).cloned();
        known.unwrap_or_else(|| Variant::of(explorer).label())
    }
}

/// The explorers without repetition, as [`Variant::of`] reads them.
pub fn distinct(explorers: &[String]) -> Vec<String> {
    let mut kept: Vec<String> = Vec::new();
    for explorer in explorers {
        let there = |k: &String| Variant::of(k) == Variant::of(explorer);
        if !kept.iter().any(there) {
            kept.push(explorer.clone());
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_the_keys_where_values_alone_do_not_tell_explorers_apart() {
        let explorers = [
            "random",
            "fisher-cem:iterations=4",
            "fisher-cem:population=4",
            "fisher-cem:population=8",
        ]
        .map(str::to_owned);
        let labels = Labels::of(&explorers);
        let all = explorers.each_ref().map(|e| labels.get(e));
        let expected = [
            "random",
            "fisher-cem iterations=4",
            "fisher-cem population=4",
            "fisher-cem 8",
        ];
        assert_eq!(all, expected);
    }

    #[test]
    fn an_explorer_that_is_named_twice_is_one() {
        let named = ["random", "fisher-cem:population=4", "random", "random:"];
        let kept = distinct(&named.map(str::to_owned));
        assert_eq!(kept, ["random", "fisher-cem:population=4"]);
    }

    #[test]
    fn settings_follow_a_name_and_a_label_has_their_values() {
        let plain = Variant::of("random");
        assert_eq!((plain.name, &*plain.label()), ("random", "random"));
        assert!(plain.set().unwrap().is_empty());
        let trace = Variant::of("fisher-cem:fisher.objective=trace+fisher.form=one-step");
        assert_eq!(trace.label(), "fisher-cem trace one-step");
        assert_eq!(
            trace.set().unwrap(),
            [
                "explorer.fisher.objective=trace",
                "explorer.fisher.form=one-step"
            ]
        );
        assert_eq!(trace.lacks("rod-balancing").unwrap(), None);
        assert!(Variant::of("no-such").set().is_err());
    }

    #[test]
    fn what_learns_plays_what_ships_or_the_file_that_it_is_told() {
        let ships = Variant::of("fisher-ppo");
        assert_eq!(ships.set().unwrap(), ["explorer.policy=\"shipped\""]);
        assert_eq!(ships.lacks("rod-balancing").unwrap(), None);
        assert!(ships.lacks("no-such-task").unwrap().is_some());
        let told = Variant::of("max:policy=a/b.safetensors");
        assert_eq!(told.label(), "max b.safetensors");
        assert_eq!(told.lacks("no-such-task").unwrap(), None);
        assert_eq!(told.set().unwrap(), ["explorer.policy=a/b.safetensors"]);
    }
}
