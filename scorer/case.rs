//! One case: what it is, what was said of it, how that stands.

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
    /// What it said; `Err` is why it said nothing.
    pub answer: Result<Answer, String>,
    /// Wall time, s.
    pub seconds: f64,
    /// Largest memory that its process held, MiB; `None` where the system does not say.
    pub memory_mib: Option<f64>,
}

/// What a false alarm names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Alarm {
    /// Nothing that is not there.
    Quiet,
    /// An effect that is not there, or dirt far too large.
    Effect,
    /// `unknown` in a clean world.
    Unknown,
    /// `unknown` in a dirty world: counted apart.
    Apart,
}

/// A case with its score.
#[derive(Clone, Debug, Serialize)]
pub struct Case {
    /// Name.
    pub case: String,
    /// Kind of machine.
    pub world: String,
    /// `none`, `unknown`, `single`, `several` or `group`.
    pub kind: &'static str,
    /// Causes without their sites.
    pub cause: String,
    /// Whether everything is a little off.
    pub dirty: bool,
    /// How far the causes stand out of the dirt; 0 in clean worlds.
    pub factor: f64,
    /// Excess gap of the causes, in units of the noise.
    pub cause_gap: f64,
    /// Faults of the log.
    pub log_faults: Vec<String>,
    /// Faults of wiring, by name.
    pub wiring_faults: Vec<String>,
    /// What is the case.
    pub truth: Vec<String>,
    /// What was said; empty where nothing was.
    pub verdict: Vec<String>,
    /// Probability stated of it.
    pub probability: f64,
    /// How it stands.
    pub standing: Standing,
    /// Whether everything is so that it claims: the event of the stated probability.
    pub claims_hold: bool,
    /// Probability given to right sets.
    pub true_probability: f64,
    /// Right, or a right set among the two most probable ones.
    pub top2: bool,
    /// Right, or a right set among the rivals that it cannot tell from it.
    pub covered: bool,
    /// Sets in the ambiguity set, the verdict included; 0 without an answer.
    pub set_size: usize,
    /// In a world without a cause: what the answer alarms of.
    pub alarm: Option<Alarm>,
    /// Where.
    pub localization: Localization,
    /// Wiring.
    pub wiring: Wiring,
    /// Values of effects that were rightly named.
    pub effect_values: Vec<Estimate>,
    /// Values of the study's parameters.
    pub parameters: Vec<Estimate>,
    /// What the scorer's own replays say.
    pub physics: Physics,
    /// Wall time, s.
    pub seconds: f64,
    /// Largest memory, MiB.
    pub memory_mib: Option<f64>,
    /// Why there is no answer.
    pub failure: Option<String>,
}

impl Case {
    /// Scores a run by its label, and by what the scorer's replays say of the verdict.
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

    /// Whether its answer may name what is missing; so also where there is none.
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
