//! The model without effects, fitted in the shortest segments, or in the longest whose replays do
//! not scatter.

use asid_core::{Error, Progress, Result};

use crate::bench::Bench;
use crate::data::Logs;
use crate::findings::Repeats;
use crate::latent_force::context::{Context, begin};
use crate::latent_force::fit::{Fitted, Hypothesis, fit, settle_noise};
use crate::latent_force::scatter::Scatter;
use crate::latent_force::segments::DURATIONS;
use crate::machine::Machine;
use crate::study::Study;

use super::ROUNDS;
use super::rows::Rows;

/// Linearisations of a first smoothing, and rounds of EM.
const FIRST: (usize, usize) = (4, 8);
/// The same for segments, whose noise is known except for what they leave: the fit continues from
/// there.
const FIRST_OF_SEGMENTS: (usize, usize) = (2, 8);
/// Linearisations of a fit in segments that are not the longest: enough to initialise the longer
/// ones.
const SHORT: usize = 4;
/// Share of the segments' rows from which on segments are not made longer, if these rows scatter by
/// more than their noise.
///
/// Replays that cannot be repeated lose what length gains.
const LOST: f64 = 0.3;

/// Share of the segments from which on segments are not made longer, if their last replay did not
/// achieve what its derivatives predicted.
///
/// The evidence of such segments rests on misleading derivatives. For pushed pucks that are read
/// rarely, the share is a quarter and more in cases whose names come out by chance. For balls that
/// roll and bounce it is a sixth at most.
const MISLED: f64 = 0.2;

/// The fitted model without effects.
pub(super) struct Stands<'a> {
    /// The data that it explains.
    pub(super) context: Context<'a>,
    /// The fit.
    pub(super) none: Fitted,
    /// How well replays of the longest segments that were tried can be repeated; `None` if no
    /// bodies touch.
    pub(super) repeats: Option<Repeats>,
}

/// Length of segments.
#[derive(Clone, Copy)]
enum Length {
    /// A duration, s, within a stretch of contact.
    Of(f64),
    /// A whole log, from its first row on.
    Log,
}

/// A fit in segments of some length, or the scatter of their replays if the segments are too long.
enum Tried<'a> {
    Stands(Box<Stands<'a>>),
    Scatters(Repeats),
}

/// The model to fit and its data.
#[derive(Clone, Copy)]
pub(super) struct Null<'a> {
    /// The study and its bench.
    pub(super) study: &'a Study,
    pub(super) bench: &'a Bench,
    /// Rows that are used, and their logs.
    pub(super) rows: &'a Rows,
    pub(super) logs: &'a Logs,
    /// The model, and the values to begin with.
    pub(super) hypothesis: &'a Hypothesis,
    pub(super) begin: &'a [f64],
    pub(super) progress: &'a dyn Progress,
}

