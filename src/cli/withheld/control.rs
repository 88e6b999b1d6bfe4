//! Controls of the check: runs that are spoilt on purpose and must fail, and one that must not.

use std::collections::{BTreeMap, BTreeSet};

use asid_core::rng::Streams;
use asid_scorer::label::{Label, name_of};
use rand::Rng as _;

/// How the check is spoilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Control {
    /// Each case is scored by another one's label: nothing but chance may be right
    Scrambled,
    /// The readings of the logs are replaced by noise: no effect may be named
    Noise,
    /// The true effects are not in the catalogue: `unknown` is right, or the same physics by
    /// another name
    WithoutTruth,
    /// The labels themselves answer: all must be right, and the true effects close the gap
    Oracle,
}

impl Control {
    /// Name in folders and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scrambled => "scrambled",
            Self::Noise => "noise",
            Self::WithoutTruth => "without-truth",
            Self::Oracle => "oracle",
        }
    }

    /// The required result, as a sentence.
    pub fn expects(self) -> &'static str {
        match self {
            Self::Scrambled => {
                "labels are those of other cases: no more may be right than agree by chance"
            }
            Self::Noise => {
                "logs are noise: `none` and `unknown` are right, and every effect that is named is a false alarm"
            }
            Self::WithoutTruth => {
                "the true effects are not in the catalogue: `unknown` is right, or the same physics by another name"
            }
            Self::Oracle => {
                "the labels themselves answer: all of it is right, and clean worlds are closed down to the noise"
            }
        }
    }

    /// The labels against which answers are scored.
    pub fn labels(self, labels: BTreeMap<String, Label>, seed: u64) -> BTreeMap<String, Label> {
        match self {
            Self::WithoutTruth | Self::Oracle => labels,
            Self::Scrambled => scrambled(labels, seed),
            Self::Noise => labels
                .into_iter()
                .map(|(case, label)| {
                    let noise = Label {
                        world: label.world,
                        acceptable: vec![vec!["unknown".to_owned()]],
                        ..Label::default()
                    };
                    (case, noise)
                })
                .collect(),
        }
    }
}

/// Gives each case the label of another one: a cyclic permutation drawn by Sattolo's algorithm
/// (Sattolo 1986).
fn scrambled(labels: BTreeMap<String, Label>, seed: u64) -> BTreeMap<String, Label> {
    let (cases, mut drawn): (Vec<String>, Vec<Label>) = labels.into_iter().unzip();
    let mut random = Streams::new(seed).stream("scrambled labels");
    for last in (1..drawn.len()).rev() {
        drawn.swap(last, random.random_range(0..last));
    }
    cases.into_iter().zip(drawn).collect()
}

/// Names of a case's causes that a catalogue may have; empty where the true set does not consist of
/// effects.
pub fn true_effects(label: &Label) -> BTreeSet<String> {
    let effects = label.effects.iter().filter(|_| !label.is_unknown());
    effects.map(|e| name_of(e).to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_case_keeps_its_label() {
        let label = |i: usize| Label {
            world: i.to_string(),
            ..Label::default()
        };
        for n in [2, 3, 17] {
            let labels: BTreeMap<String, Label> =
                (0..n).map(|i| (format!("{i:02}"), label(i))).collect();
            let other = scrambled(labels.clone(), 5);
            assert!(labels.iter().all(|(case, l)| other[case] != *l));
            let worlds: BTreeSet<&str> = other.values().map(|l| &*l.world).collect();
            assert_eq!(worlds.len(), n);
        }
    }
}
