//! Sensitivity of stored answers to the numbers that decide. Each number is halved and doubled, and
//! the decision is repeated without any replay.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use asid_core::Error;
use asid_diagnosis::confidence::{Refitted, refit};
use asid_diagnosis::decision::{Rules, decide};
use asid_diagnosis::judgement::Claim;
use asid_results::evidence::Evidence;
use asid_scorer::answer::Answer;
use asid_scorer::judge::Judge;
use asid_scorer::label::Label;
use asid_scorer::physics;
use asid_scorer::sites::Sites;
use serde::Serialize;

use crate::cli::output::write_json;

/// A case whose decision can be repeated.
pub struct Stored<'a> {
    label: &'a Label,
    sites: Sites,
    answer: Answer,
    evidence: Evidence,
}

/// The result of deciding all cases by some rules.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Tally {
    /// Verdicts whose names are right.
    right: usize,
    /// Verdicts that differ from those of the unchanged rules.
    changed: usize,
    /// Mean log-probability of the true set; the probability counts as at least 0.001.
    log_score: f64,
}

/// A rule, and the results at other values of it.
#[derive(Debug, Serialize)]
struct Row {
    rule: &'static str,
    value: f64,
    halved: Tally,
    doubled: Tally,
}

/// A confidence that was fitted to the answers.
#[derive(Debug, Serialize)]
struct Fitted {
    verdicts: usize,
    holds: usize,
    log_score_before: f64,
    log_score: f64,
    named: f64,
    evidence: f64,
    stopped: f64,
    gap_left: f64,
    more_laws: f64,
}

impl From<Refitted> for Fitted {
    fn from(of: Refitted) -> Self {
        let [named, evidence, stopped, gap_left, more_laws] = of.numbers;
        Self {
            verdicts: of.verdicts,
            holds: of.holds,
            log_score_before: of.log_score_before,
            log_score: of.log_score,
            named,
            evidence,
            stopped,
            gap_left,
            more_laws,
        }
    }
}

impl Fitted {
    fn line(&self) -> String {
        format!(
            "confidence fitted to {} named verdicts, {} of them right (log score {:.2}, {:.2} before): named {:.2}, evidence {:.2}, stopped {:.2}, \
             gap_left {:.2}, more_laws {:.2}",
            self.verdicts,
            self.holds,
            self.log_score,
            self.log_score_before,
            self.named,
            self.evidence,
            self.stopped,
            self.gap_left,
            self.more_laws
        )
    }
}

/// `sensitivity.json`.
#[derive(Debug, Serialize)]
struct Output {
    schema: u32,
    cases: usize,
    as_is: Tally,
    rows: Vec<Row>,
    /// The confidence fitted to these answers, where any of them names something.
    refitted: Option<Fitted>,
}

impl<'a> Stored<'a> {
    /// The stored answer of a case; `None` where there is none.
    pub fn read(folder: &Path, study: &Path, label: &'a Label) -> Option<Self> {
        let text = std::fs::read_to_string(folder.join("evidence.json")).ok()?;
        Some(Self {
            label,
            sites: physics::sites_of(study).unwrap_or_default(),
            answer: Answer::read(&folder.join("result.json")).ok()?,
            evidence: serde_json::from_str(&text).ok()?,
        })
    }

    /// The claim of the verdict by some rules, and whether it is right by its names.
    ///
    /// A set that the logs cannot distinguish from the verdict counts as well. `None` where the
    /// verdict names nothing.
    fn claimed(&self, rules: &Rules, catalogue: &BTreeSet<String>) -> Option<(Claim, bool)> {
        let judgement = decide(&self.evidence, rules);
        let claim = judgement.claim?;
        let judge = Judge {
            label: self.label,
            sites: &self.sites,
            catalogue,
        };
        let verdict = judge.claims_hold(
            &self.answer,
            judge.of_set(&self.answer.verdict.effects, &self.answer),
        );
        let alike = judgement
            .ambiguous
            .iter()
            .map(|&i| &judgement.hypotheses[i].labels);
        let is_true = |labels: &Vec<String>| judge.of_set(labels, &self.answer).is_right();
        Some((claim, verdict || { alike }.any(is_true)))
    }

