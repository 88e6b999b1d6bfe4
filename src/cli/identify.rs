//! placeholder
/// Arguments.
#[derive(clap::Args)]
pub struct Arguments {}
/// Placeholder.
pub fn identify(_a: &Arguments) -> anyhow::Result<()> { Ok(()) }
