//! `asid compare --train`: what learns is trained once for its task, engine and settings, and the
//! cells load it.
//!
//! A training has a folder of its own below `policies/`, which gets its name when the training is
//! done. Trainings are deterministic, so if two processes trained the same, either result may stay.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use asid_comparison::cell::CellKey;
use asid_comparison::plan::MATCHED;
use asid_comparison::settings::{digest, name_contents};
use asid_comparison::store::{Store, unique, write};
use asid_core::registry::{ExplorerEntry, IdentifierEntry, find};
use asid_core::{Error, Explorer};

use super::arm::Arm;
use super::cell::open;
use super::folder::TRAINED;
use crate::cli::failure;
use crate::cli::session::Session;

/// File of a trained explorer in its folder.
const POLICY: &str = "policy.safetensors";
/// File of a trained identifier in its folder.
const NETWORK: &str = "network.safetensors";

/// Trains arms into a comparison's folder.
pub struct Trainer<'t> {
    /// The folder.
    pub store: &'t Store,
    /// Seed of every training.
    pub seed: u64,
    /// Threads of a training; one a core where not given.
    pub threads: Option<usize>,
    /// Whether to print nothing.
    pub quiet: bool,
}

impl Trainer<'_> {
    /// Trains what the arm's method learns, unless it is there already. Returns the settings that
    /// load it.
    ///
    /// # Errors
    /// When a training fails or its files cannot be written.
    pub fn train(&self, arm: &Arm, key: &CellKey) -> Result<Vec<(String, String)>> {
        let mut arm = arm.clone();
        let mut settings = Vec::new();
        if !arm.method.explores() {
            return Ok(settings);
        }
        // Training depends neither on the real world nor on the condition.
        arm.common.set.retain(|s| !s.starts_with("real.world="));
        arm.common.threads = self.threads;
        arm.common.quiet = self.quiet;
        let key = CellKey {
            condition: crate::cli::settings::PRIOR.to_owned(),
            world: MATCHED.to_owned(),
            seed: self.seed,
            ..key.clone()
        };
        let session = open(&arm, &key)?;
        let own = self.own(&session, &["explorer"])?;
        let learner = explorer(&session)?;
        let policy = self.once(
            &session,
            &session.config.explorer.name,
            &own,
            POLICY,
            |file| learner.train(&session.problem(), file),
        )?;
        if let Some(file) = policy {
            let setting = ("explorer.policy".to_owned(), file.display().to_string());
            arm.common
                .set
                .push(format!("{}={:?}", setting.0, setting.1));
            settings.push(setting);
        }
        if arm.method.identifies() {
            // The identifier learns from episodes of the explorer with its current settings.
            let session = open(&arm, &key)?;
            let own = self.own(&session, &["explorer", "identifier"])?;
            let player = explorer(&session)?;
            let component = &session.config.identifier;
            let identifier = (find::<IdentifierEntry>(&component.name)?.make)(&component.settings)?;
            let network = self.once(&session, &component.name, &own, NETWORK, |file| {
                identifier.train(&session.problem(), &*player, file)
            })?;
            settings.extend(
                network.map(|f| ("identifier.network".to_owned(), f.display().to_string())),
            );
        }
        Ok(settings)
    }

    /// Digest of what determines a training: the settings of these parts, the simulator and the
    /// unknowns.
    ///
    /// Files count by their content, so that a comparison whose folder was moved trains nothing
    /// again.
    fn own(&self, session: &Session, parts: &[&str]) -> Result<String> {
        let mut table = toml::Table::try_from(&session.config)?;
        for section in [
            "explorer",
            "identifier",
            "solver",
            "real",
            "condition",
            "plugins",
        ] {
            if !parts.contains(&section) {
                table.remove(section);
            }
        }
        name_contents(&mut table);
        Ok(digest(table.to_string().as_bytes()))
    }

    /// The file of a training, which is run if the file is missing; `None` where nothing is
    /// learned.
    fn once(
        &self,
        session: &Session,
        name: &str,
        own: &str,
        file: &str,
        train: impl FnOnce(&Path) -> asid_core::Result<bool>,
    ) -> Result<Option<PathBuf>> {
        let config = &session.config;
        let folder = format!("{}.{}.{name}.{own}", config.task, config.backend);
        let place = self.store.policies().join(&folder);
        if place.join(TRAINED).is_file() {
            return Ok(Some(place.join(file)));
        }
        let partial = self
            .store
            .policies()
            .join(format!(".{folder}.{}", unique()));
        let failed = |e: std::io::Error| {
            Error::Failed(format!("{}: cannot be written: {e}", place.display()))
        };
        std::fs::create_dir_all(&partial).map_err(failed)?;
        let clock = Instant::now();
        let learned = train(&partial.join(file));
        if !matches!(learned, Ok(true)) {
            let _ = std::fs::remove_dir_all(&partial);
            return Ok(learned.map(|_| None)?);
        }
        let wall_s = clock.elapsed().as_secs_f64();
        write(&partial.join(TRAINED), &format!("{wall_s:.1}\n"))?;
        if std::fs::rename(&partial, &place).is_err() {
            // Another process has finished the same training meanwhile.
            let _ = std::fs::remove_dir_all(&partial);
        }
        if !place.join(TRAINED).is_file() {
            return Err(Error::Failed(format!("{}: cannot be written", place.display())).into());
        }
        if !self.quiet {
            failure::note(&format!(
                "trained {name} for {} in {wall_s:.0} s",
                config.task
            ));
        }
        Ok(Some(place.join(file)))
    }
}

fn explorer(session: &Session) -> Result<Box<dyn Explorer>> {
    let component = &session.config.explorer;
    Ok((find::<ExplorerEntry>(&component.name)?.make)(
        &component.settings,
    )?)
}
