//! Scores diagnoses of cases whose effect was withheld.

use std::collections::BTreeMap;
use std::path::Path;

use asid_core::{Error, Result};
use serde::{Deserialize, Serialize};

use crate::result::{DiagnosisResult, Kind};

/// What a case is.
#[derive(Clone, Debug, Deserialize)]
pub struct Label {
    /// Kind of machine.
    #[serde(default)]
    pub world: String,
    /// Effects at their sites; none for no effect; `unknown:…` for one of no catalogue.
    pub effects: Vec<String>,
    /// True values of the study's parameters.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
}

impl Label {
    /// Whether its effect is in no catalogue.
    #[must_use]
    pub fn is_unknown(&self) -> bool {
        self.effects.iter().any(|e| e.starts_with("unknown"))
    }
}

/// Reads `labels.json`.
///
/// # Errors
/// When the file is missing or wrong.
pub fn read_labels(path: &Path) -> Result<BTreeMap<String, Label>> {
    let fail = |message: String| Error::File {
        path: path.to_owned(),
        message,
    };
    let text = std::fs::read_to_string(path).map_err(|e| fail(e.to_string()))?;
    serde_json::from_str(&text).map_err(|e| fail(format!("is not labels: {e}")))
}

/// One case with its answer.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// Case.
    pub case: String,
    /// Kind of machine.
    pub world: String,
    /// What it is.
    pub truth: Vec<String>,
    /// What was said.
    pub verdict: Vec<String>,
    /// With which probability.
    pub probability: f64,
    /// Probability that was given to the truth.
    pub truth_probability: f64,
    /// Right by name or by physics.
    pub right: bool,
    /// Among the two most probable.
    pub top2: bool,
    /// In the verdict or in its ambiguity set.
    pub covered: bool,
    /// Sets in the ambiguity set, the verdict included.
    pub set_size: usize,
    /// Share of the gap closed.
    pub closed: Option<f64>,
    /// Gaps: nominal, identified, refined.
    pub gaps: [f64; 3],
    /// Largest relative error of the study's parameters.
    pub parameter_error: Option<f64>,
    /// Seconds taken.
    pub seconds: f64,
}

impl Answer {
    /// Compares a result with a label; `class` where both are the same physics.
    #[must_use]
    pub fn new(
        case: &str,
        result: &DiagnosisResult,
        label: &Label,
        class: bool,
        seconds: f64,
    ) -> Self {
        let truth = match &label.effects[..] {
            [] => vec!["none".to_owned()],
            _ if label.is_unknown() => vec!["unknown".to_owned()],
            effects => {
                let mut effects = effects.to_vec();
                effects.sort();
                effects
            }
        };
        let v = &result.verdict;
        let verdict = match v.kind {
            Kind::None => vec!["none".to_owned()],
            Kind::Unknown => vec!["unknown".to_owned()],
            Kind::Effects => v.effects.clone(),
        };
        let right = verdict == truth || class;
        let counted = |h: &&crate::result::HypothesisResult| {
            h.effects == truth || (right && h.effects == verdict)
        };
        let truth_probability = result
            .hypotheses
            .iter()
            .filter(counted)
            .map(|h| h.probability)
            .sum();
        let errors = result.parameters.iter().filter_map(|p| {
            let truth = label.parameters.get(&p.name)?;
            Some(((p.estimate - truth) / truth).abs())
        });
        Self {
            case: case.into(),
            world: label.world.clone(),
            probability: v.probability,
            truth_probability,
            right,
            top2: right || result.hypotheses.iter().take(2).any(|h| h.effects == truth),
            covered: right || v.ambiguous_with.contains(&truth),
            set_size: 1 + v.ambiguous_with.len(),
            closed: result.gap.closed,
            gaps: [
                result.gap.nominal,
                result.gap.identified,
                result.gap.refined,
            ],
            parameter_error: errors.fold(None, |a: Option<f64>, e| Some(a.map_or(e, |a| a.max(e)))),
            seconds,
            truth,
            verdict,
        }
    }
}

/// All cases with their figures; `result.json` of `withheld`.
#[derive(Clone, Debug, Serialize)]
pub struct Score {
    /// 1.
    pub schema: u32,
    /// Number of cases.
    pub cases: usize,
    /// Right by name or physics.
    pub right: usize,
    /// Truth among the two most probable.
    pub top2: usize,
    /// Truth in the verdict or its ambiguity set.
    pub covered: usize,
    /// Cases without effect that were given one, and cases without effect.
    pub false_alarms: [usize; 2],
    /// Unknown effects that were called so, and unknown effects.
    pub unknowns: [usize; 2],
    /// Median size of the ambiguity sets.
    pub set_size: f64,
    /// Median share of the gap closed, where an effect of the catalogue was listed.
    pub closed: Option<f64>,
    /// Median largest error of the study's parameters.
    pub parameter_error: Option<f64>,
    /// Mean squared error of the verdict's probability.
    pub brier: f64,
    /// Mean logarithm of the probability given to the truth.
    pub log_score: f64,
    /// The same of a guess by the cases' own frequencies.
    pub base_log_score: f64,
    /// Expected calibration error over five bins; biased upwards with few cases.
    pub calibration_error: f64,
    /// Longest case, s.
    pub slowest: f64,
    /// Counts of truth and verdict, by names without sites.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    /// Each case.
    pub answers: Vec<Answer>,
    /// Cases that the engine cannot simulate, with the reason; they count nowhere.
    pub left_out: BTreeMap<String, String>,
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| (values[(n - 1) / 2] + values[n / 2]) / 2.0)
}

