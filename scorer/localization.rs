//! Compares the places that a diagnosis lists with those of the true excess.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::answer::Answer;
use crate::label::Label;

/// Share of the excess from which a place counts: an excess spread over more than ten equal places
/// cannot be said to *lie* anywhere.
const COUNTS: f64 = 0.1;

/// F1 scores (van Rijsbergen 1979) of the places with at least a tenth of the excess.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Localization {
    /// F1 by column of the logs; null if the label does not say where the excess is.
    pub signals: Option<f64>,
    /// F1 by column and regime of motion.
    pub regimes: Option<f64>,
}

/// F1 of the keys whose share counts: harmonic mean of precision and recall; `None` without a true
/// key.
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

/// The signal of a column: the column itself, or the orientation to which it belongs.
///
/// A log has four values of an orientation and a residual three, so only the whole orientation can
/// be compared.
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
    /// Scores the places of an answer.
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
        // One of the two stated places is true, and one of the two true places is stated.
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
