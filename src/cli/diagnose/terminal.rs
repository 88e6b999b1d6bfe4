//! The answer of a diagnosis on the terminal.

use asid_report::diagnosis::{effect_values, real_world_lines};
use asid_report::number::{Precision, quantity};
use asid_results::diagnosis::DiagnosisResult;
use asid_results::naming::{count, grouped};
use asid_results::trace::DiagnosisTrace;

/// The answer as lines for the terminal.
pub fn lines(
    (result, trace): (&DiagnosisResult, &DiagnosisTrace),
    engine: &str,
    seconds: f64,
) -> Vec<String> {
    let mut all = Vec::new();
    let mut line = |text: &str| all.push(text.to_owned());
    line(&result.sentence);
    for text in result.wiring.iter().flat_map(|w| w.mend.lines()) {
        line(&format!("  {text}"));
    }
    let gap = &result.gap;
    line(&format!(
        "gap on logs held out, in units of the noise: {:.2} as given, {:.2} identified, {:.2} refined",
        gap.nominal, gap.identified, gap.refined
    ));
    for h in result
        .hypotheses
        .iter()
        .take(4)
        .filter(|h| h.probability > 0.001)
    {
        line(&format!(
            "  {:5.1} %  {}",
            100.0 * h.probability,
            grouped(&h.effects).join(" + ")
        ));
    }
    for e in result
        .effects
        .iter()
        .filter(|e| result.verdict.effects.contains(&e.label()))
    {
        let values = effect_values(trace, e).replace('\u{a0}', " ");
        line(&format!("  {} {}: {values}", e.effect, e.site));
    }
    for p in &result.parameters {
        let estimate = Precision::of(p.estimate, p.std).with_uncertainty(p.estimate, p.std);
        let told = quantity(&estimate, &p.unit).replace('\u{a0}', " ");
        line(&format!("  {} = {told}", p.name));
    }
    if let Some(c) = &result.calibration {
        line(&format!(
            "calibration on simulated logs, {}:",
            count(c.runs, "run")
        ));
        for r in c.rows.iter().filter(|r| r.runs > 0) {
            let lacks = if r.effects.is_empty() {
                "nothing".to_owned()
            } else {
                grouped(&r.effects).join(" + ")
            };
            line(&format!(
                "  lacking {lacks}: {} of {} right",
                r.right, r.runs
            ));
        }
        if let Some(p) = c.probability {
            line(&format!(
                "  by these runs the answer is right with probability {:.0} %",
                100.0 * p
            ));
        }
    }
    for left in &result.not_tried {
        line(&format!("not tried: {}", left.stage));
    }
    if !result.next_experiment.how.is_empty() {
        let next = &result.next_experiment;
        let file = match &*next.file {
            "" => String::new(),
            file => format!(" (commands: {file})"),
        };
        line(&format!("next: {}{file}", next.how));
    }
    line(&format!("{engine}, {seconds:.1} s"));
    all.extend(result.real_world.iter().flat_map(real_world_lines));
    all
}
