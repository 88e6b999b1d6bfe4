//! Decides whether an answer is right.
//!
//! A verdict is right if it names the true set of effects, another set that the label accepts, or a
//! set that the scorer finds to be the same physics. It may name listed dirt in addition. In a
//! world without a cause only `none` is right, or listed dirt if there is some. `unknown` in such a
//! dirty world is neither right nor wrong, because the deviations there have no single name. If the
//! catalogue lacks the cause, `unknown` is right.

use std::collections::BTreeSet;

use serde::Serialize;

use crate::answer::Answer;
use crate::dirt;
use crate::label::{Label, name_of};
use crate::sites::Sites;
use crate::wiring::named_by_mending;

/// Standing of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// It names the true set.
    Right,
    /// It names another set that the label accepts.
    Acceptable,
    /// It names listed dirt in a world without a cause.
    Dirt,
    /// It names a set that is the same physics in these logs.
    SamePhysics,
    /// It says `unknown` of a cause that the catalogue lacks.
    OutOfCatalogue,
    /// It says `unknown` in a dirty world without a cause: counted separately.
    Apart,
    /// Any other answer.
    Wrong,
    /// There is no answer: an error, or the time limit.
    NoAnswer,
    /// It gives no name for what is missing: neither right nor wrong.
    NamesNothing,
}

impl Standing {
    /// Whether it counts as right.
    #[must_use]
    pub fn is_right(self) -> bool {
        !matches!(
            self,
            Self::Apart | Self::Wrong | Self::NoAnswer | Self::NamesNothing
        )
    }

    /// Whether it counts at all.
    #[must_use]
    pub fn counts(self) -> bool {
        self != Self::Apart
    }

    /// A word for tables.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Acceptable => "accepted",
            Self::Dirt => "dirt",
            Self::SamePhysics => "same",
            Self::OutOfCatalogue => "unlisted",
            Self::Apart => "apart",
            Self::Wrong => "WRONG",
            Self::NoAnswer => "NONE",
            Self::NamesNothing => "-",
        }
    }
}

/// The truth with which answers to a case are compared.
#[derive(Clone, Copy, Debug)]
pub struct Judge<'a> {
    /// The label.
    pub label: &'a Label,
    /// Meaning of names in this machine.
    pub sites: &'a Sites,
    /// Names of the effects that the diagnosis could name.
    pub catalogue: &'a BTreeSet<String>,
}

fn is(set: &[String], word: &str) -> bool {
    matches!(set, [one] if one == word)
}

