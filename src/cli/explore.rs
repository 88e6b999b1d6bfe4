//! placeholder
/// Arguments.
#[derive(clap::Args)]
pub struct Arguments {}
/// Placeholder.
pub fn explore(_a: &Arguments) -> anyhow::Result<()> { Ok(()) }
