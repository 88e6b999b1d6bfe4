//! `asid config`: every setting with its value and meaning, as a file for `--config`. The settings
//! are those of a task, or of a command on a study or a model.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::registry::{AlgorithmEntry, Entry, Meanings, TaskEntry, find, meanings};
use asid_core::{Explorer, Identifier, Task, TaskSolver};

use super::options::{Algorithms, Common, Worlds};
use super::settings::{Config, ParameterConfig, Stage, difficulty, wrong};
use super::{diagnose, machine};

/// Width of a comment, in columns.
const WIDTH: usize = 100;

/// Arguments of `config`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The task; the study (a TOML file, or a folder with study.toml); or the model
    #[arg(value_name = "TASK|STUDY|MODEL")]
    subject: String,
    /// Print the settings of this command on a study [default: diagnose; explore on a model]
    #[arg(long, value_name = "COMMAND")]
    of: Option<OfStudy>,
    #[command(flatten)]
    algorithms: Algorithms,
    #[command(flatten)]
    worlds: Worlds,
    /// Simulate with this engine: see `asid list`
    #[arg(long, value_name = "NAME")]
    backend: Option<String>,
    /// Set the difficulty: `default`, or `published` (the paper's values where it gives them)
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Set a value, such as explorer.iterations=10 (repeatable)
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Take settings from a file, such as a run's config.toml
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
}

/// A command on a study or a model.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum OfStudy {
    Diagnose,
    Identify,
    Explore,
}

/// Prints the settings.
pub fn print(arguments: &Arguments) -> Result<()> {
    let common = Common {
        backend: arguments.backend.clone(),
        preset: arguments.preset.clone(),
        set: arguments.set.clone(),
        config: arguments.config.clone(),
        ..Common::default()
    };
    let page = match find::<TaskEntry>(&arguments.subject) {
        Ok(_) if arguments.of.is_some() => {
            return Err(wrong(
                "--of",
                "goes with a study or a model: a task has the settings of `asid run`",
            ));
        }
        Ok(entry) => of_task((entry.make)()?, arguments, &common)?,
        Err(_) if Path::new(&arguments.subject).exists() => {
            of_study(Path::new(&arguments.subject), arguments.of, &common)?
        }
        Err(unknown) => return Err(unknown.into()),
    };
    std::io::stdout().lock().write_all(page.as_bytes())?;
    Ok(())
}

/// The settings of a command on a study, or on a model.
fn of_study(study: &Path, command: Option<OfStudy>, common: &Common) -> Result<String> {
    let is_model = !machine::is_study(study)?;
    let (name, example, table, meanings) = match command {
        None if is_model => of_motion(study, common)?,
        Some(OfStudy::Explore) => of_motion(study, common)?,
        Some(OfStudy::Identify) => {
            let config = machine::identify::Config::resolve(study, None, common)?;
            let table = toml::Table::try_from(&config)?;
            let meanings = meanings::<machine::identify::Config>();
            ("identify", "gauss_newton.starts=4", table, meanings)
        }
        None | Some(OfStudy::Diagnose) => {
            let table = toml::Table::try_from(&diagnose::Config::of_study(study, common)?)?;
            let meanings = meanings::<diagnose::Config>();
            ("diagnose", "search.depth=2", table, meanings)
        }
    };
    let mut page = format!(
        "# Settings of `asid {name} {}`. A setting is changed by --set KEY=VALUE, with the section before\n\
         # its name, such as --set {example}; this text in a file is read by --config FILE.\n",
        study.display()
    );
    write(&table, &[], &meanings, &mut page);
    Ok(page)
}

/// The settings for exploring a machine: the command's name, an example, the settings and their
/// meanings.
fn of_motion(
    machine: &Path,
    common: &Common,
) -> Result<(&'static str, &'static str, toml::Table, Meanings)> {
    type Motion = machine::motion_config::Config;
    let config = Motion::resolve(machine, common, &machine::motion_config::Options::default())?;
    let table = toml::Table::try_from(&config)?;
    Ok((
        "explore",
        "design.iterations=20",
        table,
        meanings::<Motion>(),
    ))
}

/// The settings of a task.
fn of_task(task: Box<dyn Task>, arguments: &Arguments, common: &Common) -> Result<String> {
    let levels = difficulty::levels(&*task, common)?;
    let task = difficulty::at(task, &levels)?;
    let (algorithms, worlds) = (&arguments.algorithms, &arguments.worlds);
    let (config, _) = Config::resolve(Stage::Run, &*task, common, algorithms, worlds)?;
    let mut page = format!(
        "# Settings of `asid run {}`. A setting is changed by --set KEY=VALUE, with the section before\n\
         # its name, such as --set explorer.name=random; this text in a file is read by --config FILE.\n",
        task.name()
    );
    let table = toml::Table::try_from(&config)?;
    write(&table, &[], &meanings_of(&config, &*task)?, &mut page);
    Ok(page)
}

