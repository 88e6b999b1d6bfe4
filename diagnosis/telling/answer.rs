//! Which effect: hypotheses with their probabilities, the verdict, and each effect with its values.

use asid_core::Result;

use super::remainder::remainder;
use super::units::units;
use super::{NO_GAP, Telling};
use crate::bench::Explanation;
use crate::ceiling::Left;
use crate::findings::trials;
use crate::result::{EffectResult, Gap, Group, HypothesisResult, Kind, Tolerance, Verdict};

/// Returns the effects of a verdict that are one law at several sites.
pub(super) fn groups(labels: &[String]) -> Vec<Group> {
    let mut all: Vec<Group> = Vec::new();
    for (effect, site) in labels.iter().filter_map(|l| l.split_once('@')) {
        match all.iter_mut().find(|g| g.effect == effect) {
            Some(group) => group.sites.push(site.to_owned()),
            None => all.push(Group {
                effect: effect.to_owned(),
                sites: vec![site.to_owned()],
            }),
        }
    }
    all.retain(|g| g.sites.len() > 1);
    all
}

/// Returns the tolerances that an explanation contains.
pub(super) fn tolerances(of: &Explanation) -> Vec<Tolerance> {
    let all = of.effects.iter().zip(&of.is_tolerance);
    let own = all.filter(|(_, is_tolerance)| **is_tolerance);
    own.map(|(e, _)| Tolerance {
        effect: e.name.clone(),
        site: e.site.clone(),
        parameters: e.values.iter().cloned().collect(),
    })
    .collect()
}

/// Adds the probability of an effect of a set that was only screened; it has no fitted values.
fn screened(all: &mut Vec<EffectResult>, label: &str, probability: f64) {
    match all.iter_mut().find(|e| e.label() == label) {
        Some(known) => known.probability += probability,
        None => {
            let (effect, site) = label.split_once('@').unwrap_or((label, ""));
            all.push(EffectResult {
                effect: effect.to_owned(),
                site: site.to_owned(),
                probability,
                ..EffectResult::default()
            });
        }
    }
}

impl Telling<'_> {
    /// Makes the verdict of a kind; `labels` are the effects of the best explanation.
    pub(super) fn verdict(
        &self,
        kind: Kind,
        labels: &[String],
        gap: &Gap,
        left: &[Left],
    ) -> Verdict {
        let j = self.judgement;
        let named = kind == Kind::Effects;
        let ambiguous = j.ambiguous.iter().map(|&i| j.hypotheses[i].labels.clone());
        Verdict {
            kind,
            effects: if named { labels.to_vec() } else { Vec::new() },
            probability: match kind {
                Kind::Unknown => j.unknown,
                Kind::None => j.best_explanation().probability,
                Kind::Effects => j.marginal(labels),
            },
            ambiguous_with: if named {
                ambiguous.collect()
            } else {
                Vec::new()
            },
            unexplained: gap.closed.map_or(0.0, |c| 1.0 - c),
            remainder: remainder(gap, kind, left),
        }
    }

    pub(super) fn hypotheses(&self) -> Vec<HypothesisResult> {
        let mut all: Vec<HypothesisResult> = self
            .judgement
            .hypotheses
            .iter()
            .map(|h| HypothesisResult {
                effects: if h.labels.is_empty() {
                    vec!["none".into()]
                } else {
                    h.labels.clone()
                },
                probability: h.probability,
            })
            .collect();
        all.push(HypothesisResult {
            effects: vec!["unknown".into()],
            probability: self.judgement.unknown,
        });
        all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        all
    }

    /// Returns the effects of the hypotheses, each as fitted in the most probable set that contains
    /// it.
    ///
    /// `moved` is how far the engine's own error moves each fitted value of the best.
    pub(super) fn effects(&self, identified: f64, moved: &[f64]) -> Result<Vec<EffectResult>> {
        let j = self.judgement;
        let mut all: Vec<EffectResult> = Vec::new();
        for (i, h) in j.hypotheses.iter().enumerate() {
            let Some(found) = self.found(i) else {
                continue;
            };
            let moved = if i == j.best { moved } else { &[] };
            let intervals = self.intervals(&found.explanation, moved);
            let fitted = found.explanation.effects.iter().zip(intervals);
            let named = fitted.zip(&found.explanation.is_tolerance);
            for ((effect, (intervals95, at_bound)), is_tolerance) in named {
                if *is_tolerance {
                    continue;
                }
                let known = all
                    .iter_mut()
                    .find(|e| e.effect == effect.name && e.site == effect.site);
                if let Some(known) = known {
                    known.probability += h.probability;
                    continue;
                }
                let alone = self.findings.found.iter().find(|f| {
                    f.candidates.len() == 1 && f.explanation.effects[0].label() == effect.label()
                });
                let gap_closed = match alone {
                    Some(f) if identified > NO_GAP => {
                        let trials = trials(self.candidates, &f.candidates, &f.explanation);
                        let of = &f.explanation;
                        let starts = of.held_starts.clone();
                        let held = self.held(&trials, &of.fit.point.theta, starts)?;
                        let (square, count) = self.rms(&held.residuals, None, None);
                        let r2 = square / f64::max(count, 1.0);
                        Some((1.0 - (r2 - 1.0) / (identified * identified - 1.0)).clamp(0.0, 1.0))
                    }
                    _ => None,
                };
                all.push(EffectResult {
                    effect: effect.name.clone(),
                    site: effect.site.clone(),
                    probability: h.probability,
                    gap_closed,
                    parameters: effect.values.iter().cloned().collect(),
                    units: units(self.bench, effect),
                    intervals95,
                    at_bound,
                });
            }
        }
        let screened_only = j.hypotheses.iter().filter(|h| h.found.is_none());
        for h in screened_only {
            for label in &h.labels {
                screened(&mut all, label, h.probability);
            }
        }
        all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_at_several_sites_is_a_group() {
        let labels = ["a@x", "a@y", "b@x", "gravity-tilt"].map(String::from);
        let want = Group {
            effect: "a".into(),
            sites: vec!["x".into(), "y".into()],
        };
        assert_eq!(groups(&labels), [want]);
    }
}
