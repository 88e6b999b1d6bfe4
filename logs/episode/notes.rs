//! What was passed over or mended as a log was read.

/// What a reader did beside reading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogNotes {
    /// Columns that the model does not know, in the log's order.
    pub passed_over: Vec<String>,
    /// Columns among them that look like a misspelt sensor or command: the column, and the name that the model has.
    pub misspelt: Vec<(String, String)>,
    /// Columns of sensors in which every reading is missing.
    pub empty: Vec<String>,
    /// Sensors without a column that have no name in the model, by the names that they get: `sensor` and their number.
    pub nameless: Vec<String>,
    /// Unit of the stamps where it is not the second.
    pub time_unit: Option<&'static str>,
    /// Rows left out because another has the same stamp.
    pub doubled: usize,
    /// Rows that were put in order.
    pub reordered: usize,
    /// Commands that were missing, and held from the row before.
    pub held: usize,
    /// What a reader of another stack's files says: streams that could not be read, clocks that disagree.
    pub remarks: Vec<String>,
}

impl LogNotes {
    /// One sentence for each.
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

    /// Whether a reading may have been lost: a column that looks like a sensor's, one of a sensor that is empty, or one that nobody knows where
    /// a sensor has no name.
    #[must_use]
    pub fn is_suspicious(&self) -> bool {
        let unnamed = !self.nameless.is_empty() && !self.passed_over.is_empty();
        unnamed || !(self.misspelt.is_empty() && self.empty.is_empty())
    }
}
