//! Series of numbers over time.

/// One column of a log: a number over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name: the topic or feature and the path to the number in it: `/joint_states.position.elbow`.
    pub name: String,
    /// The stream (topic) that it shares with others; empty in a file that is one table.
    pub stream: String,
    /// Stamps, s from the log's start, in order.
    pub time: Vec<f64>,
    /// Values, one for each stamp, finite.
    pub values: Vec<f64>,
}
