//! placeholder
/// Arguments.
#[derive(clap::Args)]
pub struct Arguments {}
/// Placeholder.
pub fn compare(_a: &Arguments) -> anyhow::Result<()> { Ok(()) }
