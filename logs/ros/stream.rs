//! The messages of one topic as series of numbers.
//!
//! A number's name is its path: `/odom.twist.twist.linear.x`. A list of names beside it (`name`,
//! `joint_names`) names the entries of a list. A name of its own (`child_frame_id`) names a record.
//! Otherwise the index names an entry. Time stamps, covariances and the layouts of arrays are not
//! readings.

use std::collections::HashMap;

use super::cdr::Value;
use super::orientation::align_signs;
use crate::series::Series;

/// Most series of one topic; with more, names change from message to message.
const MOST_SERIES: usize = 2048;
/// Largest offset of a topic's own stamps from the recorder's for them to count, s.
///
/// Two clocks of one machine agree better; simulated time and time since boot are farther off.
const SAME_CLOCK: f64 = 0.5;
/// Nanoseconds in a second.
const SECOND: f64 = 1e9;

/// Names of lists that name the entries of their sibling lists.
const NAMING: [&str; 4] = ["name", "names", "joint_names", "interface_names"];
/// Fields whose text names the record that contains them.
const OWN_NAME: [&str; 2] = ["child_frame_id", "name"];
/// Fields that are not readings.
const NO_READING: [&str; 3] = ["header", "layout", "time_from_start"];

/// Time of recording, and the message's own stamp; ns.
#[derive(Clone, Copy, Debug)]
struct Stamps {
    recorded: i64,
    own: Option<i64>,
}

/// The clock whose stamps count.
#[derive(Clone, Copy, Debug)]
enum Clock {
    /// The recorder's.
    Recorder,
    /// The messages' own. One without a stamp was recorded this long (ns) before its time.
    Own { apart: i64 },
}

