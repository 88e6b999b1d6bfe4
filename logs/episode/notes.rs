//! What was passed over or mended as a log was read.

/// What a reader did beside reading.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LogNotes {
    /// Columns that the model does not know, in the log's order.
    pub passed_over: Vec<String>,
    /// Columns among them that look like a misspelt sensor or command: the column, and the name that the model has.
    pub misspelt: Vec<(String, String)>,
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

    /// Whether a reading may have been lost: a column that looks like a sensor's.
    #[must_use]
    pub fn is_suspicious(&self) -> bool {
        !self.misspelt.is_empty()
    }
}