impl Judge<'_> {
    /// Whether the catalogue lacks a cause whose name is agreed on.
    #[must_use]
    pub fn is_out_of_catalogue(&self) -> bool {
        let label = self.label;
        !label.is_unknown()
            && label
                .effects
                .iter()
                .any(|e| !self.catalogue.contains(name_of(e)))
    }

    /// The true set: effects, `none` or `unknown`.
    #[must_use]
    pub fn truth(&self) -> Vec<String> {
        match &self.label.effects[..] {
            [] => vec!["none".to_owned()],
            _ if self.label.is_unknown() => vec!["unknown".to_owned()],
            effects => {
                let mut set = effects.to_vec();
                set.sort();
                set
            }
        }
    }

    /// Standing of a set by its names.
    #[must_use]
    pub fn of_set(&self, set: &[String], answer: &Answer) -> Standing {
        let label = self.label;
        let set = &self.with_mended(set, answer)[..];
        if label.must_not.iter().any(|e| self.sites.holds(set, e)) {
            return Standing::Wrong;
        }
        if self.agrees(set, &self.truth(), answer) {
            return Standing::Right;
        }
        if label.acceptable.iter().any(|a| self.agrees(set, a, answer)) {
            return Standing::Acceptable;
        }
        if is(set, "unknown") {
            return match (self.is_out_of_catalogue(), label.is_none() && label.dirty) {
                (true, _) => Standing::OutOfCatalogue,
                (_, true) => Standing::Apart,
                _ => Standing::Wrong,
            };
        }
        if label.is_none() && !is(set, "none") && set.iter().all(|e| self.is_dirt(e, answer)) {
            return Standing::Dirt;
        }
        Standing::Wrong
    }

    /// Adds to a set the causes that the answer named by correcting columns.
    fn with_mended(&self, set: &[String], answer: &Answer) -> Vec<String> {
        let mended: Vec<String> = named_by_mending(self.label, answer).cloned().collect();
        if mended.is_empty() || is(set, "unknown") {
            return set.to_vec();
        }
        let named = set.iter().filter(|e| *e != "none").cloned();
        let set: BTreeSet<String> = named.chain(mended).collect();
        set.into_iter().collect()
    }

    /// Whether `set` is `wanted`, apart from listed dirt.
    fn agrees(&self, set: &[String], wanted: &[String], answer: &Answer) -> bool {
        // An empty set is accepted as `none`.
        if wanted.is_empty() {
            return is(set, "none");
        }
        if is(wanted, "none") || is(wanted, "unknown") {
            return set == wanted;
        }
        let more = set.iter().filter(|e| !self.sites.holds(wanted, e));
        wanted.iter().all(|e| self.sites.holds(set, e))
            && more.into_iter().all(|e| self.is_dirt(e, answer))
    }

    fn is_dirt(&self, effect: &str, answer: &Answer) -> bool {
        dirt::is_listed(effect, answer, self.label, self.sites)
    }

    /// Whether all claims of the verdict are true: the event whose probability it states.
    ///
    /// Each named effect must be a cause or listed dirt; `none` and `unknown` must be right.
    #[must_use]
    pub fn claims_hold(&self, answer: &Answer, standing: Standing) -> bool {
        if standing.is_right() {
            return true;
        }
        let verdict = &answer.verdict;
        let true_one = |e: &String| {
            let of_label = |set: &Vec<String>| self.sites.holds(set, e);
            of_label(&self.label.effects)
                || self.label.acceptable.iter().any(of_label)
                || self.is_dirt(e, answer)
        };
        verdict.kind == "effects" && verdict.effects.iter().all(true_one)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::{EffectValues, Verdict};
    use crate::label::Dirt;

    fn set(names: &[&str]) -> Vec<String> {
        names.iter().map(|n| (*n).to_owned()).collect()
    }

    fn standing(label: &Label, said: &[&str]) -> Standing {
        let sites = Sites::default();
        let catalogue = ["a", "b", "c"].map(str::to_owned).into();
        let judge = Judge {
            label,
            sites: &sites,
            catalogue: &catalogue,
        };
        // Each named effect has a size of 1.
        let answer = Answer {
            effects: said
                .iter()
                .map(|e| EffectValues {
                    effect: name_of(e).into(),
                    site: crate::label::site_of(e).into(),
                    parameters: [("size".to_owned(), 1.0)].into(),
                    ..EffectValues::default()
                })
                .collect(),
            ..Answer::default()
        };
        judge.of_set(&set(said), &answer)
    }

    fn dirty(effects: &[&str]) -> Label {
        let item = |effect: &str, size: f64| Dirt {
            effect: effect.into(),
            site: "x".into(),
            parameters: [("size".to_owned(), size)].into(),
            excess_gap: 0.5,
        };
        Label {
            effects: set(effects),
            dirty: true,
            dirt: vec![item("b", 0.6), item("c", 0.4)],
            ..Label::default()
        }
    }

    #[test]
    fn nothing_but_none_is_right_in_a_clean_world_without_a_cause() {
        let clean = Label::default();
        assert_eq!(standing(&clean, &["none"]), Standing::Right);
        assert_eq!(standing(&clean, &["a@x"]), Standing::Wrong);
        assert_eq!(standing(&clean, &["unknown"]), Standing::Wrong);
    }

    #[test]
    fn listed_dirt_is_right_unless_it_is_named_too_large() {
        assert_eq!(standing(&dirty(&[]), &["none"]), Standing::Right);
        assert_eq!(standing(&dirty(&[]), &["b@x"]), Standing::Dirt);
        // The drawn size is 0.4, the named size 1.
        assert_eq!(standing(&dirty(&[]), &["c@x"]), Standing::Wrong);
        assert_eq!(standing(&dirty(&[]), &["b@y"]), Standing::Wrong);
        assert_eq!(standing(&dirty(&[]), &["unknown"]), Standing::Apart);
        let cause = dirty(&["a@x"]);
        assert_eq!(standing(&cause, &["a@x", "b@x"]), Standing::Right);
        assert_eq!(standing(&cause, &["a@x", "c@x"]), Standing::Wrong);
        assert_eq!(standing(&cause, &["b@x"]), Standing::Wrong);
        assert_eq!(standing(&cause, &["unknown"]), Standing::Wrong);
    }

    #[test]
    fn a_cause_that_the_catalogue_has_not_got_is_unknown() {
        let agreed = Label {
            effects: set(&["new@x"]),
            ..Label::default()
        };
        assert_eq!(standing(&agreed, &["unknown"]), Standing::OutOfCatalogue);
        assert_eq!(standing(&agreed, &["a@x"]), Standing::Wrong);
        let strange = Label {
            effects: set(&["unknown:magnet"]),
            ..Label::default()
        };
        assert_eq!(standing(&strange, &["unknown"]), Standing::Right);
        assert_eq!(standing(&strange, &["none"]), Standing::Wrong);
    }

    #[test]
    fn a_label_may_accept_more_and_forbid() {
        let label = Label {
            effects: set(&["a@x", "b@x"]),
            acceptable: vec![set(&["a@x"]), set(&["none"])],
            must_not: set(&["c@x"]),
            ..Label::default()
        };
        assert_eq!(standing(&label, &["b@x", "a@x"]), Standing::Right);
        assert_eq!(standing(&label, &["a@x"]), Standing::Acceptable);
        assert_eq!(standing(&label, &["none"]), Standing::Acceptable);
        assert_eq!(standing(&label, &["a@x", "b@x", "c@x"]), Standing::Wrong);
    }

    #[test]
    fn a_part_of_the_truth_is_a_claim_that_holds() {
        let label = Label {
            effects: set(&["a@x", "b@x"]),
            ..Label::default()
        };
        let (sites, catalogue) = (Sites::default(), BTreeSet::new());
        let judge = Judge {
            label: &label,
            sites: &sites,
            catalogue: &catalogue,
        };
        let answer = |kind: &str, effects: &[&str]| Answer {
            verdict: Verdict {
                kind: kind.into(),
                effects: set(effects),
                ..Verdict::default()
            },
            ..Answer::default()
        };
        let holds = |a: &Answer| judge.claims_hold(a, Standing::Wrong);
        assert!(holds(&answer("effects", &["a@x"])));
        assert!(!holds(&answer("effects", &["a@x", "c@x"])));
        assert!(!holds(&answer("none", &[])));
    }
}
