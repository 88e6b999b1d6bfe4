//! The working data of a diagnosis, from the logs to the verdict.

use asid_results::evidence::Evidence;

use crate::bench::Bench;
use crate::candidate::{Candidate, LeftOut};
use crate::findings::Findings;
use crate::judgement::Judgement;

/// The working data of a diagnosis, for the stages after it.
pub struct Work {
    /// Machine and logs.
    pub bench: Bench,
    /// Effects at their sites.
    pub candidates: Vec<Candidate>,
    /// Candidates that could not be tried.
    pub left_out: Vec<LeftOut>,
    /// What the search found.
    pub findings: Findings,
    /// What the decision rests on.
    pub evidence: Evidence,
    /// The judgement of that evidence.
    pub judgement: Judgement,
    /// Values of the study's parameters in the model as given.
    pub nominal: Vec<f64>,
}
