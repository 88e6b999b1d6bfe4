//! The parameters of the decision.

use crate::confidence::Confidence;

/// Parameters of the decision.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Divisor of the evidence before it becomes a probability: the noise model is not exactly that
    /// of the machine.
    pub temperature: f64,
    /// Difference of evidence up to which two sets are not distinguished: odds of 20 after the
    /// temperature.
    pub apart: f64,
    /// Share of the missing force's power, or of the gap's, left without a name at which `unknown`
    /// has even odds.
    ///
    /// It is the midpoint of a logistic in the logarithm of that share.
    pub unexplained: f64,
    /// Scale of that logistic.
    pub sharpness: f64,
    /// Open-loop gap, in standard deviations of the noise and without the engine's own error, at
    /// which a missing force without a name counts as a gap.
    ///
    /// Training worlds without a cause have at most 1.08 (22 clean ones, seed 3141), those whose
    /// cause was not named 1.2 to 4.
    pub gap: f64,
    /// Scale of the logistic about that gap.
    pub gap_scale: f64,
    /// Share of a small gap's power that an effect must close in replays, of the training logs and
    /// of the held-out logs.
    pub closes: f64,
    /// How far a verdict can be trusted.
    pub confidence: Confidence,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            temperature: 1.5,
            apart: 4.5,
            unexplained: 0.5,
            sharpness: 0.35,
            gap: 1.35,
            gap_scale: 0.1,
            closes: 0.5,
            confidence: Confidence::default(),
        }
    }
}

/// A parameter by its name.
pub type Rule = (&'static str, fn(&mut Rules) -> &mut f64);

impl Rules {
    /// All parameters, so that each can be changed and the decision repeated.
    pub const ALL: [Rule; 16] = [
        ("temperature", |r| &mut r.temperature),
        ("apart", |r| &mut r.apart),
        ("unexplained", |r| &mut r.unexplained),
        ("sharpness", |r| &mut r.sharpness),
        ("gap", |r| &mut r.gap),
        ("gap_scale", |r| &mut r.gap_scale),
        ("closes", |r| &mut r.closes),
        ("confidence.named", |r| &mut r.confidence.named),
        ("confidence.evidence", |r| &mut r.confidence.evidence),
        ("confidence.stopped", |r| &mut r.confidence.stopped),
        ("confidence.gap_left", |r| &mut r.confidence.gap_left),
        ("confidence.more_laws", |r| &mut r.confidence.more_laws),
        ("confidence.ordinary", |r| &mut r.confidence.ordinary),
        ("confidence.unknown", |r| &mut r.confidence.unknown),
        ("confidence.beside", |r| &mut r.confidence.beside),
        ("confidence.screening", |r| &mut r.confidence.screening),
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_can_be_changed_by_its_name() {
        for (name, field) in Rules::ALL {
            let mut rules = Rules::default();
            let before = *field(&mut rules);
            *field(&mut rules) *= 2.0;
            assert_eq!(*field(&mut rules), 2.0 * before, "{name}");
        }
    }
}
