//! The study folder that an import writes.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;
use asid_core::{Episode, Error};
use asid_effects::native::plain;
use asid_logs::LogSettings;
use asid_logs::episode::ColumnMapping;
use asid_logs::propose::Proposal;
use asid_mjcf::native::way;
use asid_results::naming::count;
use serde::Serialize;

use super::super::machine::Subject;
use super::super::output::write_text;
use super::super::shell;
use super::Imported;

/// Number of parts into which a single episode is cut; the last part is held out.
pub(super) const PARTS: usize = 3;

/// What to write.
pub(super) struct Files<'a> {
    /// The machine.
    pub subject: &'a Subject,
    /// The model's file, as named by the user.
    pub given: &'a Path,
    /// Whether the model had no sensors and got them here.
    pub bare: bool,
    /// Kind of the logs, and their topics.
    pub settings: &'a LogSettings,
    /// The mapping.
    pub proposal: &'a Proposal,
    /// The episodes.
    pub imported: &'a [Imported],
    /// Whether to write the episodes instead of references.
    pub copy: bool,
}

#[derive(Serialize)]
struct Head<'a> {
    model: &'a str,
    train: &'a [String],
    test: &'a [String],
}

#[derive(Serialize)]
struct LogPart<'a> {
    log: &'a LogSettings,
}

impl Files<'_> {
    /// Whether a single episode is cut into parts: fitted data cannot be held out.
    fn is_cut(&self) -> bool {
        self.imported.len() == 1
    }

    /// Number of episodes in the study.
    pub(super) fn count(&self) -> usize {
        if self.is_cut() {
            PARTS
        } else {
            self.imported.len()
        }
    }

    /// Number of episodes that are held out.
    pub(super) fn held_out(&self) -> usize {
        if self.is_cut() {
            1
        } else {
            self.imported.iter().filter(|i| i.test).count()
        }
    }

    /// What was written into the folder `home`, and the command that goes on with it.
    pub(super) fn written(&self, home: &Path) -> String {
        let home = home.display().to_string();
        format!(
            "wrote {home}: {}, {} of them held out; look at import.html, then: {}",
            count(self.count(), "episode"),
            self.held_out(),
            shell::line(["asid", "diagnose", &home])
        )
    }

    /// Writes the files into `folder`, whose final path is `home`.
    pub(super) fn write(&self, folder: &Path, home: &Path, page: &str) -> Result<()> {
        let model = if self.bare {
            let backend = &*self.subject.backend;
            let document = plain(backend, &self.subject.source, home)?;
            write_text(&folder.join("model.xml"), &document.xml)?;
            "model.xml".to_owned()
        } else {
            way(home, self.given).display().to_string()
        };
        let copied = self.copy || self.is_cut();
        let (train, test) = if copied {
            self.copies(folder)?
        } else {
            self.references(home)
        };
        let head = Head {
            model: &model,
            train: &train,
            test: &test,
        };
        let toml = |e: toml::ser::Error| Error::Failed(e.to_string());
        let mut text = toml::to_string(&head).map_err(toml)?;
        if copied {
            // Else the rate would decide, and rows of a slow log would be those of a fast one in ms.
            let time = ColumnMapping {
                unit: Some("s".into()),
                ..ColumnMapping::of("time")
            };
            let _ = write!(text, "\n{}\n", time.lines());
        } else {
            let settings = LogSettings {
                kind: self.settings.kind,
                topics: self.proposal.topics.clone(),
                ..LogSettings::default()
            };
            let log = toml::to_string(&LogPart { log: &settings }).map_err(toml)?;
            let _ = write!(text, "\n{log}");
            for mapping in self.proposal.mappings() {
                let _ = write!(text, "\n{}\n", mapping.lines());
            }
        }
        write_text(&folder.join("study.toml"), &text)?;
        write_text(&folder.join("import.html"), page)
    }

    /// References to the logs where they are.
    fn references(&self, home: &Path) -> (Vec<String>, Vec<String>) {
        let names = |test: bool| -> Vec<String> {
            let chosen = self.imported.iter().filter(|i| i.test == test);
            chosen.map(|i| reference(home, &i.path)).collect()
        };
        (names(false), names(true))
    }

    /// Copies of the episodes as files.
    fn copies(&self, folder: &Path) -> Result<(Vec<String>, Vec<String>)> {
        let (mut train, mut test) = (Vec::new(), Vec::new());
        let layout = &self.subject.plant.layout;
        for (i, (episode, held)) in episodes(self.imported).iter().enumerate() {
            let name = format!("{}_{i}.csv", if *held { "test" } else { "train" });
            episode.write_csv_with_start(&folder.join(&name), layout)?;
            if *held { &mut test } else { &mut train }.push(name);
        }
        Ok((train, test))
    }
}

/// The episodes of the study, each with whether it is held out: a single one is cut into parts.
pub(super) fn episodes(imported: &[Imported]) -> Vec<(Episode, bool)> {
    if let [Imported { episode, .. }] = imported {
        let end = |part: usize| episode.rows() * part / PARTS;
        let part = |k: usize| (episode.part(end(k)..end(k + 1)), k + 1 == PARTS);
        return (0..PARTS).map(part).collect();
    }
    let all = imported.iter();
    all.map(|one| (one.episode.clone(), one.test)).collect()
}

/// The path to a log from the study, with the episode of a dataset.
fn reference(home: &Path, log: &Path) -> String {
    let (file, episode) = asid_logs::open::split(log);
    let way = way(home, &file).display().to_string();
    match episode {
        Some(number) => format!("{way}#{number}"),
        None => way,
    }
}
