//! Candidates, sets and searches written by hand, for tests.

use asid_core::registry::find;
use asid_effects::{EffectEntry, EffectSpec};
use nalgebra::DMatrix;

use crate::candidate::Candidate;
use crate::latent_force::estimate::{Estimate, Missing};
use crate::latent_force::fit::{Fitted, Hypothesis, Slopes};
use crate::latent_force::fitted_value::Unknown;
use crate::latent_force::smoother::NoiseModel;

use super::{Names, Outcome, Round, Seen, Set, Sight};

/// A candidate by its label, with the ranges of its effect.
pub fn candidate(label: &str) -> Candidate {
    let (name, site) = label.split_once('@').expect("a label has a site");
    let entry = find::<EffectEntry>(name).expect("the catalogue has it");
    let effect = (entry.make)();
    Candidate {
        starts: Vec::new(),
        large: Vec::new(),
        ranges: effect.parameters().iter().map(|p| p.range).collect(),
        spec: EffectSpec {
            name: name.to_owned(),
            site: site.to_owned(),
            values: Vec::new(),
        },
        effect: effect.into(),
        episodes: 1,
        is_tolerance: false,
    }
}

/// The same within the tolerance of an ordinary machine.
pub fn tolerance(label: &str) -> Candidate {
    Candidate {
        is_tolerance: true,
        ..candidate(label)
    }
}

/// A model with candidates at their nulls, fitted to an evidence.
pub fn fitted(candidates: &[Candidate], members: &[usize], evidence: f64) -> Fitted {
    let (mut hypothesis, mut theta) = (Hypothesis::default(), Vec::new());
    for candidate in members.iter().map(|&c| &candidates[c]) {
        hypothesis.specs.push(candidate.spec.clone());
        let own = candidate.unknowns().into_iter();
        for ((parameter, free), p) in own.zip(candidate.parameters()) {
            theta.push(p.null);
            hypothesis.unknowns.push(Unknown {
                bounds: parameter.range,
                parameter,
                center: p.null,
                deviation: 1.0,
                free,
                is_tolerance: candidate.is_tolerance,
            });
        }
    }
    let n = hypothesis.free().len();
    Fitted {
        hypothesis,
        theta,
        evidence,
        wander: 0.0,
        promised: 0.0,
        covariance: DMatrix::identity(n, n),
        ahead: vec![0.0; n],
        estimate: Estimate {
            trajectory: Vec::new(),
            read: Vec::new(),
            noise: NoiseModel {
                q: Vec::new(),
                tau: Vec::new(),
                white: Vec::new(),
                r: Vec::new(),
            },
            b: Vec::new(),
            free: Vec::new(),
            scatter: Vec::new(),
            least_white: Vec::new(),
            told: Vec::new(),
            excess: Vec::new(),
            misled: Vec::new(),
            rolls: 0,
            smoothed: Vec::new(),
            log_likelihood: 0.0,
        },
        slopes: Slopes::default(),
    }
}

/// A fitted set of named candidates, each of `names` one name, and of tolerances.
pub fn set(
    candidates: &[Candidate],
    (names, tolerances): (&[&[usize]], &[usize]),
    evidence: f64,
) -> Set {
    let members = [&names.concat()[..], tolerances].concat();
    let mut all = Names::default();
    names.iter().for_each(|name| all.add(name.to_vec()));
    Set {
        fitted: fitted(candidates, &members, evidence),
        candidates: members,
        names: all,
    }
}

/// A round upon a base, with what was screened by the gain of each, raced and confirmed.
pub fn round(
    base: &[usize],
    screened: &[(&[usize], f64)],
    (raced, confirmed): (&[&[usize]], Vec<Set>),
) -> Round {
    let seen = |(set, gain): &(&[usize], f64)| Seen {
        set: set.to_vec(),
        names: set.len(),
        gain: *gain,
    };
    Round {
        base: base.to_vec(),
        screened: screened.iter().map(seen).collect(),
        alike: (Vec::new(), DMatrix::zeros(0, 0)),
        sight: Sight::default(),
        raced: raced.iter().map(|set| set.to_vec()).collect(),
        confirmed,
        tolerances: None,
    }
}

/// A search that came to its end with a set; the model without effects has the evidence zero.
pub fn outcome(rounds: Vec<Round>, best: Set) -> Outcome {
    let missing = Missing {
        force: 1.0,
        readings: 0.0,
        share: 0.0,
    };
    Outcome {
        none: fitted(&[], &[], 0.0),
        rounds,
        missing: [missing; 2],
        best,
        untried: Vec::new(),
    }
}
