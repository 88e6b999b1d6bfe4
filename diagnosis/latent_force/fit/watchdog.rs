//! Steps that may lose at first, and are taken back where they do not win (a watchdog: Chamberlain and others 1982), for a narrow valley
//! bends away from its tangent.

use crate::latent_force::context::Context;
use crate::latent_force::estimate::Estimate;

/// Part of a step that is tried where the whole made things worse.
const SHORTER: f64 = 0.3;
/// Rounds without a rise that are gone on with.
const PATIENCE: usize = 2;
/// Shorter steps from one point that are tried, at most.
const FAILURES: usize = 2;

/// Values of a model and an estimate about them.
pub(super) type Place = (Vec<f64>, Estimate);

/// A point from which steps are taken: what it and its step promise, and where that leads.
struct Anchor {
    /// Evidence there, and with what a step promises.
    here: f64,
    hoped: f64,
    from: Place,
    to: Place,
}

/// What a linearisation shows of the step that led to it.
pub(super) struct Outcome {
    /// Evidence there, and with what a further step promises.
    here: f64,
    hoped: f64,
    /// Whether either has risen by what counts.
    pub(super) rose: bool,
    /// Whether the tangents have led astray.
    pub(super) astray: bool,
}

/// The watchdog of a fit.
pub(super) struct Watchdog {
    /// Evidence that counts as a rise.
    rise: f64,
    /// Whether evidence falls by itself, as that of segments does.
    wanders: bool,
    anchor: Option<Anchor>,
    /// Part of the anchor's step that was tried last.
    part: f64,
    /// Rounds without a rise, and shorter steps from the anchor.
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

    /// Looks at the evidence `here`, at what a step promises from here, and at the `best` evidence before.
    pub(super) fn look(&mut self, (here, promised): (f64, f64), best: Option<f64>) -> Outcome {
        let hoped = here + promised;
        let anchor = self.anchor.as_ref();
        let rose = best.is_none_or(|b| here > b + self.rise)
            || anchor.is_none_or(|a| hoped > a.hoped + self.rise);
        self.waited = if rose { 0 } else { self.waited + 1 };
        // A step that lost more than it had promised to win is no narrow valley.
        let lost = |a: &Anchor| a.here - here > (a.hoped - a.here).max(self.rise);
        let lost = !self.wanders && anchor.is_some_and(lost);
        Outcome {
            here,
            hoped,
            rose,
            astray: self.waited > PATIENCE || lost,
        }
    }

    /// Whether shorter steps have failed too.
    pub(super) fn is_out_of_steps(&self) -> bool {
        self.failed == FAILURES
    }

    /// Less of the way from the anchor; `None` where there is none.
    pub(super) fn shorter(&mut self, context: &Context<'_>) -> Option<Place> {
        let Anchor { from, to, .. } = self.anchor.as_ref()?;
        self.part *= SHORTER;
        self.failed += 1;
        self.waited = 0;
        let values = from.0.iter().zip(&to.0);
        let values = values.map(|(a, b)| a + self.part * (b - a));
        Some((values.collect(), from.1.towards(context, &to.1, self.part)))
    }

    /// Makes the point of an outcome the anchor of a step that was taken `from` it `to` another.
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
