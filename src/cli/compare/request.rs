//! Turns the command line and a configuration into a plan and the settings of its runs.

use anyhow::Result;
use asid_comparison::document::Document;
use asid_comparison::method::Method;
use asid_comparison::plan::{Plan, TaskPlan};
use asid_comparison::preset;
use asid_core::registry::{
    self, BackendEntry, Entry as _, ExplorerEntry, IdentifierEntry, Origin, SolverEntry, TaskEntry,
    find,
};
use asid_effects::EffectSpec;

use super::Arguments;
use super::methods::methods;
use super::of_run::{OfRun, unnamed_world};
use crate::cli::plugins::{file_of, recorded, used};
use crate::cli::settings::{PRIOR, check_condition, default_backend, read_table, set, wrong};

/// The requested comparison. The command line overrides the configuration, which overrides a table
/// of the paper, which overrides the defaults.
///
/// Settings of a single run (`seed`, `backend`, `condition`, `real.world`, `task`), from `--set` or
/// from a run's configuration, override the plan of a comparison's configuration.
pub fn document(arguments: &Arguments) -> Result<Document> {
    let mut settings = match &arguments.config {
        Some(path) => read_table(path)?,
        None => toml::Table::new(),
    };
    let base = Document::plan_of(&mut settings)?;
    options(arguments, &mut settings)?;
    let of_run = OfRun::take(&mut settings)?;
    let base = match arguments.table {
        Some(table) => {
            // No table of the paper shows the expected information of an episode, and its fits cost
            // as much as the rest of a run.
            let expected = subtable(&mut settings, "expected")?;
            expected.entry("rounds").or_insert(0.into());
            Some(of_table(table, arguments, base.as_ref())?)
        }
        None => base,
    };
    let quick = arguments.quick || base.as_ref().is_some_and(|b| b.quick);
    let list = |given: &[String], of_run: Option<String>, base: Option<&Vec<String>>| {
        let given = (!given.is_empty()).then(|| given.to_vec());
        given.or(of_run.map(|one| vec![one])).or(base.cloned())
    };
    let of_base = base.as_ref().map(|b| &b.backends);
    let backends = list(&arguments.backend, of_run.backend, of_base);
    let backends = backends.unwrap_or_else(|| vec![default_backend()]);
    let of_base = base.as_ref().map(|b| &b.worlds);
    let worlds = match list(&arguments.world, of_run.world, of_base) {
        Some(worlds) => worlds,
        None => vec![unnamed_world(&settings, &backends)?],
    };
    let mut plan = Plan {
        table: base.as_ref().and_then(|b| b.table),
        quick,
        train: arguments.train || base.as_ref().is_some_and(|b| b.train),
        methods: methods(&arguments.method, base.as_ref())?,
        worlds,
        backends,
        first_seed: arguments
            .seed
            .or(of_run.seed)
            .or(base.as_ref().map(|b| b.first_seed))
            .unwrap_or(0),
        seeds: arguments
            .seeds
            .or(base.as_ref().map(|b| b.seeds))
            .unwrap_or_else(|| seeds(quick)),
        task: tasks(arguments, base.as_ref(), of_run.task, of_run.condition)?,
    };
    plan.check()?;
    let files = plugin_files(&plan);
    if !files.is_empty() {
        settings.insert("plugins".into(), files.into());
    }
    Ok(Document { plan, settings })
}

/// Files of the plugins that were named or that provide parts of the comparison.
fn plugin_files(plan: &Plan) -> Vec<toml::Value> {
    let mut parts: Vec<_> = plan
        .task
        .iter()
        .map(|t| file_of::<TaskEntry>(&t.name))
        .collect();
    parts.extend(plan.backends.iter().map(|b| file_of::<BackendEntry>(b)));
    for method in &plan.methods {
        parts.extend([
            file_of::<ExplorerEntry>(&method.explorer),
            file_of::<IdentifierEntry>(&method.identifier),
            file_of::<SolverEntry>(&method.solver),
        ]);
    }
    let files = recorded(used(&parts)).into_iter();
    files.map(|f| f.display().to_string().into()).collect()
}

fn seeds(quick: bool) -> u64 {
    if quick {
        preset::QUICK_SEEDS
    } else {
        preset::SEEDS
    }
}