/// The meaning of every setting, by its full key.
fn meanings_of(config: &Config, task: &dyn Task) -> Result<Meanings> {
    let mut all = meanings::<Config>();
    let mut add = |section: &str, found: Meanings| {
        all.extend(
            found
                .into_iter()
                .map(|(k, v)| (format!("{section}.{k}"), v)),
        );
    };
    add("explorer", of::<dyn Explorer>(&config.explorer.name)?);
    add("identifier", of::<dyn Identifier>(&config.identifier.name)?);
    add("solver", of::<dyn TaskSolver>(&config.solver.name)?);
    for level in task.difficulty() {
        let [low, high] = level.range;
        let unit = Some(level.unit).filter(|u| !u.is_empty());
        let unit = unit.map_or_else(String::new, |u| format!(", {u}"));
        let text = format!("{}{unit}. From {low} to {high}.", level.about);
        all.insert(format!("difficulty.{}", level.name), text);
    }
    for p in task
        .parameters()
        .into_iter()
        .chain(task.optional_parameters())
    {
        let unit = Some(p.unit).filter(|u| !u.is_empty());
        let text = unit.map_or_else(|| "An unknown.".into(), |u| format!("An unknown, in {u}."));
        let of_unknown = meanings::<ParameterConfig>().into_iter();
        all.extend(of_unknown.map(|(k, v)| (format!("parameter.{}.{k}", p.name), v)));
        all.insert(format!("parameter.{}", p.name), text);
    }
    Ok(all)
}

/// The meanings of an algorithm's settings, including its name.
fn of<T: ?Sized + 'static>(name: &str) -> Result<Meanings>
where
    AlgorithmEntry<T>: Entry,
{
    let entry = find::<AlgorithmEntry<T>>(name)?;
    let mut found = (entry.meanings)();
    found.insert("name".into(), format!("{name}: {}.", entry.about));
    Ok(found)
}

/// Writes the table at `path`: its values, each under its meaning, then its inner tables.
fn write(table: &toml::Table, path: &[&str], meanings: &Meanings, page: &mut String) {
    let meaning = |path: &[&str]| meanings.get(&path.join("."));
    for (key, value) in table.iter().filter(|(_, v)| !v.is_table()) {
        page.push('\n');
        comment(meaning(&[path, &[key]].concat()), page);
        let line = toml::Table::from_iter([(key.clone(), value.clone())]);
        page.push_str(&line.to_string());
    }
    for (key, inner) in table.iter().filter_map(|(k, v)| Some((k, v.as_table()?))) {
        let path = [path, &[key]].concat();
        page.push_str("\n\n");
        comment(meaning(&path), page);
        let header: Vec<String> = path.iter().map(|k| quoted(k)).collect();
        page.push_str(&format!("[{}]\n", header.join(".")));
        write(inner, &path, meanings, page);
    }
}

/// A key in TOML syntax.
fn quoted(key: &str) -> String {
    let line = toml::Table::from_iter([(key.to_owned(), toml::Value::Boolean(true))]).to_string();
    line.trim_end().trim_end_matches(" = true").to_owned()
}

/// A meaning as comment lines.
fn comment(meaning: Option<&String>, page: &mut String) {
    let mut line = String::from("#");
    for word in meaning.map(String::as_str).unwrap_or_default().split(' ') {
        if line.len() + 1 + word.len() > WIDTH {
            page.push_str(&line);
            page.push('\n');
            line = String::from("#");
        }
        if !word.is_empty() {
            line.push(' ');
            line.push_str(word);
        }
    }
    if line.len() > 1 {
        page.push_str(&line);
        page.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use asid_core::registry::all;

    use super::*;

    /// Full keys of a table's values and inner tables.
    fn keys(table: &toml::Table, prefix: &str) -> Vec<String> {
        let of = |(key, value): (&String, &toml::Value)| {
            let own = format!("{prefix}{key}");
            let inner = value.as_table().map(|t| keys(t, &format!("{own}.")));
            [vec![own], inner.unwrap_or_default()].concat()
        };
        table.iter().flat_map(of).collect()
    }

    #[test]
    fn every_setting_of_every_algorithm_has_a_meaning() {
        fn check<T: ?Sized + 'static>()
        where
            AlgorithmEntry<T>: Entry,
        {
            for entry in all::<AlgorithmEntry<T>>() {
                let meanings = (entry.meanings)();
                for key in keys(&(entry.defaults)(), "") {
                    assert!(
                        meanings.contains_key(&key),
                        "{} has no meaning of `{key}`",
                        entry.name
                    );
                }
            }
        }
        check::<dyn Explorer>();
        check::<dyn Identifier>();
        check::<dyn TaskSolver>();
    }

    #[test]
    fn comments_are_broken_at_words_and_keys_are_quoted_where_they_must_be() {
        let mut page = String::new();
        comment(Some(&"word ".repeat(30)), &mut page);
        assert!(page.lines().count() == 2 && page.lines().all(|l| l.len() <= WIDTH));
        assert_eq!(quoted("plain-key"), "plain-key");
        assert_eq!(quoted("robot/arm"), "\"robot/arm\"");
    }
}
