//! Stored answers. Each finished case has a folder, which also states what the answer depends on.

use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::child::{self, Ended, Stop};
use super::isolate::{self, Treatment, hex};
use super::method::{self, Asked};
use crate::cli::output::staging::Staging;
use crate::cli::output::write_json;

/// The file that marks a case as done.
const RUN: &str = "run.json";
/// The files of an answer that are kept; the others repeat the logs.
const KEPT: [&str; 3] = ["result.json", "refined.toml", "evidence.json"];

/// How a case was answered; `run.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Kept {
    /// Version of the layout: 1.
    schema: u32,
    /// SHA-256 of what the answer depends on: the program, the call, the study's files.
    key: String,
    /// The call.
    call: Vec<String>,
    /// Wall time, s.
    pub seconds: f64,
    /// Largest memory, MiB.
    pub memory_mib: Option<f64>,
    /// Why there is no answer; `None` if there is one.
    pub failure: Option<String>,
    /// The time limit that ended it, s.
    limit: Option<f64>,
}

impl Kept {
    fn read(folder: &Path) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join(RUN)).ok()?;
        serde_json::from_str(&text).ok()
    }

    /// What a folder holds, whatever made it, judged under a time limit.
    pub fn at(folder: &Path, limit: Option<f64>) -> Option<Self> {
        let mut kept = Self::read(folder)?;
        if let Some(limit) = limit.filter(|limit| kept.seconds > *limit) {
            kept.failure = Some(format!("over the limit of {limit} s"));
        }
        Some(kept)
    }

    /// Whether a new run would give the same: it has the same `key`, and no smaller limit than the
    /// present one ended it.
    fn stands(&self, key: &str, limit: Option<f64>) -> bool {
        let longer = |old: f64| limit.is_none_or(|new| new > old);
        self.key == key && !self.limit.is_some_and(longer)
    }
}

/// Where and how answers are made.
pub struct Maker<'a> {
    pub asked: Asked,
    pub treatment: Treatment,
    pub limit: Option<f64>,
    /// Digest of the program.
    pub program: &'a str,
    /// Folder of the cases' folders.
    pub into: &'a Path,
    pub stop: &'a Stop,
}

/// Digest of the running program: another build may answer otherwise.
pub fn program() -> Result<String> {
    let fail = |e: std::io::Error| Error::Failed(format!("this program cannot read itself: {e}"));
    let bytes = std::fs::read(method::program()?).map_err(fail)?;
    Ok(hex(&Sha256::digest(bytes)))
}

impl Maker<'_> {
    /// Folder of a case.
    pub fn folder(&self, case: &str) -> PathBuf {
        self.into.join(case)
    }

    /// Answers a case unless that is done already; returns whether it was.
    pub fn make(&self, case: &str, study: &Path) -> Result<bool> {
        let folder = self.folder(case);
        let key = self.key(study)?;
        if Kept::read(&folder).is_some_and(|kept| kept.stands(&key, self.limit)) {
            return Ok(true);
        }
        let failed = |path: &Path, e: &std::io::Error| {
            Error::Failed(format!("{}: cannot be written: {e}", path.display()))
        };
        // The process sees the study and a place for its answer, nothing else.
        let place = tempfile::tempdir().map_err(|e| failed(Path::new("a temporary folder"), &e))?;
        isolate::copy(study, &place.path().join("study"), self.treatment)?;
        let mut command = self.asked.command("study", "answer")?;
        let ended = child::run(&mut command, place.path(), self.limit, self.stop)?;
        let staging = Staging::new_in(self.into).map_err(|e| failed(self.into, &e))?;
        let content = staging.content();
        for name in KEPT {
            let made = place.path().join("answer").join(name);
            if made.is_file() && ended.failure.is_none() {
                std::fs::copy(&made, content.join(name)).map_err(|e| failed(&content, &e))?;
            }
        }
        write_json(&content.join(RUN), &self.kept(key, ended))?;
        staging.replace(&folder).map_err(|e| failed(&folder, &e))?;
        Ok(false)
    }

    fn kept(&self, key: String, ended: Ended) -> Kept {
        Kept {
            schema: 1,
            key,
            call: self.asked.arguments("study", "answer"),
            seconds: ended.seconds,
            memory_mib: ended.memory_mib,
            failure: ended.failure,
            limit: self.limit.filter(|_| ended.over_limit),
        }
    }

    fn key(&self, study: &Path) -> Result<String> {
        let mut hash = Sha256::new();
        let call = self.asked.arguments("study", "answer");
        let treatment = format!("{:?}", self.treatment);
        let parts = [self.program.to_owned(), isolate::digest(study)?, treatment];
        for part in parts.iter().chain(&call) {
            hash.update((part.len() as u64).to_le_bytes());
            hash.update(part.as_bytes());
        }
        Ok(hex(&hash.finalize()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_stands_for_its_key_and_a_limit_no_larger_than_its_own() {
        let kept = |seconds: f64, limit: Option<f64>| Kept {
            schema: 1,
            key: "a".into(),
            call: Vec::new(),
            seconds,
            memory_mib: None,
            failure: None,
            limit,
        };
        // An answer is valid under any limit, and counts as too late under a shorter one.
        assert!(kept(3.0, None).stands("a", Some(1.0)) && !kept(3.0, None).stands("b", None));
        // Ended at 10 s: nothing is known about longer limits.
        let ended = kept(10.0, Some(10.0));
        assert!(ended.stands("a", Some(5.0)) && ended.stands("a", Some(10.0)));
        assert!(!ended.stands("a", Some(20.0)) && !ended.stands("a", None));
    }
}