impl<'a> Null<'a> {
    /// Fits the model in the shortest segments.
    ///
    /// # Errors
    /// When the engine fails.
    pub(super) fn shortest(self) -> Result<Stands<'a>> {
        let finer = self.bench.machine.halved().ok();
        match self.fit_in(Length::Of(DURATIONS[0]), finer.as_ref(), None)? {
            Tried::Stands(stands) => self.fitted_on(*stands),
            Tried::Scatters(_) => Err(Error::Failed("there is no shorter segment".into())),
        }
    }

    /// Fits the model in longer segments, from the results of the shorter ones, as long as replays
    /// do not scatter.
    ///
    /// Returns `None` if the shorter segments are the longest that do not scatter. They then carry
    /// the scatter of the longer segments as their `repeats`.
    ///
    /// # Errors
    /// When the engine fails.
    pub(super) fn longer(self, shorter: &mut Stands<'a>) -> Result<Option<Stands<'a>>> {
        let finer = self.bench.machine.halved().ok();
        let mut stands: Option<Stands<'a>> = None;
        for duration in &DURATIONS[1..] {
            let before = stands.as_ref().unwrap_or(shorter);
            if before.repeats.is_none_or(|r| r.scatters) || self.progress.is_stopped() {
                break;
            }
            match self.fit_in(Length::Of(*duration), finer.as_ref(), Some(before))? {
                Tried::Stands(longer) => stands = Some(*longer),
                Tried::Scatters(repeats) => {
                    stands.as_mut().unwrap_or(shorter).repeats = Some(repeats);
                }
            }
        }
        stands.map(|s| self.fitted_on(s)).transpose()
    }

    /// Fits the model in segments that are whole logs, from the results of shorter ones, and
    /// returns whether their derivatives mislead.
    ///
    /// Returns `None` if their replays scatter.
    ///
    /// # Errors
    /// When the engine fails.
    pub(super) fn whole(self, shorter: &Stands<'a>) -> Result<Option<(Stands<'a>, bool)>> {
        let finer = self.bench.machine.halved().ok();
        match self.fit_in(Length::Log, finer.as_ref(), Some(shorter))? {
            Tried::Stands(stands) => {
                let misleads = misled(&stands.context, &stands.none) >= MISLED;
                Ok(Some((self.fitted_on(*stands)?, misleads)))
            }
            Tried::Scatters(_) => Ok(None),
        }
    }

    /// Continues the fit to its end in the same segments.
    fn fitted_on(self, mut stands: Stands<'a>) -> Result<Stands<'a>> {
        if stands.context.has_segments() {
            let (none, progress) = (&stands.none, self.progress);
            let from = (&none.estimate, &none.slopes.renewed());
            let rounds = (ROUNDS, progress);
            let on = fit(&stands.context, self.hypothesis, &none.theta, from, rounds)?;
            if on.evidence > none.evidence {
                stands.none = on;
            }
        }
        Ok(stands)
    }

    /// Fits the model briefly in segments of a length.
    ///
    /// Segments whose replays scatter are not fitted if a fit of shorter ones exists.
    fn fit_in(
        self,
        length: Length,
        finer: Option<&Machine>,
        shorter: Option<&Stands<'a>>,
    ) -> Result<Tried<'a>> {
        let (hypothesis, progress) = (self.hypothesis, self.progress);
        let (taken, duration) = match length {
            Length::Of(duration) => (self.rows.cut(self.study, self.bench, duration), duration),
            Length::Log => (self.rows.whole(self.study, self.bench), f64::INFINITY),
        };
        let parameters = (&self.study.parameters[..], self.begin);
        let (context, mut estimate) = begin(&self.bench.machine, self.logs, taken, parameters)?;
        let mut theta = self.begin;
        if let Some(shorter) = shorter {
            estimate.begin_at(&context, (&shorter.context, &shorter.none.estimate));
            theta = &shorter.none.theta;
        }
        let first = if context.has_segments() {
            FIRST_OF_SEGMENTS
        } else {
            FIRST
        };
        let slopes = settle_noise(&context, hypothesis, theta, &mut estimate, first, progress)?;
        let mut begun = slopes.renewed();
        let mut repeats = None;
        if context.has_segments() {
            let model = (hypothesis, theta);
            let scatter = Scatter::of(&context, model, (&estimate, &slopes), finer)?;
            let found = Repeats {
                duration,
                lost: scatter.lost,
                scatters: scatter.lost >= LOST,
            };
            if shorter.is_some() && found.scatters {
                return Ok(Tried::Scatters(found));
            }
            repeats = Some(found);
            begun = slopes.taken(&context, (theta, &estimate.trajectory), &scatter.linear);
            estimate.scatter = scatter.directions;
        }
        let from = (&estimate, &begun);
        let rounds = if context.has_segments() {
            SHORT
        } else {
            ROUNDS
        };
        let none = fit(&context, hypothesis, theta, from, (rounds, progress))?;
        let misled = misled(&context, &none);
        let is_longer = shorter.is_some() && matches!(length, Length::Of(_));
        if let Some(repeats) = repeats.filter(|_| is_longer && misled >= MISLED) {
            return Ok(Tried::Scatters(Repeats {
                lost: repeats.lost.max(misled),
                scatters: true,
                ..repeats
            }));
        }
        Ok(Tried::Stands(Box::new(Stands {
            context,
            none,
            repeats,
        })))
    }
}

/// Share of the segments whose last replay left more than its derivatives had predicted.
fn misled(context: &Context<'_>, fitted: &Fitted) -> f64 {
    let pairs = context.walks.iter().zip(&fitted.estimate.misled);
    let segments: Vec<f64> = pairs
        .filter(|(walk, _)| walk.segment.is_some())
        .map(|(_, misled)| *misled)
        .collect();
    let broken = segments.iter().filter(|misled| **misled > 1.0).count();
    broken as f64 / segments.len().max(1) as f64
}
