//! An arm: one method on one task, in one world, on one engine. Its runs share their settings.

use std::path::Path;

use anyhow::Result;
use asid_comparison::cell::CellKey;
use asid_comparison::document::Document;
use asid_comparison::method::Method;
use asid_comparison::preset;
use asid_comparison::settings::{canonical, hash};
use asid_core::registry::{self, AlgorithmEntry, Entry, TaskEntry, find};
use asid_core::{Explorer, Identifier, Task, TaskSolver};
use asid_learned::learning::SHIPPED;

use crate::cli::options::{Algorithms, Common, Worlds};
use crate::cli::settings::{Config, Stage, difficulty};

/// An arm with its resolved settings.
#[derive(Clone)]
pub struct Arm {
    /// The method.
    pub method: Method,
    /// Options of its runs, without seed and condition.
    pub common: Common,
    /// Hash of the settings.
    pub hash: String,
    /// The settings that the hash stands for.
    pub canonical: String,
}

impl Arm {
    /// Resolves the settings of a cell's arm; `trained` are the settings that load trained files.
    ///
    /// # Errors
    /// When a setting is wrong.
    pub fn resolve(
        document: &Document,
        method: &Method,
        key: &CellKey,
        trained: &[(String, String)],
    ) -> Result<Self> {
        let task = (find::<TaskEntry>(&key.task)?.make)()?;
        let mut common = Common {
            backend: Some(key.backend.clone()),
            // Cells run in parallel, so each uses one thread.
            threads: Some(1),
            base: of_method(document, &*task, method),
            quiet: true,
            ..Common::default()
        };
        for (setting, value) in trained {
            common.set.push(format!("{setting}={value:?}"));
        }
        // A matched world is named as well: settings that make it another are then refused.
        common.set.push(format!("real.world={:?}", key.world));
        let levels = difficulty::levels(&*task, &common)?;
        let task = difficulty::at(task, &levels)?;
        let resolve = |common: &Common| -> Result<Config> {
            let (algorithms, worlds) = (Algorithms::default(), Worlds::default());
            Ok(Config::resolve(Stage::Run, &*task, common, &algorithms, &worlds)?.0)
        };
        let mut config = resolve(&common)?;
        if document.plan.quick {
            let halved = [
                preset::quick("explorer", &config.explorer.settings),
                preset::quick("identifier", &config.identifier.settings),
                preset::quick("solver", &config.solver.settings),
            ];
            let used = [method.explores(), method.identifies(), true];
            for (budgets, _) in halved.into_iter().zip(used).filter(|(_, used)| *used) {
                let set = budgets.iter().map(|(key, value)| format!("{key}={value}"));
                common.set.extend(set);
            }
            config = resolve(&common)?;
        }
        let (hash, canonical) = hash(&canonical(&toml::Table::try_from(&config)?, method));
        Ok(Self {
            method: method.clone(),
            common,
            hash,
            canonical,
        })
    }
}

impl Arm {
    /// Whether its settings name this file, so that all of its runs need it.
    pub fn names(&self, path: &Path) -> bool {
        fn holds(value: &toml::Value, path: &Path) -> bool {
            match value {
                toml::Value::String(text) => Path::new(text) == path,
                toml::Value::Array(all) => all.iter().any(|value| holds(value, path)),
                toml::Value::Table(table) => table.values().any(|value| holds(value, path)),
                _ => false,
            }
        }
        let set = self.common.set.iter();
        let mut set = set.filter_map(|line| line.parse::<toml::Table>().ok());
        let mut base = self.common.base.values();
        base.any(|value| holds(value, path))
            || set.any(|table| table.values().any(|value| holds(value, path)))
    }
}

