//! What a diagnosis works with, from the logs to the verdict.

use asid_results::evidence::Evidence;

use crate::bench::Bench;
use crate::candidate::{Candidate, LeftOut};
use crate::findings::Findings;
use crate::judgement::Judgement;

/// What a diagnosis has worked with, for what comes after it.
pub struct Work {
    /// Machine and logs.
    pub bench: Bench,
    /// Effects at their sites.
    pub candidates: Vec<Candidate>,
    /// Those that could not be tried.
    pub left_out: Vec<LeftOut>,
    /// What the search found.
    pub findings: Findings,
    /// What the decision rests on.
    pub evidence: Evidence,
    /// What was made of it.
    pub judgement: Judgement,
    /// Values of the study's parameters in the model as given.
    pub nominal: Vec<f64>,
}
