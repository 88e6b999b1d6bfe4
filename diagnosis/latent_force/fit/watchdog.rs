//! Watchdog for the steps of a fit (Chamberlain and others 1982): a step may lose evidence at
//! first, and is undone if later steps do not regain it.
//!
//! Losses are accepted because a narrow valley bends away from its tangent.

use crate::latent_force::context::Context;
use crate::latent_force::estimate::Estimate;

/// Factor by which a step is shortened where the whole made things worse.
const SHORTER: f64 = 0.3;
/// Rounds without a rise that are accepted.
const PATIENCE: usize = 2;
/// Most shorter steps that are tried from one point.
const FAILURES: usize = 2;

/// Values of a model and an estimate about them.
pub(super) type Place = (Vec<f64>, Estimate);

/// A point from which steps are taken, with its evidence, its predicted evidence and where its step
/// leads.
struct Anchor {
    /// Evidence there, and that evidence plus the gain that a step predicts.
    here: f64,
    hoped: f64,
    from: Place,
    to: Place,
}

/// What a linearisation shows about the step that led to it.
pub(super) struct Outcome {
    /// Evidence there, and that evidence plus the gain that a further step predicts.
    here: f64,
    hoped: f64,
    /// Whether either has risen enough to count.
    pub(super) rose: bool,
    /// Whether the linearisations have misled the fit.
    pub(super) astray: bool,
}

/// The watchdog of a fit.
pub(super) struct Watchdog {
    /// Change of evidence that counts as a rise.
    rise: f64,
    /// Whether evidence scatters without cause, as that of segments does.
    wanders: bool,
    anchor: Option<Anchor>,
    /// Fraction of the anchor's step that was tried last.
    part: f64,
    /// Rounds without a rise, and shorter steps tried from the anchor.
    waited: usize,
    failed: usize,
}

impl Watchdog {
    pub(super) fn new(rise: f64, wanders: bool) -> Self {
        Self {
            rise,
            wanders,
            anchor: None,
            part: 1.0,
            waited: 0,
            failed: 0,
        }
    }

    /// Judges a linearisation by its evidence `here`, by the gain that a step from it predicts, and
    /// by the `best` evidence before.
    pub(super) fn look(&mut self, (here, promised): (f64, f64), best: Option<f64>) -> Outcome {
        let hoped = here + promised;
        let anchor = self.anchor.as_ref();
        let rose = best.is_none_or(|b| here > b + self.rise)
            || anchor.is_none_or(|a| hoped > a.hoped + self.rise);
        self.waited = if rose { 0 } else { self.waited + 1 };
        // A step that lost more than its predicted gain is not in a narrow valley.
        let lost = |a: &Anchor| a.here - here > (a.hoped - a.here).max(self.rise);
        let lost = !self.wanders && anchor.is_some_and(lost);
        Outcome {
            here,
            hoped,
            rose,
            astray: self.waited > PATIENCE || lost,
        }
    }

    /// Whether the shorter steps have failed too.
    pub(super) fn is_out_of_steps(&self) -> bool {
        self.failed == FAILURES
    }

    /// Returns the end of a shorter step from the anchor; `None` where there is no anchor.
    pub(super) fn shorter(&mut self, context: &Context<'_>) -> Option<Place> {
        let Anchor { from, to, .. } = self.anchor.as_ref()?;
        self.part *= SHORTER;
        self.failed += 1;
        self.waited = 0;
        let values = from.0.iter().zip(&to.0);
        let values = values.map(|(a, b)| a + self.part * (b - a));
        Some((values.collect(), from.1.towards(context, &to.1, self.part)))
    }

    /// Makes the point of an outcome the anchor of the step that leads `from` it `to` another
    /// point.
    pub(super) fn anchor(&mut self, at: &Outcome, from: Place, to: Place) {
        self.part = 1.0;
        self.failed = 0;
        self.anchor = Some(Anchor {
            here: at.here,
            hoped: at.hoped,
            from,
            to,
        });
    }
}
