//! Kills commands.
use anyhow::Result;
/// Arguments of `kill`.
#[derive(clap::Args)]
pub struct Arguments {}
pub fn kill(_: &Arguments) -> Result<bool> {
    Ok(true)
}
