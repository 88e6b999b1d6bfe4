//! One case: its label, its answer and its score.

use serde::Serialize;

use crate::answer::Answer;
use crate::judge::{Judge, Standing};
use crate::localization::Localization;
use crate::physics::Physics;
use crate::values::{self, Estimate};
use crate::wiring::Wiring;

/// How a diagnosis ended.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its answer, or the reason why there is none.
    pub answer: Result<Answer, String>,
    /// Wall time, s.
    pub seconds: f64,
    /// Peak memory of its process, MiB; `None` if the system does not report it.
    pub memory_mib: Option<f64>,
}

/// The kind of false alarm of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Alarm {
    /// No false alarm.
    Quiet,
    /// An effect that is absent, or dirt that is far too large.
    Effect,
    /// `unknown` in a clean world.
    Unknown,
    /// `unknown` in a dirty world: counted separately.
    Apart,
}

/// A scored case.
#[derive(Clone, Debug, Serialize)]
pub struct Case {
    /// Name.
    pub case: String,
    /// Kind of machine.
    pub world: String,
    /// `none`, `unknown`, `single`, `several` or `group`.
    pub kind: &'static str,
    /// Names of the causes without their sites.
    pub cause: String,
    /// Whether the world is dirty: everything deviates a little.
    pub dirty: bool,
    /// Multiple of the gap of the dirt that the causes reach; 0 in clean worlds.
    pub factor: f64,
    /// Excess gap of the causes, in units of the noise.
    pub cause_gap: f64,
    /// Faults of the log.
    pub log_faults: Vec<String>,
    /// Names of the wiring faults.
    pub wiring_faults: Vec<String>,
    /// The true set.
    pub truth: Vec<String>,
    /// The verdict's set; empty without an answer.
    pub verdict: Vec<String>,
    /// Stated probability of the verdict.
    pub probability: f64,
    /// Standing of the verdict.
    pub standing: Standing,
    /// Whether all claims of the verdict are true: the event of the stated probability.
    pub claims_hold: bool,
    /// Probability given to right sets.
    pub true_probability: f64,
    /// Whether it is right, or has a right set among the two most probable.
    pub top2: bool,
    /// Whether it is right, or has a right set among the rivals that it cannot distinguish from its
    /// verdict.
    pub covered: bool,
    /// Number of sets in the ambiguity set, the verdict included; 0 without an answer.
    pub set_size: usize,
    /// Kind of false alarm, in a world without a cause.
    pub alarm: Option<Alarm>,
    /// Score of where the answer locates the excess.
    pub localization: Localization,
    /// Score of the wiring faults.
    pub wiring: Wiring,
    /// Values of rightly named effects.
    pub effect_values: Vec<Estimate>,
    /// Values of the study's parameters.
    pub parameters: Vec<Estimate>,
    /// Results of the scorer's own replays.
    pub physics: Physics,
    /// Wall time, s.
    pub seconds: f64,
    /// Peak memory, MiB.
    pub memory_mib: Option<f64>,
    /// Reason why there is no answer.
    pub failure: Option<String>,
}

impl Case {
    /// Scores a run by its label and by the scorer's replays of the verdict.
    #[must_use]
    pub fn new(name: &str, run: &Run, judge: &Judge<'_>, physics: Physics) -> Self {
        let label = judge.label;
        let mut case = Self::unanswered(name, run, judge, physics);
        let Ok(answer) = &run.answer else {
            return case;
        };
        if answer.names_nothing() {
            case.standing = Standing::NamesNothing;
            case.parameters = values::of_study(label, answer);
            return case;
        }
        let set = answer.verdict.set();
        let mut standing = judge.of_set(&set, answer);
        let same = case.physics.same_as_truth == Some(true);
        let forbidden = label.must_not.iter().any(|e| judge.sites.holds(&set, e));
        if !standing.is_right() && same && !forbidden {
            standing = Standing::SamePhysics;
        }
        let is_right =
            |s: &[String]| judge.of_set(s, answer).is_right() || (standing.is_right() && s == set);
        case.probability = answer.verdict.probability;
        case.standing = standing;
        case.claims_hold = judge.claims_hold(answer, standing);
        let hypotheses = answer.hypotheses.iter().map(|h| {
            let mut effects = h.effects.clone();
            effects.sort();
            (effects, h.probability)
        });
        let mut hypotheses: Vec<(Vec<String>, f64)> = hypotheses.collect();
        hypotheses.sort_by(|a, b| b.1.total_cmp(&a.1));
        let right = hypotheses.iter().filter(|h| is_right(&h.0));
        case.true_probability = right.fold(0.0_f64, |sum, h| sum + h.1).min(1.0);
        case.top2 = standing.is_right() || hypotheses.iter().take(2).any(|h| is_right(&h.0));
        let rivals = &answer.verdict.ambiguous_with;
        case.covered = standing.is_right() || rivals.iter().any(|s| is_right(s));
        case.set_size = 1 + rivals.len();
        case.alarm = label
            .is_none()
            .then_some(match (standing, &*answer.verdict.kind) {
                (Standing::Apart, _) => Alarm::Apart,
                (s, _) if s.is_right() => Alarm::Quiet,
                (_, "unknown") => Alarm::Unknown,
                _ => Alarm::Effect,
            });
        case.localization = Localization::of(label, answer);
        case.effect_values = values::of_effects(label, answer, judge.sites);
        case.parameters = values::of_study(label, answer);
        case.verdict = set;
        case
    }

    /// Whether its answer may name what is missing; also true without an answer.
    #[must_use]
    pub fn names(&self) -> bool {
        self.standing != Standing::NamesNothing
    }

    fn unanswered(name: &str, run: &Run, judge: &Judge<'_>, physics: Physics) -> Self {
        let label = judge.label;
        Self {
            case: name.to_owned(),
            world: label.world.clone(),
            kind: label.kind(),
            cause: label.cause(),
            dirty: label.dirty,
            factor: label.factor,
            cause_gap: label.cause_gap(),
            log_faults: label.log_faults.clone(),
            wiring_faults: label.wiring.iter().map(|w| w.fault.clone()).collect(),
            truth: judge.truth(),
            verdict: Vec::new(),
            probability: 0.0,
            standing: Standing::NoAnswer,
            claims_hold: false,
            true_probability: 0.0,
            top2: false,
            covered: false,
            set_size: 0,
            alarm: None,
            localization: Localization::default(),
            wiring: Wiring::of(label, run.answer.as_ref().ok()),
            effect_values: Vec::new(),
            parameters: Vec::new(),
            physics,
            seconds: run.seconds,
            memory_mib: run.memory_mib,
            failure: run.answer.as_ref().err().cloned(),
        }
    }
}
