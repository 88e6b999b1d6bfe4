//! `cargo xtask deny`: licences, versions, sources and advisories of the dependencies, by `cargo deny` and `deny.toml`.

use std::process::{Command, Stdio};

use anyhow::Result;

use crate::library::repository;
use crate::stage::Stages;

/// Runs the checks; a machine without the program is told so, and that is no failure.
pub fn run() -> Result<bool> {
    let mut stages = Stages::default();
    stage(&mut stages)?;
    Ok(stages.finish())
}

/// Adds the checks to others. Advisories are a stage of their own: their database is the one that the program finds by
/// default, and where it finds none they are left out.
pub fn stage(stages: &mut Stages) -> Result<()> {
    if !succeeds(&["--version"]) {
        let reason = "no `cargo deny` here; `cargo install --locked cargo-deny` brings it";
        stages.leave_out("deny", reason);
        return Ok(());
    }
    let check = ["deny", "check", "licenses", "bans", "sources"];
    stages.cargo("deny", &check, &[])?;
    if succeeds(&["fetch", "db"]) {
        let check = ["deny", "check", "--disable-fetch", "advisories"];
        stages.cargo("deny, advisories", &check, &[])?;
    } else {
        stages.leave_out("deny, advisories", "their database cannot be fetched");
    }
    Ok(())
}

/// Whether a call of the program ends well, whatever it says.
fn succeeds(arguments: &[&str]) -> bool {
    let status = Command::new("cargo")
        .arg("deny")
        .args(arguments)
        .current_dir(repository())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|s| s.success())
}
