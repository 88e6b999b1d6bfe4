//! Writes and prints scores.

use std::io::Write as _;

use anyhow::Result;
use asid_core::Error;
use asid_scorer::board::Score;
use asid_scorer::{lines, page};
use serde::Serialize;

use super::control::Control;
use super::method::{Asked, Method};
use super::score::Session;
use crate::cli::output::{replace_file, write_json, write_text};
use crate::cli::result::Program;

/// `result.json`.
#[derive(Serialize)]
struct Output<'a> {
    #[serde(flatten)]
    score: &'a Score,
    /// Name of the control by which the check was spoilt on purpose.
    control: Option<&'static str>,
    limit: Option<f64>,
    seed: u64,
    without: &'a [String],
    backend: &'a str,
    /// Scores of the other methods on the same cases.
    others: &'a [Score],
    versions: Program,
}

impl Session<'_> {
    /// Writes and prints the scores; the first method's come first.
    pub fn write(&self, scores: &[Score]) -> Result<()> {
        let arguments = self.arguments;
        let Some((score, others)) = scores.split_first() else {
            return Ok(());
        };
        let asked = Asked::new(Method::Diagnose, arguments);
        let output = Output {
            score,
            control: arguments.control.map(Control::name),
            limit: arguments.limit,
            seed: arguments.common.seed.unwrap_or(0),
            without: &arguments.without,
            backend: &asked.backend,
            others,
            versions: Program::THIS,
        };
        // Files of cases and of controls lie side by side; a score is rewritten as a whole.
        let stem = arguments.control.map_or("", Control::name);
        let named = |name: &str| match stem {
            "" => self.out.join(name),
            stem => self.out.join(format!("{stem}-{name}")),
        };
        let about = page::About {
            command: crate::cli::run::command_line(),
            engine: format!("{} {}", self.backend.name(), self.backend.version()),
            control: arguments.control.map(Control::expects),
            limit: arguments.limit,
        };
        std::fs::create_dir_all(&self.out).map_err(|e| {
            Error::Failed(format!("{}: cannot be written: {e}", self.out.display()))
        })?;
        replace_file(&named("report.html"), |file| {
            write_text(file, &page::page(scores, &about))
        })?;
        replace_file(&named("result.json"), |file| write_json(file, &output))?;
        let mut stdout = std::io::stdout().lock();
        if arguments.common.json {
            writeln!(stdout, "{}", serde_json::to_string_pretty(&output)?)?;
        } else {
            for line in lines::lines(scores) {
                writeln!(stdout, "{line}")?;
            }
            if let Some(control) = arguments.control {
                writeln!(stdout, "control: {}", control.expects())?;
            }
            writeln!(stdout, "results: {}", named("report.html").display())?;
        }
        Ok(())
    }
}
