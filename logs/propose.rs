//! Proposes which column of a log holds which quantity of a model's machine.
//!
//! Each pair of a quantity and a column gets points. They count shared words, the measure, whether
//! the name says sent or read, the place in a list, and values that fit the range. Once the
//! readings are assigned, they also count how well a command correlates with the position that
//! follows it. The best pair is taken, then the best of the rest. The proposal is shown with its
//! reasons, and the check of wiring, which knows physics, tests it again.

mod fit;
mod quantity;
mod score;
mod speed;
mod unit;
mod words;

use asid_core::{Error, Result, Scene};
use asid_mjcf::Plant;

pub use quantity::Quantity;
use score::{Candidate, Context};
use speed::match_speed;
use unit::Unit;
use words::Measure;

use crate::align::LOST;
use crate::episode::{ColumnMapping, is_of_start, unit_factor};
use crate::format::LogFormat;
use crate::raw::RawLog;
use crate::series::Series;

/// The source of a quantity in a log.
#[derive(Clone, Debug)]
pub struct Match {
    /// The quantity's name: a sensor, an entry of one, or `ctrl.<actuator>`.
    pub name: String,
    /// The mapping, if a column was found.
    pub mapping: Option<ColumnMapping>,
    /// Reasons, in a few words each.
    pub reasons: Vec<String>,
    /// Readings or commands per second.
    pub rate: f64,
    /// Smallest and largest value, in the quantity's unit.
    pub values: [f64; 2],
}

/// A proposed mapping.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Every quantity, commands first.
    pub matches: Vec<Match>,
    /// Mapping of the stamps, for a table that does not call them `time`.
    pub time: Option<ColumnMapping>,
    /// Topics that the mappings read.
    pub topics: Vec<String>,
    /// Columns of the initial state: `qpos.*` and `qvel.*` of a table.
    pub start: Vec<String>,
    /// Columns that are not read.
    pub unused: Vec<String>,
}

impl Match {
    /// Replaces the mapping of the quantity, for the same log.
    pub fn remap(&mut self, mapping: ColumnMapping, log: &RawLog) {
        if let Some(series) = log.series(source(&mapping)) {
            (self.values, self.rate) = (values(series, &mapping), rate(series));
        }
        self.mapping = Some(mapping);
    }
}

impl Proposal {
    /// The mappings that a study needs: all that differ from the default of their name.
    #[must_use]
    pub fn mappings(&self) -> Vec<ColumnMapping> {
        let found = self.matches.iter().filter_map(|m| m.mapping.as_ref());
        let all = self.time.iter().chain(found);
        all.filter(|m| **m != ColumnMapping::of(&m.name))
            .cloned()
            .collect()
    }

    /// Commands of the model without a column.
    #[must_use]
    pub fn missing_commands(&self) -> Vec<&str> {
        let lacking = self.matches.iter().filter(|m| m.mapping.is_none());
        lacking
            .filter_map(|m| m.name.strip_prefix("ctrl."))
            .collect()
    }

    /// Number of sensor entries that have a column.
    #[must_use]
    pub fn readings(&self) -> usize {
        let found = self.matches.iter().filter(|m| m.mapping.is_some());
        found.filter(|m| !m.name.starts_with("ctrl.")).count()
    }
}

