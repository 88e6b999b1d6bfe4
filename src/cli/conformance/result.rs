//! The result of a call of `asid conformance`, and whether it is good.

use anyhow::Result;
use asid_conformance::{Outcome, Row};
use asid_core::Error;
use serde::Serialize;

use crate::cli::result::Program;

/// What is known of an engine besides its rows.
#[derive(Serialize)]
pub struct Engine {
    pub name: String,
    pub version: String,
    pub origin: String,
    pub claims: Vec<&'static str>,
    pub lacks: Vec<&'static str>,
    #[serde(flatten)]
    pub count: Count,
}

/// Number of an engine's rows by outcome.
#[derive(Clone, Copy, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub struct Count {
    pub pass: usize,
    pub fail: usize,
    pub known_deviation: usize,
    pub not_claimed: usize,
}

impl Count {
    pub fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Self {
        let mut count = Self::default();
        for row in rows {
            *match row.outcome {
                Outcome::Pass => &mut count.pass,
                Outcome::Fail => &mut count.fail,
                Outcome::KnownDeviation => &mut count.known_deviation,
                Outcome::NotClaimed => &mut count.not_claimed,
            } += 1;
        }
        count
    }
}

/// `result.json`.
#[derive(Serialize)]
pub struct ConformanceResult {
    pub schema: u32,
    pub rows: Vec<Row>,
    pub engines: Vec<Engine>,
    pub versions: Program,
}

/// The counts of an engine's rows as a sentence.
pub fn sentence(engine: &Engine) -> String {
    let count = engine.count;
    format!(
        "{}: {} pass, {} fail, {} known deviations, {} not claimed",
        engine.name, count.pass, count.fail, count.known_deviation, count.not_claimed
    )
}

/// Returns an error if a row fails.
pub fn verdict(result: &ConformanceResult) -> Result<()> {
    let failing: Vec<&Row> = result.rows.iter().filter(|row| row.is_failure()).collect();
    if failing.is_empty() {
        return Ok(());
    }
    let first = failing.iter().take(5);
    let named: Vec<String> = first
        .map(|row| format!("{} on {}", row.check, row.engine))
        .collect();
    let shown = named.join(", ");
    let more = match failing.len().saturating_sub(5) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    if let [row] = &failing[..]
        && !row.note.is_empty()
    {
        return Err(Error::Failed(format!("1 check fails: {shown}: {}", row.note)).into());
    }
    let word = if failing.len() == 1 {
        "check fails"
    } else {
        "checks fail"
    };
    Err(Error::Failed(format!("{} {word}: {shown}{more}", failing.len())).into())
}
