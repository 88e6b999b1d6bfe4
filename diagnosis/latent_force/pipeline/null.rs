//! The model without effects, in the longest segments whose replays do not scatter.

use asid_core::{Progress, Result};

use crate::bench::Bench;
use crate::data::Logs;
use crate::latent_force::context::{Context, begin};
use crate::latent_force::fit::{Fitted, Hypothesis, Slopes, fit, settle_noise};
use crate::latent_force::scatter::Scatter;
use crate::latent_force::segments::DURATIONS;
use crate::machine::Machine;
use crate::study::Study;

use super::ROUNDS;
use super::rows::Rows;

/// Linearisations and rounds of EM of a first smoothing.
const FIRST: (usize, usize) = (4, 8);
/// Share of the segments' rows that scatter by more than their noise, from which on segments are not made longer: what is gained by
/// length is lost where nothing can be repeated.
const LOST: f64 = 0.3;

/// The model without effects in segments of one duration, and whether longer ones may be tried.
type Stands<'a> = (Context<'a>, Fitted, bool);

/// What is fitted.
#[derive(Clone, Copy)]
pub(super) struct Null<'a> {
    /// The study and its bench.
    pub(super) study: &'a Study,
    pub(super) bench: &'a Bench,
    /// Rows that are taken, of which logs.
    pub(super) rows: &'a Rows,
    pub(super) logs: &'a Logs,
    /// The model, and its values as given.
    pub(super) hypothesis: &'a Hypothesis,
    pub(super) nominal: &'a [f64],
    pub(super) progress: &'a dyn Progress,
}

impl<'a> Null<'a> {
    /// Fits it in short segments, then in longer ones from where the shorter begin and end, for as long as their replays do
    /// not scatter.
    ///
    /// # Errors
    /// When the engine fails.
    pub(super) fn fit(self) -> Result<(Context<'a>, Fitted)> {
        let finer = self.bench.machine.halved().ok();
        let [shortest, longer @ ..] = DURATIONS;
        let first = self.fit_in(shortest, finer.as_ref(), None)?;
        let Some(mut stands) = first else {
            return Err(asid_core::Error::Failed("the logs have no row".into()));
        };
        for duration in longer {
            let may_be_longer = stands.2 && !self.progress.is_stopped();
            let longer = may_be_longer
                .then(|| self.fit_in(duration, finer.as_ref(), Some(&stands)))
                .transpose()?;
            match longer.flatten() {
                Some(longer) => stands = longer,
                None => break,
            }
        }
        Ok((stands.0, stands.1))
    }

    /// Fits it in segments of a duration, s; `None` where their replays scatter and shorter ones stand.
    fn fit_in(
        self,
        duration: f64,
        finer: Option<&Machine>,
        shorter: Option<&Stands<'a>>,
    ) -> Result<Option<Stands<'a>>> {
        let (hypothesis, progress) = (self.hypothesis, self.progress);
        let taken = self.rows.cut(self.study, self.bench, duration);
        let parameters = (&self.study.parameters[..], self.nominal);
        let (context, mut estimate) = begin(&self.bench.machine, self.logs, taken, parameters)?;
        let mut theta = self.nominal;
        if let Some((of_shorter, none, _)) = shorter {
            estimate.begin_at(&context, (of_shorter, &none.estimate));
            theta = &none.theta;
        }
        settle_noise(&context, hypothesis, theta, &mut estimate, FIRST, progress)?;
        let mut may_be_longer = false;
        if context.has_segments() {
            let scatter = Scatter::of(&context, (hypothesis, theta), &estimate, finer)?;
            may_be_longer = scatter.lost < LOST;
            if shorter.is_some() && !may_be_longer {
                return Ok(None);
            }
            estimate.scatter = scatter.directions;
        }
        let from = (&estimate, &Slopes::default());
        let none = fit(&context, hypothesis, theta, from, (ROUNDS, progress))?;
        Ok(Some((context, none, may_be_longer)))
    }
}