/// A table of the paper, on the engines of the configuration where it names some.
fn of_table(table: u8, arguments: &Arguments, config: Option<&Plan>) -> Result<Plan> {
    let preset = preset::of_table(table)?;
    let quick = arguments.quick || config.is_some_and(|c| c.quick);
    // Use the engine that has all capabilities, if there is one.
    let engines = registry::all::<BackendEntry>();
    let able = engines.iter().find(|e| {
        matches!(e.origin(), Origin::Linked(_))
            && (e.make)().is_ok_and(|engine| engine.capabilities().is_all())
    });
    let engine = able.map_or_else(default_backend, |e| e.name().to_owned());
    let task = |(name, conditions): &(&str, &[&str])| TaskPlan {
        name: (*name).to_owned(),
        conditions: conditions.iter().map(|c| (*c).to_owned()).collect(),
    };
    Ok(Plan {
        table: Some(table),
        quick,
        train: config.is_some_and(|c| c.train),
        methods: preset
            .methods
            .iter()
            .map(|m| Method::named(m))
            .collect::<asid_core::Result<_>>()?,
        worlds: vec![preset.world.to_owned()],
        backends: config.map_or_else(|| vec![engine], |c| c.backends.clone()),
        first_seed: config.map_or(0, |c| c.first_seed),
        seeds: config.map_or_else(|| seeds(quick), |c| c.seeds),
        task: preset.tasks.iter().map(task).collect(),
    })
}

/// Writes options that are settings into the settings, so that the configuration repeats them.
fn options(arguments: &Arguments, settings: &mut toml::Table) -> Result<()> {
    for assignment in &arguments.set {
        let key = assignment.split('=').next().unwrap_or_default().trim();
        if key.starts_with("plugins") {
            return Err(wrong("plugins", "is given by --plugin FILE, not by --set"));
        }
        if ["explorer.name", "identifier.name", "solver.name"].contains(&key) {
            let message = "a row is named after its parts: name the method, such as --method \
                           NAME=explorer+identifier+solver";
            return Err(wrong(key, message));
        }
        set(settings, assignment)?;
    }
    if let Some(name) = &arguments.preset {
        settings.insert("preset".into(), name.as_str().into());
    }
    let path = |p: &std::path::Path| toml::Value::String(p.display().to_string());
    if let Some(model) = &arguments.simulator.model {
        settings.insert("model".into(), path(model));
    }
    let given = &arguments.real;
    if given.truth.is_empty()
        && given.real_backend.is_none()
        && given.real_model.is_none()
        && given.real_effect.is_empty()
    {
        return Ok(());
    }
    let real = subtable(settings, "real")?;
    if let Some(name) = &given.real_backend {
        real.insert("backend".into(), name.as_str().into());
    }
    if let Some(model) = &given.real_model {
        real.insert("model".into(), path(model));
    }
    for text in &given.real_effect {
        let effect = text.parse::<EffectSpec>()?.to_string();
        let list = real
            .entry("effects")
            .or_insert_with(|| toml::Value::Array(Vec::new()));
        let list = list
            .as_array_mut()
            .ok_or_else(|| wrong("real.effects", "is not a list"))?;
        list.push(effect.into());
    }
    for text in &given.truth {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| wrong("--truth", format!("`{text}` is not NAME=VALUE")))?;
        let value: f64 = value
            .trim()
            .parse()
            .ok()
            .filter(|x: &f64| x.is_finite())
            .ok_or_else(|| {
                wrong(
                    &format!("--truth {name}"),
                    format!("`{value}` is not a finite number"),
                )
            })?;
        subtable(real, "truth")?.insert(name.trim().to_owned(), value.into());
    }
    Ok(())
}

fn subtable<'t>(table: &'t mut toml::Table, key: &str) -> Result<&'t mut toml::Table> {
    table
        .entry(key)
        .or_insert_with(|| toml::Value::Table(toml::Table::new()))
        .as_table_mut()
        .ok_or_else(|| wrong(key, "is not a section of settings"))
}

/// The tasks with their conditions.
fn tasks(
    arguments: &Arguments,
    base: Option<&Plan>,
    of_run: Option<String>,
    condition: Option<String>,
) -> Result<Vec<TaskPlan>> {
    if let (Some(of_run), [other, ..]) = (&of_run, &*arguments.tasks)
        && of_run != other
    {
        let message = format!("the configuration is for `{of_run}`, the command for `{other}`");
        return Err(wrong("task", message));
    }
    let names: Vec<String> = match (&*arguments.tasks, of_run, base) {
        ([], Some(task), _) => vec![task],
        ([], None, Some(base)) => base.task.iter().map(|t| t.name.clone()).collect(),
        ([], None, None) => {
            let all = registry::all::<TaskEntry>();
            all.iter().map(|t| t.name.to_owned()).collect()
        }
        (given, _, _) => given.to_vec(),
    };
    names
        .into_iter()
        .map(|name| {
            let all = (find::<TaskEntry>(&name)?.make)()?.conditions();
            let of_base = base.and_then(|b| b.task.iter().find(|t| t.name == name));
            let conditions = match (&*arguments.condition, &condition, of_base) {
                ([], Some(one), _) => vec![one.clone()],
                ([], None, Some(task)) => task.conditions.clone(),
                // A task without conditions of its own runs over its prior.
                ([], None, None) if all.is_empty() => vec![PRIOR.to_owned()],
                ([], None, None) => all.iter().map(|c| c.name.clone()).collect(),
                (given, _, _) => given.to_vec(),
            };
            for condition in &conditions {
                check_condition(&all, condition)?;
            }
            Ok(TaskPlan { name, conditions })
        })
        .collect()
}
