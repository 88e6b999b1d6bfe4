//! Notes of what was skipped or repaired while a log was read.

use asid_core::{Error, Result};

use super::clock::stamps_read_as;

/// What a reader skipped and repaired.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogNotes {
    /// Columns that the model does not know, in the log's order.
    pub passed_over: Vec<String>,
    /// Pairs of an unknown column and the sensor or command that it nearly matches.
    pub misspelt: Vec<(String, String)>,
    /// Columns of sensors without any reading.
    pub empty: Vec<String>,
    /// Sensors that `[[column]]` maps and the log lacks, each with the column of the first entry
    /// that is mapped.
    pub lacking: Vec<(String, String)>,
    /// Sensors without a column and without a name in the model, by their default names.
    ///
    /// The default name is `sensor` and the sensor's number.
    pub nameless: Vec<String>,
    /// Unit of the stamps, if it is not the second.
    pub time_unit: Option<&'static str>,
    /// Rows left out because another has the same stamp.
    pub doubled: usize,
    /// Rows that were sorted.
    pub reordered: usize,
    /// Missing commands, filled in from the row before.
    pub held: usize,
    /// Sensors whose angles jumped by a turn, with the number of jumps that were taken out.
    pub turns: Vec<(String, usize)>,
    /// Orientations that are no rotation and count as missing: what they are of, and their number.
    pub lost: Vec<(String, usize)>,
    /// Remarks of readers of other stacks' files: unreadable streams, disagreeing clocks.
    pub remarks: Vec<String>,
}

/// Refuses a mapping of a sensor whose column is in none of the logs; each log has its `notes`.
///
/// # Errors
/// When there is one; the message is one line.
pub fn check_mapped_columns<'n>(notes: impl IntoIterator<Item = &'n LogNotes>) -> Result<()> {
    let mut notes = notes.into_iter();
    let Some(first) = notes.next() else {
        return Ok(());
    };
    let mut nowhere: Vec<&(String, String)> = first.lacking.iter().collect();
    for others in notes {
        nowhere.retain(|lacking| others.lacking.contains(lacking));
    }
    let Some((sensor, column)) = nowhere.first() else {
        return Ok(());
    };
    let near = Error::nearest(column, first.passed_over.iter().map(|name| &**name));
    let near = near.map_or_else(String::new, |near| format!("; is it `{near}`?"));
    Err(Error::Config {
        key: "column".into(),
        message: format!("[[column]] of sensor `{sensor}`: no log has a column `{column}`{near}"),
    })
}

impl LogNotes {
    /// Message for a log without a column of any sensor.
    pub(super) fn without_sensor(&self) -> String {
        let lacking = self.lacking.first();
        let lacking = lacking.map(|(sensor, column)| {
            format!(": column `{column}`, which [[column]] gives to `{sensor}`, is missing")
        });
        let near = self.misspelt.first();
        let near = near.map(|(column, name)| format!("; is `{column}` its `{name}`?"));
        let why = lacking.or(near).unwrap_or_default();
        format!("has no column of a sensor of the scene{why}")
    }

    /// The notes as lines, one sentence each.
    #[must_use]
    pub fn lines(&self) -> Vec<String> {
        let mut all = Vec::new();
        if !self.passed_over.is_empty() {
            let names: Vec<String> = self.passed_over.iter().map(|n| format!("`{n}`")).collect();
            all.push(format!(
                "passed over {}, which the model does not know",
                names.join(", ")
            ));
        }
        for (column, name) in &self.misspelt {
            all.push(format!(
                "`{column}` looks like `{name}`, which has no column: `[[column]] name = \"{name}\" from = \"{column}\"` would read it"
            ));
        }
        for column in &self.empty {
            all.push(format!(
                "every reading of column `{column}` is missing: nothing is said of its sensor"
            ));
        }
        for name in &self.nameless {
            all.push(format!(
                "the sensor of the model that has no name is called `{name}`, and no column is: name it in the model as its column is named, \
                 or map it by `[[column]] name = \"{name}\"`"
            ));
        }
        if let Some(unit) = self.time_unit {
            all.push(stamps_read_as(unit));
        }
        for (count, what) in [
            (self.doubled, "rows left out, since another has their stamp"),
            (self.reordered, "rows put in the order of their stamps"),
            (self.held, "missing commands held from the row before"),
        ] {
            if count > 0 {
                all.push(format!("{what}: {count}"));
            }
        }
        for (sensor, jumps) in &self.turns {
            all.push(format!(
                "the angle `{sensor}` is reported within one turn: its turns are counted (jumps by a turn: {jumps})"
            ));
        }
        for (name, count) in &self.lost {
            all.push(format!(
                "{count} orientations of `{name}` are no rotation, as of a lost tracker (a norm below 0.5 or above 2): they count as missing"
            ));
        }
        all.extend(self.remarks.iter().cloned());
        all
    }

    /// Whether a sensor's readings may be missing by mistake.
    ///
    /// A column nearly matches a sensor, a sensor's column is empty, or an unknown column may
    /// belong to a sensor without a name.
    #[must_use]
    pub fn is_suspicious(&self) -> bool {
        let unnamed = !self.nameless.is_empty() && !self.passed_over.is_empty();
        unnamed || !(self.misspelt.is_empty() && self.empty.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::tests::layout;
    use crate::episode::{ColumnMapping, read_mapped};

    /// Notes of a log with some columns after time and command, whose `[[column]]` are `mappings`.
    fn notes_of(columns: &str, mappings: &[ColumnMapping]) -> LogNotes {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let cells = ",1".repeat(columns.split(',').count());
        let text = format!("time,ctrl.servo,{columns}\n0,0{cells}\n0.1,0{cells}\n");
        std::fs::write(&path, text).unwrap();
        read_mapped(&path, &layout(), mappings).unwrap().1
    }

    /// Symptom: a study was refused since one of its logs lacks a sensor, with the words "sensor
    /// `angle` has 1 entries". A wrong column in the mapping of each entry of a vector went
    /// unnoticed.
    ///
    /// Cause: a mapping by the name of the sensor was taken for a promise that each log has its
    /// column, and one by the name of an entry was not looked at.
    #[test]
    fn a_mapped_column_may_lack_in_some_logs_but_not_in_all() {
        let from = |name: &str, from: &str| ColumnMapping {
            from: Some(from.into()),
            ..ColumnMapping::of(name)
        };
        let tip = ["tip.0", "tip.1", "tip.2"].map(|name| from(name, &name.replace("tip", "hand")));
        let one = notes_of("angle", &tip[1..2]);
        assert_eq!(one.lacking, [("tip".into(), "hand.1".into())]);
        let mappings = [&[from("angle", "joint")][..], &tip].concat();
        let all = notes_of("joint,hand.0,hand.1,hand.2", &mappings);
        assert_eq!(all.lacking, []);
        let other = notes_of("jiont,hand.0,hand.1,hand.2", &mappings);
        assert_eq!(other.lacking, [("angle".into(), "joint".into())]);
        let another = notes_of("joint", &mappings);
        assert_eq!(another.lacking, [("tip".into(), "hand.0".into())]);
        assert!(check_mapped_columns([&other, &all]).is_ok());
        assert!(check_mapped_columns([&another, &other]).is_ok());
        let error = check_mapped_columns([&other, &other]).unwrap_err();
        let said = error.to_string();
        assert!(said.ends_with("no log has a column `joint`; is it `jiont`?"));
        assert_eq!(said.lines().count(), 1);
        assert!(check_mapped_columns([&another, &another]).is_err());
    }
}
