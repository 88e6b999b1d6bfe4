//! `--train FILE` of `explore` and `identify`: what is learned beforehand, saved for later use.

use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{ExplorerEntry, IdentifierEntry, find};
use asid_learned::learning::events_of;
use asid_learned::{Description, Saved};

use super::interrupt;
use super::options::Common;
use super::session::Session;

/// Name of the identifier that learns from an explorer.
const ESTIMATOR: &str = asid_learned::estimator::NAME;

/// The explorer whose settings to resolve, where the identifier learns from one.
pub fn explorer_of(explorer: Option<&str>, identifier: Option<&str>) -> Option<String> {
    let learned = || asid_learned::Estimator::default().explorer;
    let given = explorer.map(str::to_owned);
    given.or_else(|| (identifier == Some(ESTIMATOR)).then(learned))
}

/// Tells the session's identifier which explorer's episodes it learns from.
pub fn learned_from(session: &mut Session, explorer: &str) -> Result<()> {
    let component = &mut session.config.identifier;
    match component.settings.get_mut("explorer") {
        Some(setting) => *setting = explorer.into(),
        None => {
            return Err(Error::Config {
                key: "--explorer".into(),
                message: format!(
                    "the identifier `{}` learns from no explorer",
                    component.name
                ),
            }
            .into());
        }
    }
    Ok(())
}

/// Trains the session's explorer and saves it.
pub fn explorer(session: &Session, common: &Common, file: &Path) -> Result<()> {
    let component = &session.config.explorer;
    let explorer = (find::<ExplorerEntry>(&component.name)?.make)(&component.settings)?;
    interrupt::watch(&format!("the training of {}", component.name))?;
    let learned = explorer.train(&session.problem(), file)?;
    finish(learned, "explorer", &component.name, common, file)
}

/// Trains the session's identifier on episodes of the session's explorer and saves it.
pub fn identifier(session: &Session, common: &Common, file: &Path) -> Result<()> {
    let config = &session.config;
    let component = &config.identifier;
    let wanted = component.settings.get("explorer").and_then(|e| e.as_str());
    if wanted.is_some_and(|wanted| wanted != config.explorer.name) {
        return Err(Error::Config {
            key: "--explorer".into(),
            message: format!(
                "`{}` is to learn from `{}`; name the explorer by --explorer",
                component.name,
                wanted.unwrap_or_default()
            ),
        }
        .into());
    }
    let explorer = (find::<ExplorerEntry>(&config.explorer.name)?.make)(&config.explorer.settings)?;
    let identifier = (find::<IdentifierEntry>(&component.name)?.make)(&component.settings)?;
    interrupt::watch(&format!("the training of {}", component.name))?;
    let learned = identifier.train(&session.problem(), &*explorer, file)?;
    finish(learned, "identifier", &component.name, common, file)
}

/// Prints what was saved.
fn finish(learned: bool, kind: &str, name: &str, common: &Common, file: &Path) -> Result<()> {
    if !learned {
        return Err(Error::Config {
            key: "--train".into(),
            message: format!("the {kind} `{name}` learns nothing beforehand"),
        }
        .into());
    }
    *interrupt::writing() = true;
    let mut stdout = std::io::stdout().lock();
    // A plugin may save another format.
    let Ok(Saved { description, .. }) = Saved::load(file) else {
        writeln!(stdout, "saved: {}", file.display())?;
        return Ok(());
    };
    if common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&description)?)?;
        return Ok(());
    }
    let Description {
        training_steps,
        seconds,
        figures,
        ..
    } = &description;
    writeln!(
        stdout,
        "trained: {training_steps} control steps in {seconds:.0} s"
    )?;
    for (name, value) in figures {
        writeln!(stdout, "{name}: {value:.3}")?;
    }
    writeln!(stdout, "saved: {}", file.display())?;
    writeln!(stdout, "curves: {}", events_of(file).display())?;
    Ok(())
}
