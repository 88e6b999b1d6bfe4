//! A problem of a reader, and the file that reproduces it.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// How a reader failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// `panic`, `caught`, `memory`, `message`, `hang` or `abort`.
    pub kind: String,
    /// Number of the input.
    pub index: u64,
    /// Description in one line.
    pub message: String,
}

impl Finding {
    /// Key that findings of one fault share: their kind, and their message without its numbers.
    #[must_use]
    pub fn fault(&self) -> String {
        let place = self.message.rsplit_once(" at ").map_or("", |(_, p)| p);
        let told = if place.is_empty() {
            let letters = self.message.chars().filter(|c| !c.is_ascii_digit());
            letters.take(60).collect()
        } else {
            place.to_owned()
        };
        format!("{}: {told}", self.kind)
    }

    /// The finding as a line of the child's report.
    #[must_use]
    pub fn line(&self) -> String {
        format!("finding {} {} {}", self.kind, self.index, self.message)
    }

    /// Parses such a line.
    #[must_use]
    pub fn of_line(line: &str) -> Option<Self> {
        let mut parts = line.strip_prefix("finding ")?.splitn(3, ' ');
        Some(Self {
            kind: parts.next()?.to_owned(),
            index: parts.next()?.parse().ok()?,
            message: parts.next().unwrap_or_default().to_owned(),
        })
    }

    /// Writes the input, and beside it the problem and how to reproduce it.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn keep(&self, folder: &Path, reader: &str, seed: u64, input: &[u8]) -> Result<PathBuf> {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let file = folder.join(format!("{reader}-{seed}-{}", self.index));
        fs::write(&file, input).with_context(|| file.display().to_string())?;
        let note = format!(
            "{}: {}\ncargo xtask fuzz {reader} --seed {seed} --from {} --inputs 1\n",
            self.kind, self.message, self.index
        );
        let beside = folder.join(format!("{reader}-{seed}-{}.txt", self.index));
        fs::write(&beside, note).with_context(|| beside.display().to_string())?;
        Ok(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_reads_back_from_its_line() {
        let finding = Finding {
            kind: "panic".into(),
            index: 12,
            message: "index 3 out of range at logs/open.rs:7".into(),
        };
        assert_eq!(Finding::of_line(&finding.line()), Some(finding.clone()));
        assert_eq!(finding.fault(), "panic: logs/open.rs:7");
        assert_eq!(Finding::of_line("state 3 4"), None);
    }
}