impl Clock {
    fn stamp(self, stamps: Stamps) -> i64 {
        match self {
            Self::Recorder => stamps.recorded,
            Self::Own { apart } => {
                let placed = stamps.recorded.saturating_add(apart);
                stamps.own.unwrap_or(placed)
            }
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    message: u32,
    column: u32,
    value: f64,
}

/// A topic while it is read.
#[derive(Debug, Default)]
pub struct Stream {
    names: Vec<String>,
    places: HashMap<String, usize>,
    stamps: Vec<Stamps>,
    samples: Vec<Sample>,
}

impl Stream {
    /// Adds a message that was recorded at a time, ns.
    pub fn push(&mut self, topic: &str, recorded: i64, message: &Value) {
        let own = stamp(message, recorded);
        let mut path = topic.to_owned();
        if let Some((name, entries)) = stamped_entries(message, recorded) {
            for (i, entry) in entries.iter().enumerate() {
                let own = stamp(entry, recorded);
                self.begin(Stamps { recorded, own });
                let entry_name = own_name(entry).unwrap_or(i.to_string());
                within(&mut path, name, |path| {
                    within(path, &entry_name, |path| self.flatten(path, entry, None));
                });
            }
            return;
        }
        if let (Some(Value::List(points)), Some(names)) =
            (message.field("points"), message.field("joint_names"))
        {
            self.trajectory(&mut path, Stamps { recorded, own }, points, names);
            return;
        }
        self.begin(Stamps { recorded, own });
        self.flatten(&mut path, message, None);
    }

    fn begin(&mut self, stamps: Stamps) {
        self.stamps.push(stamps);
    }

    /// Adds the points of a trajectory, each at its time.
    ///
    /// They replace what was planned for their time and later.
    fn trajectory(&mut self, path: &mut String, at: Stamps, points: &[Value], names: &Value) {
        if let Some(kept) = self.stamps.iter().position(|s| s.recorded >= at.recorded) {
            self.stamps.truncate(kept);
            self.samples.retain(|s| (s.message as usize) < kept);
        }
        for point in points {
            let from_start = point.field("time_from_start").and_then(nanoseconds);
            let after = from_start.unwrap_or(0);
            self.begin(Stamps {
                recorded: at.recorded.saturating_add(after),
                own: at.own.map(|t| t.saturating_add(after)),
            });
            self.flatten(path, point, Some(names));
        }
    }

    /// Adds the numbers of a value; `names` are the names of its lists' entries.
    fn flatten(&mut self, path: &mut String, value: &Value, names: Option<&Value>) {
        match value {
            Value::Number(x) => self.sample(path, *x),
            Value::Text(_) | Value::Skipped => {}
            Value::Record(fields) => {
                let naming = fields.iter().find(|(name, value)| {
                    NAMING.contains(&&**name) && matches!(value, Value::List(_))
                });
                let names = naming.map(|(_, list)| list).or(names);
                for (name, value) in fields {
                    if !NO_READING.contains(&&**name) && !name.ends_with("covariance") {
                        within(path, name, |path| self.flatten(path, value, names));
                    }
                }
            }
            Value::List(entries) => {
                let named = match names {
                    Some(Value::List(names)) if names.len() == entries.len() => Some(names),
                    _ => None,
                };
                for (i, entry) in entries.iter().enumerate() {
                    let given = named.and_then(|names| match &names[i] {
                        Value::Text(name) => Some(name.clone()),
                        _ => None,
                    });
                    let name = own_name(entry).or(given).unwrap_or(i.to_string());
                    within(path, &name, |path| self.flatten(path, entry, None));
                }
            }
        }
    }

    fn sample(&mut self, path: &str, value: f64) {
        let column = match self.places.get(path) {
            Some(place) => *place,
            None if self.names.len() < MOST_SERIES => {
                self.places.insert(path.to_owned(), self.names.len());
                self.names.push(path.to_owned());
                self.names.len() - 1
            }
            None => return,
        };
        let message = self.stamps.len() - 1;
        if let (Ok(message), Ok(column), true) = (
            u32::try_from(message),
            u32::try_from(column),
            value.is_finite(),
        ) {
            self.samples.push(Sample {
                message,
                column,
                value,
            });
        }
    }

    /// The clock that counts, and a remark where it is not that of all messages' own stamps.
    fn clock(&self, topic: &str) -> (Clock, Option<String>) {
        let apart = |s: &Stamps| Some(s.own?.saturating_sub(s.recorded));
        let mut apart: Vec<i64> = self.stamps.iter().filter_map(apart).collect();
        let (stamped, all) = (apart.len(), self.stamps.len());
        if apart.is_empty() {
            return (Clock::Recorder, None);
        }
        let middle = stamped / 2;
        let median = *apart.select_nth_unstable(middle).1;
        let seconds = median as f64 / SECOND;
        if seconds.abs() >= SAME_CLOCK {
            let remark = format!(
                "{topic}: its own stamps are {seconds:.3} s from the recorder's clock; the recorder's are used"
            );
            return (Clock::Recorder, Some(remark));
        }
        let lacking = all - stamped;
        let remark = format!(
            "{topic}: {lacking} of {all} messages have no stamp of their own; they are placed {seconds:.3} s from the recorder's, as the others are"
        );
        (
            Clock::Own { apart: median },
            (lacking > 0).then_some(remark),
        )
    }

    /// Earliest of the stamps that count, ns.
    #[must_use]
    pub fn first(&self) -> Option<i64> {
        let clock = self.clock("").0;
        self.stamps.iter().map(|s| clock.stamp(*s)).min()
    }

    /// The series in order of time, counted from `start` (ns), and a remark.
    #[must_use]
    pub fn series(self, topic: &str, start: i64) -> (Vec<Series>, Option<String>) {
        let (clock, remark) = self.clock(topic);
        let mut points: Vec<Vec<(i64, f64)>> = vec![Vec::new(); self.names.len()];
        for s in &self.samples {
            let stamp = clock.stamp(self.stamps[s.message as usize]);
            points[s.column as usize].push((stamp, s.value));
        }
        let series = self
            .names
            .into_iter()
            .zip(points)
            .map(|(name, mut points)| {
                points.sort_by_key(|(stamp, _)| *stamp);
                // Of values with the same stamp, keep the last.
                let mut kept: Vec<(i64, f64)> = Vec::with_capacity(points.len());
                for point in points {
                    match kept.last_mut() {
                        Some(last) if last.0 == point.0 => *last = point,
                        _ => kept.push(point),
                    }
                }
                let seconds = |stamp: i64| stamp.saturating_sub(start) as f64 / SECOND;
                Series {
                    name,
                    stream: topic.to_owned(),
                    time: kept.iter().map(|p| seconds(p.0)).collect(),
                    values: kept.iter().map(|p| p.1).collect(),
                }
            });
        let mut series: Vec<Series> = series.filter(|s| !s.time.is_empty()).collect();
        align_signs(&mut series);
        (series, remark)
    }
}

/// Runs with a further name on the path.
fn within(path: &mut String, name: &str, run: impl FnOnce(&mut String)) {
    let length = path.len();
    path.push('.');
    path.push_str(name);
    run(path);
    path.truncate(length);
}

/// The stamp in a record's header; `None` where it has none, or where it is 0 long after the
/// recorder's clock was.
fn stamp(record: &Value, recorded: i64) -> Option<i64> {
    let stamp = record.field("header").and_then(|h| h.field("stamp"));
    let began = (recorded as f64).abs() < SAME_CLOCK * SECOND;
    stamp.and_then(nanoseconds).filter(|t| *t != 0 || began)
}

/// The list of a message that only holds one, of records with headers of their own (`TFMessage`).
fn stamped_entries(message: &Value, recorded: i64) -> Option<(&str, &[Value])> {
    let Value::Record(fields) = message else {
        return None;
    };
    match &fields[..] {
        [(name, Value::List(entries))] => {
            let all_stamped = entries.iter().all(|e| stamp(e, recorded).is_some());
            (all_stamped && !entries.is_empty()).then_some((&**name, &entries[..]))
        }
        _ => None,
    }
}

fn own_name(record: &Value) -> Option<String> {
    let text = |name: &&str| match record.field(name) {
        Some(Value::Text(text)) if !text.is_empty() => Some(text.clone()),
        _ => None,
    };
    OWN_NAME.iter().find_map(text)
}

/// A time or duration, ns.
fn nanoseconds(value: &Value) -> Option<i64> {
    let part = |name: &str| value.field(name).and_then(Value::number);
    let (seconds, rest) = (part("sec")?, part("nanosec")?);
    (seconds as i64)
        .checked_mul(SECOND as i64)?
        .checked_add(rest as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(ns: i64) -> Value {
        Value::Record(vec![
            ("sec".into(), Value::Number((ns / 1_000_000_000) as f64)),
            ("nanosec".into(), Value::Number((ns % 1_000_000_000) as f64)),
        ])
    }

    fn header(ns: i64) -> (String, Value) {
        let header = Value::Record(vec![
            ("stamp".into(), time(ns)),
            ("frame_id".into(), Value::Text("base".into())),
        ]);
        ("header".into(), header)
    }

    fn numbers(xs: &[f64]) -> Value {
        Value::List(xs.iter().map(|x| Value::Number(*x)).collect())
    }

    fn texts(xs: &[&str]) -> Value {
        Value::List(xs.iter().map(|x| Value::Text((*x).into())).collect())
    }

    /// Stamps of today, ns.
    const NOW: i64 = 1_770_000_000_000_000_000;

    #[test]
    fn joints_are_told_apart_by_name_in_any_order() {
        let mut stream = Stream::default();
        for (k, names, position) in [(0, ["a", "b"], [1.0, 2.0]), (1, ["b", "a"], [4.0, 3.0])] {
            let stamp = NOW + k * 10_000_000;
            let message = Value::Record(vec![
                header(stamp),
                ("name".into(), texts(&names)),
                ("position".into(), numbers(&position)),
                ("effort".into(), numbers(&[])),
            ]);
            stream.push("/joint_states", stamp + 700_000, &message);
        }
        let start = stream.first().unwrap();
        assert_eq!(start, NOW);
        let (series, remark) = stream.series("/joint_states", start);
        assert!(remark.is_none());
        assert_eq!(series[0].name, "/joint_states.position.a");
        assert_eq!(series[0].values, [1.0, 3.0]);
        assert_eq!(series[0].time, [0.0, 0.01]);
        assert_eq!(series.len(), 2);
    }

    #[test]
    fn stamps_of_another_clock_give_way_to_the_recorders() {
        let mut stream = Stream::default();
        for k in 0..3 {
            let message =
                Value::Record(vec![header(1 + k * 1000), ("x".into(), Value::Number(1.0))]);
            stream.push("/t", NOW + k * 2_000_000, &message);
        }
        assert_eq!(stream.first(), Some(NOW));
        let (series, remark) = stream.series("/t", NOW);
        assert!(remark.unwrap().contains("recorder"));
        assert_eq!(series[0].time, [0.0, 0.002, 0.004]);
    }

    /// Symptom: the readings of a whole topic were late by the time that a message takes.
    ///
    /// Cause: the first message had no stamp, so that the recorder's clock was taken for all, without
    /// a word.
    #[test]
    fn a_message_without_a_stamp_leaves_the_others_theirs() {
        let (second, late) = (1_000_000_000, 40_000_000);
        let mut stream = Stream::default();
        for k in 0..5 {
            let own = if k == 0 { 0 } else { NOW + k * second };
            let message = Value::Record(vec![header(own), ("x".into(), Value::Number(k as f64))]);
            stream.push("/t", NOW + k * second + late, &message);
        }
        let (series, remark) = stream.series("/t", NOW);
        assert_eq!(series[0].time, [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert!(remark.unwrap().contains("1 of 5 messages"));
    }

    /// Symptom: poses of `/tf` were at the recorder's stamps.
    ///
    /// Cause: each transform has a header of its own, and only one of the message was looked for.
    #[test]
    fn transforms_have_stamps_of_their_own() {
        let transform = |name: &str, ns: i64, x: f64| {
            Value::Record(vec![
                header(ns),
                ("child_frame_id".into(), Value::Text(name.into())),
                ("x".into(), Value::Number(x)),
            ])
        };
        let mut stream = Stream::default();
        let (second, late) = (1_000_000_000, 40_000_000);
        for k in 0..3 {
            let at = NOW + k * second;
            let both = vec![
                transform("tool", at, k as f64),
                transform("cup", at + late / 2, -k as f64),
            ];
            let message = Value::Record(vec![("transforms".into(), Value::List(both))]);
            stream.push("/tf", at + late, &message);
        }
        assert_eq!(stream.first(), Some(NOW));
        let (series, remark) = stream.series("/tf", NOW);
        assert!(remark.is_none());
        assert_eq!(series[0].name, "/tf.transforms.tool.x");
        assert_eq!(series[0].time, [0.0, 1.0, 2.0]);
        assert_eq!(series[1].time, [0.02, 1.02, 2.02]);
    }

    #[test]
    fn a_trajectory_is_its_points_until_the_next_one() {
        let point = |ns: i64, x: f64| {
            Value::Record(vec![
                ("positions".into(), numbers(&[x, -x])),
                ("time_from_start".into(), time(ns)),
            ])
        };
        let message = |points: Vec<Value>| {
            Value::Record(vec![
                header(0),
                ("joint_names".into(), texts(&["a", "b"])),
                ("points".into(), Value::List(points)),
            ])
        };
        let mut stream = Stream::default();
        let second = 1_000_000_000;
        let first = vec![point(0, 0.0), point(second, 1.0), point(2 * second, 2.0)];
        stream.push("/plan", NOW, &message(first));
        stream.push(
            "/plan",
            NOW + second,
            &message(vec![point(0, 5.0), point(second / 2, 6.0)]),
        );
        let (series, _) = stream.series("/plan", NOW);
        assert_eq!(series[0].name, "/plan.positions.a");
        assert_eq!(series[0].time, [0.0, 1.0, 1.5]);
        assert_eq!(series[0].values, [0.0, 5.0, 6.0]);
    }

    #[test]
    fn records_in_lists_are_named_by_themselves_and_nested_names_by_theirs() {
        let mut stream = Stream::default();
        let interface = Value::Record(vec![
            ("interface_names".into(), texts(&["position", "velocity"])),
            ("values".into(), numbers(&[0.5, 0.6])),
        ]);
        let message = Value::Record(vec![
            ("joint_names".into(), texts(&["elbow"])),
            ("interface_values".into(), Value::List(vec![interface])),
            ("layout".into(), numbers(&[9.0])),
            ("orientation_covariance".into(), numbers(&[0.0; 9])),
            (
                "transforms".into(),
                Value::List(vec![Value::Record(vec![
                    ("child_frame_id".into(), Value::Text("tool".into())),
                    ("x".into(), Value::Number(3.0)),
                ])]),
            ),
        ]);
        stream.push("/d", NOW, &message);
        let (series, _) = stream.series("/d", NOW);
        let names: Vec<&str> = series.iter().map(|s| &*s.name).collect();
        assert_eq!(
            names,
            [
                "/d.interface_values.elbow.values.position",
                "/d.interface_values.elbow.values.velocity",
                "/d.transforms.tool.x",
            ]
        );
    }
}
