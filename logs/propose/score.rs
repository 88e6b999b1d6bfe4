//! Scores pairs of a quantity and a column, and matches them by score.

use std::collections::HashMap;

use super::quantity::{Dimension, Quantity};
use super::unit::{Unit, unit};
use super::words::{Measure, Words};
use crate::counted::allows;
use crate::format::LogFormat;
use crate::raw::RawLog;
use crate::series::Series;

/// Points of a name that equals the quantity's: more than all others together.
const OWN_NAME: f64 = 100.0;
/// Points where all own words of the two names are shared; in proportion for fewer.
const SAME_WORDS: f64 = 4.0;
/// Factor of [`SAME_WORDS`] where only the topic's name has the words.
const BY_TOPIC: f64 = 0.8;
/// Points of a word that is the joint's or actuator's whole name, such as `x`.
///
/// They exceed those of a place in a list, since a name is better evidence.
const WHOLE_NAME: f64 = 2.0;
/// Further points of a whole name where the column has no other own word; in proportion otherwise.
///
/// Both together stay below shared own words, since more names have a letter than a word.
const NO_OTHER: f64 = 1.5;
/// Points lost where both names have own words, but none in common.
const OTHER_WORDS: f64 = 1.5;
/// Points of the same measure.
const SAME_MEASURE: f64 = 2.0;
/// Points lost by another measure: a speed is not a position, whatever its name.
const OTHER_MEASURE: f64 = 4.0;
/// Points of a name that says sent, for a command, or read, for a reading.
const SAME_ROLE: f64 = 1.0;
/// Points lost by a name that says the opposite.
const OTHER_ROLE: f64 = 4.0;
/// Points of the same place in a list.
const SAME_PLACE: f64 = 1.5;
/// Points lost by values that no unit brings into the model's range.
const OUT_OF_RANGE: f64 = 1.0;
/// Points of a command that correlates perfectly with the position that follows it.
const LOOKS_LIKE: f64 = 1.5;
/// Fewest points of a proposed pair: one strong reason, or two weak ones.
const FEWEST: f64 = 2.0;

/// A column that may hold a quantity.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Index in [`RawLog::series`].
    pub series: usize,
    /// How its numbers are converted.
    pub unit: Unit,
    /// Reasons for the match.
    pub reasons: Vec<String>,
    points: f64,
}

/// A column's name split into words, without and with its topic.
struct Named {
    leaf: Words,
    full: Words,
    /// Its place, from 0, among the columns whose names differ only in their final number.
    place: Option<usize>,
}

/// The columns of a log, with their names as words.
pub(super) struct Context<'a> {
    log: &'a RawLog,
    quantities: &'a [Quantity],
    named: Vec<Named>,
    kind: LogFormat,
}

impl<'a> Context<'a> {
    pub(super) fn new(log: &'a RawLog, quantities: &'a [Quantity], kind: LogFormat) -> Self {
        let stem = |s: &Series| {
            let name = s.name.trim_end_matches(']');
            name.trim_end_matches(|c: char| c.is_ascii_digit())
                .to_owned()
        };
        // Lists count from 0 or from 1.
        let mut firsts: HashMap<String, usize> = HashMap::new();
        let words: Vec<Words> = log.series.iter().map(|s| Words::of(&s.name)).collect();
        for (s, words) in log.series.iter().zip(&words) {
            if let Some(i) = words.index {
                let first = firsts.entry(stem(s)).or_insert(i);
                *first = (*first).min(i);
            }
        }
        let named = log.series.iter().zip(words).map(|(s, full)| {
            let leaf = s.name.strip_prefix(&s.stream).unwrap_or(&s.name);
            let first = firsts.get(&stem(s)).copied().unwrap_or(0);
            Named {
                leaf: Words::of(leaf),
                place: full.index.and_then(|i| i.checked_sub(first)),
                full,
            }
        });
        Self {
            log,
            quantities,
            named: named.collect(),
            kind,
        }
    }

    /// A pair that the user gives.
    pub(super) fn given(&self, quantity: usize, series: usize) -> Candidate {
        let words = &self.named[series].leaf;
        let unit = unit(
            &self.quantities[quantity],
            &self.log.series[series],
            words,
            self.kind,
        );
        Candidate {
            series,
            unit,
            reasons: vec!["as you say".into()],
            points: OWN_NAME,
        }
    }

    /// Assigns columns to the commands or to the readings, the best pair first.
    ///
    /// `more` returns further evidence, -1 to 1.
    pub(super) fn assign(
        &self,
        taken: &mut [Option<Candidate>],
        commands: bool,
        more: impl Fn(&Quantity, usize) -> f64,
    ) {
        let mut pairs: Vec<(usize, Candidate)> = Vec::new();
        for (i, quantity) in self.quantities.iter().enumerate() {
            if quantity.command != commands {
                continue;
            }
            for series in 0..self.log.series.len() {
                let Some(mut candidate) = self.candidate(quantity, series) else {
                    continue;
                };
                let alike = more(quantity, series);
                candidate.points += LOOKS_LIKE * alike;
                if alike > 0.5 {
                    candidate
                        .reasons
                        .push(format!("its joint follows it ({alike:.2})"));
                }
                if candidate.points >= FEWEST {
                    pairs.push((i, candidate));
                }
            }
        }
        // A stable sort: of equal points the earlier quantity wins, then the earlier column.
        pairs.sort_by(|(_, a), (_, b)| b.points.total_cmp(&a.points));
        for (i, candidate) in pairs {
            let free = !taken.iter().flatten().any(|c| c.series == candidate.series);
            if taken[i].is_none() && free {
                taken[i] = Some(candidate);
            }
        }
    }