/// Names without sites.
fn plain(effects: &[String]) -> String {
    let names: Vec<&str> = effects
        .iter()
        .map(|e| e.split('@').next().unwrap_or_default())
        .collect();
    names.join(" + ")
}

/// Least probability in a logarithm.
const FLOOR: f64 = 1e-6;

impl Score {
    /// Figures of some answers; `left_out` are cases without one, with the reason.
    #[must_use]
    pub fn of(answers: Vec<Answer>, left_out: BTreeMap<String, String>) -> Self {
        let n = answers.len().max(1) as f64;
        let count = |f: &dyn Fn(&Answer) -> bool| answers.iter().filter(|a| f(a)).count();
        let is = |names: &[String], what: &str| names == [what.to_owned()];
        let mut frequency: BTreeMap<String, f64> = BTreeMap::new();
        let mut confusion: BTreeMap<String, BTreeMap<String, usize>> = BTreeMap::new();
        for a in &answers {
            *frequency.entry(plain(&a.truth)).or_default() += 1.0 / n;
            let row = confusion.entry(plain(&a.truth)).or_default();
            let said = if a.right { &a.truth } else { &a.verdict };
            *row.entry(plain(said)).or_default() += 1;
        }
        let right = |a: &Answer| f64::from(u8::from(a.right));
        let mut calibration_error = 0.0;
        for bin in 0..5 {
            let low = f64::from(bin) / 5.0;
            let inside = |a: &&Answer| {
                a.probability > low && a.probability <= low + 0.2
                    || bin == 0 && a.probability == 0.0
            };
            let some: Vec<&Answer> = answers.iter().filter(inside).collect();
            let gap: f64 = some.iter().map(|a| a.probability - right(a)).sum();
            calibration_error += gap.abs() / n;
        }
        Self {
            schema: 1,
            cases: answers.len(),
            right: count(&|a| a.right),
            top2: count(&|a| a.top2),
            covered: count(&|a| a.covered),
            false_alarms: [
                count(&|a| is(&a.truth, "none") && !is(&a.verdict, "none")),
                count(&|a| is(&a.truth, "none")),
            ],
            unknowns: [
                count(&|a| is(&a.truth, "unknown") && is(&a.verdict, "unknown")),
                count(&|a| is(&a.truth, "unknown")),
            ],
            set_size: median(answers.iter().map(|a| a.set_size as f64).collect()).unwrap_or(0.0),
            closed: median(
                answers
                    .iter()
                    .filter(|a| !is(&a.truth, "none") && !is(&a.truth, "unknown"))
                    .filter_map(|a| a.closed)
                    .collect(),
            ),
            parameter_error: median(answers.iter().filter_map(|a| a.parameter_error).collect()),
            brier: answers
                .iter()
                .map(|a| (a.probability - right(a)).powi(2))
                .sum::<f64>()
                / n,
            log_score: answers
                .iter()
                .map(|a| a.truth_probability.max(FLOOR).ln())
                .sum::<f64>()
                / n,
            base_log_score: answers
                .iter()
                .map(|a| frequency[&plain(&a.truth)].ln())
                .sum::<f64>()
                / n,
            calibration_error,
            slowest: answers.iter().map(|a| a.seconds).fold(0.0, f64::max),
            confusion,
            answers,
            left_out,
        }
    }

    /// A line a case, the confusion matrix, the figures.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let percent = |x: Option<f64>| x.map_or("-".into(), |x| format!("{:.1} %", 100.0 * x));
        let mut lines = vec![format!(
            "{:10} {:5} {:46} {:46} {:>5} {:>3} {:>8} {:>8} {:>8} {:>7} {:>6}",
            "case",
            "right",
            "truth",
            "verdict",
            "p",
            "set",
            "ident.",
            "refined",
            "closed",
            "param.",
            "s"
        )];
        for a in &self.answers {
            lines.push(format!(
                "{:10} {:5} {:46} {:46} {:5.2} {:3} {:8.2} {:8.2} {:>8} {:>7} {:6.1}",
                a.case,
                if a.right { "yes" } else { "NO" },
                a.truth.join(" + "),
                a.verdict.join(" + "),
                a.probability,
                a.set_size,
                a.gaps[1],
                a.gaps[2],
                percent(a.closed),
                percent(a.parameter_error),
                a.seconds
            ));
        }
        for (case, why) in &self.left_out {
            lines.push(format!("{case:10} left out: {why}"));
        }
        lines.push(String::new());
        lines.push("truth -> verdict:".into());
        for (truth, row) in &self.confusion {
            let cells: Vec<String> = row.iter().map(|(v, n)| format!("{v} {n}")).collect();
            lines.push(format!("  {truth}: {}", cells.join(", ")));
        }
        lines.push(String::new());
        lines.push(format!(
            "right {} of {}, in the two most probable {}, covered by the ambiguity set {}",
            self.right, self.cases, self.top2, self.covered
        ));
        lines.push(format!(
            "false alarms {} of {}, unknowns found {} of {}",
            self.false_alarms[0], self.false_alarms[1], self.unknowns[0], self.unknowns[1]
        ));
        lines.push(format!(
            "medians: ambiguity set {}, gap closed {}, error of the study's parameters {}",
            self.set_size,
            percent(self.closed),
            percent(self.parameter_error)
        ));
        lines.push(format!(
            "Brier {:.3}, log score {:.3} (base rate {:.3}), calibration error {:.3}, slowest {:.1} s",
            self.brier, self.log_score, self.base_log_score, self.calibration_error, self.slowest
        ));
        lines
    }
}