/// The method's parts with the given settings that apply to them.
fn of_method(document: &Document, task: &dyn Task, method: &Method) -> toml::Table {
    let mut settings = document.settings.clone();
    forget_explorer_of_run(&mut settings);
    let explorer = method.explores().then_some(&*method.explorer);
    let identifier = method.identifies().then_some(&*method.identifier);
    keep::<dyn Explorer>(&mut settings, task, "explorer", explorer);
    keep::<dyn Identifier>(&mut settings, task, "identifier", identifier);
    keep::<dyn TaskSolver>(&mut settings, task, "solver", Some(&method.solver));
    let mut put = |section: &str, key: &str, value: &str| {
        let section = settings
            .entry(section)
            .or_insert_with(|| toml::Value::Table(toml::Table::new()));
        if let Some(section) = section.as_table_mut() {
            let entry = section.entry(key).or_insert(value.into());
            // A run's file has an empty text where the run chose for itself.
            if entry.as_str() == Some("") {
                *entry = value.into();
            }
        }
    };
    let parts = [
        ("explorer", explorer),
        ("identifier", identifier),
        ("solver", Some(&*method.solver)),
    ];
    for (section, part) in parts {
        if let Some(part) = part {
            put(section, "name", part);
        }
    }
    // An estimator learns from episodes of the method's explorer.
    if let (Some(identifier), Some(explorer)) = (identifier, explorer)
        && known::<dyn Identifier>(task, "identifier", identifier)
            .iter()
            .any(|k| k == "explorer")
    {
        put("identifier", "explorer", explorer);
    }
    // A run plays what was trained before. Where nothing is shipped, it fails rather than train for
    // itself.
    if let Some(explorer) = explorer
        && known::<dyn Explorer>(task, "explorer", explorer)
            .iter()
            .any(|k| k == "policy")
    {
        put("explorer", "policy", SHIPPED);
    }
    if let Some(identifier) = identifier
        && known::<dyn Identifier>(task, "identifier", identifier)
            .iter()
            .any(|k| k == "network")
    {
        put("identifier", "network", SHIPPED);
    }
    settings
}

/// Removes the explorer that an identifier learns from, where it is only that of the run whose
/// settings these are: each method has its own.
fn forget_explorer_of_run(settings: &mut toml::Table) {
    let named = |section: &str, key: &str| settings.get(section)?.get(key).cloned();
    let of_run = named("explorer", "name");
    let learned_from = named("identifier", "explorer");
    if learned_from.is_some()
        && learned_from == of_run
        && let Some(identifier) = settings.get_mut("identifier")
        && let Some(identifier) = identifier.as_table_mut()
    {
        identifier.remove("explorer");
    }
}

/// Reduces a section to the settings that concern the algorithm `part`.
///
/// Where the section names `part`, all of it stays, else the settings that `part` has. A setting
/// that no algorithm of the kind has stays too, and is refused later.
fn keep<T: ?Sized + 'static>(
    settings: &mut toml::Table,
    task: &dyn Task,
    section: &str,
    part: Option<&str>,
) where
    AlgorithmEntry<T>: Entry,
{
    let Some(given) = settings
        .get_mut(section)
        .and_then(toml::Value::as_table_mut)
    else {
        return;
    };
    let named = given
        .get("name")
        .and_then(|n| n.as_str())
        .map(str::to_owned);
    match (part, named) {
        (None, _) => given.clear(),
        (Some(part), Some(name)) if part != name => given.clear(),
        (Some(_), Some(_)) => {}
        (Some(part), None) => given.retain(|key, _| reaches::<T>(task, section, part, key)),
    }
    if given.is_empty() {
        settings.remove(section);
    }
}

/// Whether a setting concerns the algorithm `part` on a task.
///
/// It does if `part` has the setting, or if no algorithm of the kind has it, so that it is refused
/// later.
pub fn reaches<T: ?Sized + 'static>(task: &dyn Task, section: &str, part: &str, key: &str) -> bool
where
    AlgorithmEntry<T>: Entry,
{
    let has = |name: &str| known::<T>(task, section, name).iter().any(|k| k == key);
    let all = registry::all::<AlgorithmEntry<T>>();
    has(part) || !all.iter().any(|e| has(e.name()))
}