    /// Drops vectors with missing entries: they are read completely or not at all.
    pub(super) fn drop_incomplete(&self, taken: &mut [Option<Candidate>]) {
        for i in 0..taken.len() {
            let vector = &self.quantities[i].vector;
            if vector.is_none() || taken[i].is_some() {
                continue;
            }
            for (j, other) in self.quantities.iter().enumerate() {
                if other.vector == *vector {
                    taken[j] = None;
                }
            }
        }
    }

    /// The candidate of a quantity and a column; `None` where they cannot match.
    fn candidate(&self, quantity: &Quantity, place: usize) -> Option<Candidate> {
        let (series, named) = (&self.log.series[place], &self.named[place]);
        let unit = unit(quantity, series, &named.leaf, self.kind);
        let made = |points: f64, reasons: Vec<String>, unit: Unit| Candidate {
            series: place,
            unit,
            reasons,
            points,
        };
        if series.name == quantity.name {
            return Some(made(OWN_NAME, vec!["its name".into()], unit));
        }
        // Millimetres are not an angle, whatever the column's name.
        if unit.name.is_some_and(|u| !allows(quantity.counts, u)) {
            return None;
        }
        let mut points = role(quantity, &named.full) + measure(quantity, named);
        let mut reasons = Vec::new();
        if let Some(axis) = quantity.axis {
            let entry = quantity
                .name
                .rsplit_once('.')
                .and_then(|(_, i)| i.parse().ok());
            if named.full.axis != Some(axis) && (named.full.axis.is_some() || named.place != entry)
            {
                return None;
            }
            points += 1.0;
        } else if let Some(axis) = named.full.axis {
            // An axis names an entry of a vector, or a joint named after its axis: `x`, `slide_x`.
            if !quantity.words.iter().any(|w| w.axis == Some(axis)) {
                return None;
            }
        }
        let turns = quantity.dimension == Dimension::Angle;
        if quantity.dimension != Dimension::Other && named.full.turning.is_some_and(|t| t != turns)
        {
            return None;
        }
        let likeness = |words: &Words| {
            let each = quantity.words.iter().map(|own| own.likeness(words));
            each.fold(0.0, f64::max)
        };
        let words = likeness(&named.leaf).max(BY_TOPIC * likeness(&named.full));
        points += SAME_WORDS * words;
        let wordless = named.leaf.own.is_empty();
        let whole = if words == 0.0 && quantity.axis.is_none() {
            whole_name(quantity, named)
        } else {
            0.0
        };
        if words > 0.0 {
            reasons.push("by name".into());
        } else if whole > 0.0 {
            points += WHOLE_NAME + NO_OTHER * whole;
            reasons.push("its joint's or actuator's name is a word of it".into());
        } else if !wordless && quantity.words.iter().any(|w| !w.own.is_empty()) {
            points -= OTHER_WORDS;
        }
        let alike = words > 0.0 || whole > 0.0;
        let ordered = !alike
            && quantity.axis.is_none()
            && named.place.is_some()
            && named.place == quantity.place;
        if ordered {
            points += SAME_PLACE;
            reasons.push("by its place in a list".into());
        }
        // Without a shared word or place, only a quantity that is unique of its kind matches.
        let only = wordless && self.is_only(quantity);
        if !alike && !ordered {
            if !only {
                return None;
            }
            points += SAME_PLACE;
            reasons.push("the only one of its kind".into());
        }
        if !unit.fits {
            points -= OUT_OF_RANGE;
        }
        Some(made(points, reasons, unit))
    }

    /// Whether the machine has no other quantity of this kind.
    fn is_only(&self, quantity: &Quantity) -> bool {
        let same = |q: &&Quantity| {
            let kind = (q.command, q.measure, q.dimension, q.axis);
            kind == (
                quantity.command,
                quantity.measure,
                quantity.dimension,
                quantity.axis,
            )
        };
        self.quantities.iter().filter(same).count() == 1
    }
}

/// Share of a column's own words that is the whole name of a quantity, its joint or its actuator.
///
/// 0 for none, 1 where it is the only own word.
fn whole_name(quantity: &Quantity, named: &Named) -> f64 {
    let names = quantity.words.iter().filter_map(Words::whole);
    let parts = names.map(|name| {
        let leaf = named.leaf.part_of(name);
        leaf.max(BY_TOPIC * named.full.part_of(name))
    });
    parts.fold(0.0, f64::max)
}

/// Points of names that say sent or read.
fn role(quantity: &Quantity, words: &Words) -> f64 {
    match (quantity.command, words.command, words.reading) {
        (true, true, _) | (false, _, true) => SAME_ROLE,
        (true, _, true) | (false, true, _) => -OTHER_ROLE,
        (true, false, false) => -SAME_ROLE,
        (false, false, false) => 0.0,
    }
}

/// Points of the measure. A column whose name says none counts as a position.
fn measure(quantity: &Quantity, named: &Named) -> f64 {
    let said = named.leaf.measure.or(named.full.measure);
    match (quantity.measure, said) {
        (Some(own), Some(said)) if own == said => SAME_MEASURE,
        // A controller is named after what it controls; its command may be of another measure than
        // the drive's.
        (Some(_), Some(_)) if quantity.command => -0.5 * OTHER_MEASURE,
        (Some(_), Some(_)) => -OTHER_MEASURE,
        (Some(Measure::Position), None) => 0.5 * SAME_MEASURE,
        (Some(_), None) if quantity.command => 0.0,
        (Some(_), None) => -0.5 * SAME_MEASURE,
        (None, _) => 0.0,
    }
}
