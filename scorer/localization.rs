//! Whether the places that a diagnosis lists are those where the true excess is.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::answer::Answer;
use crate::label::Label;

/// Share of the excess from which on a place counts: ten equal places is as thin as an excess can be said to *lie*
/// anywhere.
const COUNTS: f64 = 0.1;

/// F1 scores (van Rijsbergen 1979) of the places with at least a tenth of the excess.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Localization {
    /// By column of the logs; null where the label does not say where the excess is.
    pub signals: Option<f64>,
    /// By column and regime of motion.
    pub regimes: Option<f64>,
}

/// Harmonic mean of precision and recall of the keys with a share that counts; `None` where no true one has.
fn f1(said: &BTreeMap<String, f64>, truth: &BTreeMap<String, f64>) -> Option<f64> {
    let counts = |shares: &BTreeMap<String, f64>| -> Vec<String> {
        let large = shares.iter().filter(|(_, share)| **share >= COUNTS);
        large.map(|(key, _)| key.clone()).collect()
    };
    let (said, truth) = (counts(said), counts(truth));
    let both = said.iter().filter(|s| truth.contains(s)).count() as f64;
    (!truth.is_empty()).then(|| 2.0 * both / (said.len() + truth.len()) as f64)
}

fn sums(places: impl Iterator<Item = (String, f64)>) -> BTreeMap<String, f64> {
    let mut sums = BTreeMap::new();
    for (key, share) in places {
        *sums.entry(key).or_default() += share;
    }
    sums
}

/// What a column stands for: itself, or the orientation that it is a number of. A log has four numbers of one, a residual three,
/// so that only the orientation as a whole can be compared.
fn signal<'a>(column: &'a str, label: &Label) -> &'a str {
    match column.rsplit_once('.') {
        Some((sensor, "0" | "1" | "2" | "3"))
            if label.signals.contains_key(&format!("{sensor}.3")) =>
        {
            sensor
        }
        _ => column,
    }
}

impl Localization {
    /// Of a case with an answer.
    #[must_use]
    pub fn of(label: &Label, answer: &Answer) -> Self {
        let said = |key: &dyn Fn(&crate::answer::Place) -> String| {
            sums(answer.places.iter().map(|p| (key(p), p.share)))
        };
        let of = |column: &str| signal(column, label).to_owned();
        let both = |column: &str, regime: &str| format!("{} / {regime}", signal(column, label));
        let true_regimes = label
            .places
            .iter()
            .map(|p| (both(&p.signal, &p.regime), p.share));
        let true_signals = label.signals.iter().map(|(c, share)| (of(c), *share));
        Self {
            signals: f1(&said(&|p| of(&p.signal)), &sums(true_signals)),
            regimes: f1(&said(&|p| both(&p.signal, &p.regime)), &sums(true_regimes)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::Place;

    #[test]
    fn f1_is_the_harmonic_mean_of_precision_and_recall() {
        let place = |signal: &str, regime: &str, share: f64| Place {
            signal: signal.into(),
            regime: regime.into(),
            share,
        };
        let label = Label {
            signals: [("a", 0.5), ("b", 0.45), ("c", 0.05)]
                .map(|(s, x)| (s.to_owned(), x))
                .into(),
            ..Label::default()
        };
        let answer = Answer {
            places: vec![
                place("a", "free", 0.3),
                place("a", "reversal", 0.3),
                place("d", "free", 0.4),
            ],
            ..Answer::default()
        };
        // One of two said is true, and one of two true is said.
        let scored = Localization::of(&label, &answer);
        assert_eq!(scored.signals, Some(0.5));
        assert_eq!(scored.regimes, None);
        assert_eq!(Localization::of(&Label::default(), &answer).signals, None);
    }

    #[test]
    fn an_orientation_is_one_place_however_many_numbers_tell_it() {
        let label = Label {
            signals: [("r.0", 0.1), ("r.1", 0.3), ("r.2", 0.3), ("r.3", 0.3)]
                .map(|(s, x)| (s.to_owned(), x))
                .into(),
            places: vec![crate::label::TruePlace {
                signal: "r.3".into(),
                regime: "free".into(),
                share: 0.9,
            }],
            ..Label::default()
        };
        let answer = Answer {
            places: vec![Place {
                signal: "r.2".into(),
                regime: "free".into(),
                share: 1.0,
            }],
            ..Answer::default()
        };
        let scored = Localization::of(&label, &answer);
        assert_eq!((scored.signals, scored.regimes), (Some(1.0), Some(1.0)));
    }
}
