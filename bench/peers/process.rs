//! The Python process: each request and each answer is a line of JSON.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail};
use serde::de::DeserializeOwned;
use serde_json::Value;

/// Lines of the process' output that an error repeats.
const LAST_LINES: usize = 4;

/// A Python process that serves requests until it is dropped.
pub struct Python {
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
    said: PathBuf,
}

impl Python {
    /// Starts `program`; its other output goes to a file in `folder`.
    ///
    /// # Errors
    /// If it cannot be started.
    pub fn start(program: &Path, folder: &Path) -> Result<Self> {
        let said = folder.join("python.log");
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/serve.py");
        let mut child = Command::new(program)
            .arg(script)
            // Keeps compiled modules out of the repository.
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(File::create(&said)?)
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let requests = child.stdin.take().context("no way to the process")?;
        let answers = child.stdout.take().context("no way from the process")?;
        Ok(Self {
            child,
            requests,
            answers: BufReader::new(answers),
            said,
        })
    }

    /// Sends a request and waits for its answer.
    ///
    /// # Errors
    /// If the process has ended, answers with an error, or answers something else.
    pub fn ask<T: DeserializeOwned>(&mut self, request: &Value) -> Result<T> {
        let sent = writeln!(self.requests, "{request}").and_then(|()| self.requests.flush());
        let mut line = String::new();
        let read = self.answers.read_line(&mut line);
        if sent.is_err() || !read.is_ok_and(|n| n > 0) {
            bail!("the Python process ended: {}", self.last_lines());
        }
        let answer: Value = serde_json::from_str(&line).context("the Python process")?;
        if let Some(error) = answer.get("error").and_then(Value::as_str) {
            bail!("Python, asked for {}: {error}", request["do"]);
        }
        serde_json::from_value(answer).with_context(|| format!("Python's answer {line}"))
    }

    fn last_lines(&self) -> String {
        let text = std::fs::read_to_string(&self.said).unwrap_or_default();
        let lines: Vec<&str> = text.lines().collect();
        lines[lines.len().saturating_sub(LAST_LINES)..].join(" | ")
    }
}

impl Drop for Python {
    fn drop(&mut self) {
        // There is nothing to save, and an ended process need not be stopped.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