/// Proposes a mapping for a log of a machine; `given` are known pairs of quantity and column.
///
/// # Errors
/// When the document is not valid MJCF, or a given name is unknown.
pub fn propose(
    scene: &Scene,
    plant: &Plant,
    (log, kind): (&RawLog, LogFormat),
    given: &[(String, String)],
) -> Result<Proposal> {
    let quantities = quantity::quantities(scene, plant)?;
    let context = Context::new(log, &quantities, kind);
    let mut taken: Vec<Option<Candidate>> = vec![None; quantities.len()];
    for (name, column) in given {
        let names = quantities.iter().map(|q| &*q.name);
        let place = quantities.iter().position(|q| q.name == *name);
        let place = place.ok_or_else(|| Error::unknown("sensor or command", name, names))?;
        let series = log.series.iter().position(|s| s.name == *column);
        let series = series.ok_or_else(|| no_column(log, column))?;
        taken[place] = Some(context.given(place, series));
    }
    // Readings first: commands are compared with them.
    context.assign(&mut taken, false, |_, _| 0.0);
    context.drop_incomplete(&mut taken);
    let positions: Vec<Option<usize>> = (0..plant.layout.joints.len())
        .map(|joint| {
            let reads = |q: &Quantity| {
                !q.command
                    && q.joint == Some(joint)
                    && q.measure == Some(Measure::Position)
                    && q.vector.is_none()
            };
            let place = quantities.iter().position(reads)?;
            taken[place].as_ref().map(|c| c.series)
        })
        .collect();
    context.assign(&mut taken, true, |q, s| {
        let position = q.joint.filter(|_| q.measure == Some(Measure::Position));
        let position = position.and_then(|j| positions[j]);
        position.map_or(0.0, |p| fit::correlation(&log.series[s], &log.series[p]))
    });
    let mut matches: Vec<Match> = quantities
        .iter()
        .zip(&taken)
        .map(|(q, c)| matched(q, c.as_ref(), log))
        .collect();
    for (q, m) in quantities.iter().zip(&mut matches) {
        let position = q.joint.and_then(|j| positions[j]).map(|p| &log.series[p]);
        let own = position.and_then(|p| {
            let other = taken
                .iter()
                .flatten()
                .find(|c| log.series[c.series].name == p.name)?;
            Some((p, factor(&other.unit)))
        });
        if let (Some(own), Some(Measure::Velocity), false) = (own, q.measure, q.command) {
            match_speed(m, log, own, q.dimension);
        }
    }
    let used = |s: &Series| {
        matches
            .iter()
            .filter_map(|m| m.mapping.as_ref())
            .any(|m| source(m) == s.name)
    };
    let mut topics: Vec<String> = Vec::new();
    let (mut start, mut unused) = (Vec::new(), Vec::new());
    for s in &log.series {
        let of_start = kind.is_table() && is_of_start(&plant.layout, &s.name);
        if !used(s) && of_start {
            start.push(s.name.clone());
        } else if !used(s) {
            unused.push(s.name.clone());
        } else if !s.stream.is_empty() && !topics.contains(&s.stream) {
            topics.push(s.stream.clone());
        }
    }
    let time = log.stamps.as_ref().filter(|stamps| *stamps != "time");
    Ok(Proposal {
        time: time.map(|stamps| ColumnMapping {
            from: Some(stamps.clone()),
            unit: log.stamps_unit.map(str::to_owned),
            ..ColumnMapping::of("time")
        }),
        matches,
        topics,
        start,
        unused,
    })
}

/// Explains why a column that the user named cannot be read.
fn no_column(log: &RawLog, column: &str) -> Error {
    match log.numberless.iter().find(|n| n.name == column) {
        None => Error::unknown("column", column, log.series.iter().map(|s| &*s.name)),
        Some(found) => Error::Config {
            key: "--map".into(),
            message: format!("no cell of column {} is a number", found.told()),
        },
    }
}

fn source(mapping: &ColumnMapping) -> &str {
    mapping.from.as_deref().unwrap_or(&mapping.name)
}

fn factor(unit: &Unit) -> f64 {
    unit.scale * unit.name.and_then(unit_factor).unwrap_or(1.0)
}

/// The match of a quantity, with or without a candidate.
fn matched(quantity: &Quantity, candidate: Option<&Candidate>, log: &RawLog) -> Match {
    let Some(candidate) = candidate else {
        return Match {
            name: quantity.name.clone(),
            mapping: None,
            reasons: Vec::new(),
            rate: 0.0,
            values: [f64::NAN; 2],
        };
    };
    let series = &log.series[candidate.series];
    let unit = &candidate.unit;
    let mapping = ColumnMapping {
        from: (series.name != quantity.name).then(|| series.name.clone()),
        unit: unit.name.map(str::to_owned),
        scale: unit.scale,
        offset: unit.offset,
        ..ColumnMapping::of(&quantity.name)
    };
    let mut reasons = candidate.reasons.clone();
    if !unit.reason.is_empty() {
        reasons.push(unit.reason.clone());
    }
    if !unit.fits {
        reasons.push("values beyond the model's range".into());
    }
    Match {
        name: quantity.name.clone(),
        values: values(series, &mapping),
        mapping: Some(mapping),
        reasons,
        rate: rate(series),
    }
}

/// Values of a series per second, gaps excluded; 0 where no time passes.
fn rate(series: &Series) -> f64 {
    let mut steps: Vec<f64> = series.time.windows(2).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    if steps.is_empty() {
        return 0.0;
    }
    let usual = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    steps.retain(|step| *step <= LOST * usual);
    let seconds: f64 = steps.iter().sum();
    if seconds > 0.0 {
        steps.len() as f64 / seconds
    } else {
        0.0
    }
}

/// Smallest and largest value under a mapping.
fn values(series: &Series, mapping: &ColumnMapping) -> [f64; 2] {
    let all = series
        .values
        .iter()
        .map(|x| mapping.factor() * x + mapping.offset);
    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
        [a.min(x), b.max(x)]
    })
}

#[cfg(test)]
mod tests;
