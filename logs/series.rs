//! A number over time.

/// One column of a log: a number over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name: the topic or feature, and the way to the number in it, such as `/joint_states.position.elbow`.
    pub name: String,
    /// The stream that it came in with others: a topic; empty in a file that is one table.
    pub stream: String,
    /// Stamps, s from the log's start, in order.
    pub time: Vec<f64>,
    /// Values, one a stamp, finite.
    pub values: Vec<f64>,
}
