//! Notes of what was skipped or repaired while a log was read.

/// What a reader skipped and repaired.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogNotes {
    /// Columns that the model does not know, in the log's order.
    pub passed_over: Vec<String>,
    /// Pairs of an unknown column and the sensor or command that it nearly matches.
    pub misspelt: Vec<(String, String)>,
    /// Columns of sensors without any reading.
    pub empty: Vec<String>,
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
    /// Remarks of readers of other stacks' files: unreadable streams, disagreeing clocks.
    pub remarks: Vec<String>,
}

impl LogNotes {
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
            all.push(format!(
                "stamps are in {unit}: brought to seconds from the first"
            ));
        }
        for (count, what) in [
            (self.doubled, "rows with the stamp of another left out"),
            (self.reordered, "rows put in the order of their stamps"),
            (self.held, "missing commands held from the row before"),
        ] {
            if count > 0 {
                all.push(format!("{count} {what}"));
            }
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