    /// The set of the verdict by some rules, whether its names are right, and the log-probability
    /// of the true set.
    fn decided(&self, rules: &Rules, catalogue: &BTreeSet<String>) -> (Vec<String>, bool, f64) {
        let judgement = decide(&self.evidence, rules);
        let verdict = judgement.best_explanation();
        let set = match (judgement.is_unknown, verdict.labels.is_empty()) {
            (true, _) => vec!["unknown".to_owned()],
            (_, true) => vec!["none".to_owned()],
            _ => verdict.labels.clone(),
        };
        let judge = Judge {
            label: self.label,
            sites: &self.sites,
            catalogue,
        };
        let right = judge.of_set(&set, &self.answer).is_right();
        let truth = judge.truth();
        let is_true = |labels: &[String]| match labels {
            [] => truth == ["none"],
            labels => judge.of_set(labels, &self.answer).is_right(),
        };
        let all = judgement.hypotheses.iter();
        let mut p: f64 = all
            .filter(|h| is_true(&h.labels))
            .map(|h| h.probability)
            .sum();
        if truth == ["unknown"] {
            p = judgement.unknown;
        }
        (set, right, p.max(LEAST).ln())
    }
}

/// Least probability that is scored, so that one miss does not outweigh all else.
const LEAST: f64 = 1e-3;

/// Repeats the decisions of stored answers with each number halved and doubled.
pub fn sensitivity(all: &[Stored<'_>], catalogue: &BTreeSet<String>, out: &Path) -> Result<()> {
    if all.is_empty() {
        return Err(Error::Config {
            key: "--sensitivity".into(),
            message: "no answer in --out has an evidence.json: answer the cases first".into(),
        }
        .into());
    }
    let as_is = Rules::default();
    let base: Vec<_> = all.iter().map(|s| s.decided(&as_is, catalogue)).collect();
    let tally = |rules: &Rules| {
        let mut t = Tally::default();
        for (stored, before) in all.iter().zip(&base) {
            let (set, right, log) = stored.decided(rules, catalogue);
            t.right += usize::from(right);
            t.changed += usize::from(set != before.0);
            t.log_score += log / all.len() as f64;
        }
        t
    };
    let rows = Rules::ALL.into_iter().map(|(rule, field)| {
        let times = |factor: f64| {
            let mut rules = as_is.clone();
            *field(&mut rules) *= factor;
            tally(&rules)
        };
        Row {
            rule,
            value: *field(&mut as_is.clone()),
            halved: times(0.5),
            doubled: times(2.0),
        }
    });
    let claims = all.iter().filter_map(|s| s.claimed(&as_is, catalogue));
    let output = Output {
        schema: 1,
        cases: all.len(),
        as_is: tally(&as_is),
        rows: rows.collect(),
        refitted: refit(&as_is.confidence, &claims.collect::<Vec<_>>()).map(Fitted::from),
    };
    write_json(&out.join("sensitivity.json"), &output)?;
    let mut stdout = std::io::stdout().lock();
    for line in lines(&output) {
        writeln!(stdout, "{line}")?;
    }
    writeln!(
        stdout,
        "results: {}",
        out.join("sensitivity.json").display()
    )?;
    Ok(())
}

/// The table, as Markdown.
fn lines(output: &Output) -> Vec<String> {
    let base = &output.as_is;
    let mut lines = vec![
        format!(
            "{} decisions repeated; as they are {} right by name, log score {:.2}",
            output.cases, base.right, base.log_score
        ),
        "| number | value | halved: right (changed) | log score | doubled: right (changed) | log score |".to_owned(),
        "|---|--:|--:|--:|--:|--:|".to_owned(),
    ];
    lines.extend(output.rows.iter().map(|r| {
        let part = |t: &Tally| format!("{} ({}) | {:.2}", t.right, t.changed, t.log_score);
        format!(
            "| {} | {} | {} | {} |",
            r.rule,
            r.value,
            part(&r.halved),
            part(&r.doubled)
        )
    }));
    lines.extend(output.refitted.as_ref().map(Fitted::line));
    lines
}