/// Settings that an algorithm has on a task; empty where it is not registered.
fn known<T: ?Sized + 'static>(task: &dyn Task, section: &str, name: &str) -> Vec<String>
where
    AlgorithmEntry<T>: Entry,
{
    let Ok(entry) = find::<AlgorithmEntry<T>>(name) else {
        return Vec::new();
    };
    let of_task = task.settings(section, name);
    let defaults = (entry.defaults)();
    defaults.keys().chain(of_task.keys()).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::settings::ASID;

    #[test]
    fn the_method_asid_is_what_a_run_does_by_itself() {
        let asid = Method::named("asid").unwrap();
        assert_eq!(
            (&*asid.explorer, &*asid.identifier, &*asid.solver),
            (ASID.explorer, ASID.identifier, ASID.solver)
        );
    }

    /// Symptom: from the configuration of a run of `asid-estimator`, the method `maxmi` had the
    /// estimator of the other's episodes, and learned explorers trained in every run where nothing
    /// ships. Cause: what the run had chosen for itself counted as chosen for all methods.
    #[test]
    fn what_a_run_chose_for_itself_is_not_chosen_for_every_method() {
        let task = (find::<TaskEntry>("rod-balancing").unwrap().make)().unwrap();
        let of = |text: &str, method: &str| {
            let plan = "[compare]\nmethods = []\nworlds = []\nbackends = []\nfirst_seed = 0\n\
                        seeds = 1\ntask = []\n";
            let mut settings: toml::Table = format!("{plan}{text}").parse().unwrap();
            let plan = Document::plan_of(&mut settings).unwrap().unwrap();
            let document = Document { plan, settings };
            of_method(&document, &*task, &Method::named(method).unwrap())
        };
        let run = "[explorer]\nname = 'fisher-ppo'\npolicy = ''\n\
                   [identifier]\nname = 'estimator'\nexplorer = 'fisher-ppo'\nnetwork = ''";
        for (method, explorer) in [("maxmi", "maxmi"), ("asid-estimator", "fisher-ppo")] {
            let settings = of(run, method);
            assert_eq!(settings["explorer"]["name"].as_str(), Some(explorer));
            assert_eq!(settings["explorer"]["policy"].as_str(), Some(SHIPPED));
            assert_eq!(settings["identifier"]["explorer"].as_str(), Some(explorer));
            assert_eq!(settings["identifier"]["network"].as_str(), Some(SHIPPED));
        }
        // What is set for all methods stays.
        let set = "[identifier]\nexplorer = 'random'\nnetwork = 'a.safetensors'";
        let settings = of(set, "maxmi");
        assert_eq!(settings["identifier"]["explorer"].as_str(), Some("random"));
        assert_eq!(
            settings["identifier"]["network"].as_str(),
            Some("a.safetensors")
        );
    }

    #[test]
    fn an_arm_names_the_files_of_its_settings() {
        let arm = |base: &str, set: &[&str]| Arm {
            method: Method::named("asid").unwrap(),
            common: Common {
                base: base.parse().unwrap(),
                set: set.iter().map(|line| (*line).to_owned()).collect(),
                ..Common::default()
            },
            hash: String::new(),
            canonical: String::new(),
        };
        let file = Path::new("a/policy.safetensors");
        assert!(arm("[explorer]\npolicy = 'a/policy.safetensors'", &[]).names(file));
        assert!(arm("", &["explorer.policy=\"a/policy.safetensors\""]).names(file));
        assert!(!arm("[explorer]\nname = 'policy'", &["seed=3"]).names(file));
    }

    #[test]
    fn a_setting_reaches_the_methods_that_have_it_and_a_wrong_one_is_left_to_be_refused() {
        let task = (find::<TaskEntry>("rod-balancing").unwrap().make)().unwrap();
        let of = |text: &str, method: &str| {
            let mut settings: toml::Table = text.parse().unwrap();
            let method = Method::named(method).unwrap();
            let explorer = method.explores().then_some(&*method.explorer);
            keep::<dyn Explorer>(&mut settings, &*task, "explorer", explorer);
            settings.contains_key("explorer")
        };
        let text = "[explorer]\niterations = 3";
        assert!(of(text, "asid") && !of(text, "random") && !of(text, "dr"));
        assert!(of("[explorer]\niteratoins = 3", "random"));
        let named = "[explorer]\nname = 'random'";
        assert!(of(named, "random") && !of(named, "asid"));
    }
}
