//! A study ready for fits: ranks sets of effects by linearisations and fits them by replays.

#[cfg(feature = "torch")]
use asid_core::Episode;
use asid_core::Result;
use asid_effects::EffectSpec;
use asid_readings::replay::Replay;

use super::candidates::Shown;
use super::noise;
use crate::physics::Study;
use crate::physics::fit::Fit;
#[cfg(feature = "torch")]
use crate::physics::logs::{HEAD, Log, MOST_STEPS};
use crate::physics::logs::{Logs, within};
use crate::physics::model::{Engine, Point, World};
use crate::physics::start::{State, first_state, open_coordinates};

/// Physics steps of a replay of all logs during ranking: some hundred replays take a minute on one
/// core.
const RANKING_STEPS: f64 = 4_000.0;
/// Physics steps of a replay of all logs during a fit.
const FITTING_STEPS: f64 = 10_000.0;
/// Leading candidates that are fitted in each round.
const FITTED: usize = 4;

/// A fitted set of effects.
#[derive(Clone)]
pub struct Fitted {
    /// Effects with their fitted values.
    pub effects: Vec<EffectSpec>,
    /// All values; the study's parameters come first.
    pub point: Point,
    /// Sum of squared residuals in units of the noise.
    pub squares: f64,
    readings: usize,
}

impl Fitted {
    /// `NAME@SITE` of the effects, sorted.
    pub fn labels(&self) -> Vec<String> {
        let mut labels: Vec<String> = self.effects.iter().map(EffectSpec::label).collect();
        labels.sort();
        labels
    }

    /// Bayesian information criterion for white normal residuals of unknown standard deviation.
    pub fn bic(&self) -> f64 {
        let n = self.readings as f64;
        n * (self.squares / n).ln() + self.point.values.len() as f64 * n.ln()
    }
}

/// A study, ready for fits.
pub struct Work<'a> {
    study: &'a Study,
    engine: &'a Engine,
    ranking: Logs,
    fitting: Logs,
    open: Vec<usize>,
}

impl<'a> Work<'a> {
    /// Reads the logs of a study.
    pub fn new(study: &'a Study, engine: &'a Engine) -> Result<Self> {
        let (layout, signals) = (&study.plant.layout, noise::signals(study));
        let logs = |steps: f64| {
            Logs::new(
                layout,
                &signals,
                within(&study.train, layout.timestep, steps),
            )
        };
        Ok(Self {
            ranking: logs(RANKING_STEPS)?,
            fitting: logs(FITTING_STEPS)?,
            open: open_coordinates(layout, &study.train),
            study,
            engine,
        })
    }

    /// The training logs.
    #[cfg(feature = "torch")]
    pub fn training(&self) -> &'a [Episode] {
        &self.study.train
    }

    /// The held-out logs.
    #[cfg(feature = "torch")]
    pub fn testing(&self) -> &'a [Episode] {
        &self.study.test
    }

    /// Noise of each entry of a residual, in the sensor's unit.
    #[cfg(feature = "torch")]
    pub fn noise_by_entry(&self) -> Vec<f64> {
        self.fitting.noise.clone()
    }

    /// The compared part of some episodes, and their readings as a fitted set predicts them.
    ///
    /// Initial states that the logs do not give are fitted to the heads of the logs.
    #[cfg(feature = "torch")]
    pub fn replayed(&self, fitted: &Fitted, episodes: &[Episode]) -> Result<(Logs, Vec<Vec<f64>>)> {
        let layout = &self.study.plant.layout;
        let cut = within(episodes, layout.timestep, MOST_STEPS);
        let mut logs = Logs::new(layout, &noise::signals(self.study), cut)?;
        let (world, values) = self.world(&fitted.effects, &fitted.point)?;
        let first = |l: &Log| first_state(&self.study.plant, &l.episode);
        let starts = logs.logs.iter().map(first).collect();
        let open = open_coordinates(layout, episodes);
        let mut heads = logs.heads(layout, HEAD)?;
        let mut fit = Fit::new(layout, &world, open)?.starts_only();
        let point = fit.run(&mut heads, Point { values, starts })?;
        let readings = fit.predict(&mut logs, &point)?;
        Ok((logs, readings))
    }

    fn starts(&self) -> Vec<State> {
        let logs = self.fitting.logs.iter();
        logs.map(|l| first_state(&self.study.plant, &l.episode))
            .collect()
    }

    /// The study's parameters in the middle of their ranges, and initial states as the logs show
    /// them.
    pub fn middle(&self) -> Point {
        Point {
            values: self
                .study
                .parameters
                .iter()
                .map(|p| p.from_unit(0.5))
                .collect(),
            starts: self.starts(),
        }
    }

    /// The world of a set and the start values of its fit; the study's parameters start as in
    /// `from`.
    fn world(&self, effects: &[EffectSpec], from: &Point) -> Result<(World, Vec<f64>)> {
        let of = |name: &str| {
            let at = self.study.parameters.iter().position(|p| p.name == name)?;
            from.values.get(at).copied()
        };
        let world = self.engine.world(self.study, effects, &of)?;
        let values = world.unknowns.iter().map(|u| u.start).collect();
        Ok((world, values))
    }

    /// Fits a set, starting from values of the study's parameters and initial states.
    pub fn fit(&mut self, effects: &[EffectSpec], from: &Point) -> Result<Fitted> {
        let (world, values) = self.world(effects, from)?;
        let mut fit = Fit::new(&self.study.plant.layout, &world, self.open.clone())?;
        let starts = from.starts.clone();
        let point = fit.run(&mut self.fitting, Point { values, starts })?;
        let (squares, readings) = fit.squares(&mut self.fitting, &point)?;
        let mut fitted = effects.to_vec();
        let unknowns = world.unknowns.iter().zip(&point.values);
        for (unknown, value) in unknowns.skip(self.study.parameters.len()) {
            unknown.set(&mut fitted, *value);
        }
        Ok(Fitted {
            effects: fitted,
            point,
            squares,
            readings,
        })
    }

    /// Adds one effect to `from`: ranks all candidates and fits the leading sets.
    pub fn round(&mut self, from: &Fitted, all: &[Vec<EffectSpec>]) -> Result<Vec<Fitted>> {
        let mut ranked: Vec<(f64, Vec<EffectSpec>)> = Vec::new();
        let layout = &self.study.plant.layout;
        for starts in all {
            let known = |s: &EffectSpec| from.effects.iter().any(|e| e.label() == s.label());
            if starts.iter().any(known) {
                continue;
            }
            let mut own: Option<(f64, Vec<EffectSpec>)> = None;
            for start in starts {
                let effects = [&from.effects[..], std::slice::from_ref(start)].concat();
                // An effect that the engine cannot add to the scene is no candidate.
                let Ok((world, values)) = self.world(&effects, &from.point) else {
                    continue;
                };
                let mut fit = Fit::new(layout, &world, Vec::new())?;
                let starts = from.point.starts.clone();
                let promised = fit.promise(&mut self.ranking, &Point { values, starts });
                let Ok(Some([_, after])) = promised else {
                    continue;
                };
                if own.as_ref().is_none_or(|o| after < o.0) {
                    own = Some((after, effects));
                }
            }
            ranked.extend(own);
        }
        ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
        let leading = ranked.into_iter().take(FITTED);
        leading
            .map(|(_, effects)| self.fit(&effects, &from.point))
            .collect()
    }

    /// The set without one effect that lowers the criterion most; `None` if no removal lowers it.
    pub fn fewer(&mut self, from: &Fitted) -> Result<Option<Fitted>> {
        let mut best: Option<Fitted> = None;
        for left_out in 0..from.effects.len() {
            let mut effects = from.effects.clone();
            effects.remove(left_out);
            let fitted = self.fit(&effects, &from.point)?;
            let least = best.as_ref().map_or_else(|| from.bic(), Fitted::bic);
            if fitted.bic() < least {
                best = Some(fitted);
            }
        }
        Ok(best)
    }

    /// Motion of the identified model along the training logs.
    pub fn shown(&mut self, none: &Fitted) -> Result<Shown> {
        let layout = &self.study.plant.layout;
        let (world, values) = self.world(&[], &none.point)?;
        let mut fit = Fit::new(layout, &world, Vec::new())?;
        let joints = || layout.joints.iter().map(|j| &j.name);
        let names: Vec<String> = joints()
            .map(|j| format!("qpos.{j}"))
            .chain(joints().map(|j| format!("qvel.{j}")))
            .collect();
        let mut logs = self.fitting.like(layout)?;
        for log in &mut logs.logs {
            log.replay = Replay::new(layout, &log.episode, &names)?;
        }
        let starts = none.point.starts.clone();
        let rows = fit.predict(&mut logs, &Point { values, starts })?;
        let (nq, width) = (layout.nq, layout.nq + layout.nv);
        let states = || rows.iter().flat_map(|r| r.chunks_exact(width));
        Ok(Shown {
            ctrl: logs
                .logs
                .iter()
                .flat_map(|l| l.episode.ctrl.clone())
                .collect(),
            qpos: states().flat_map(|s| s[..nq].to_vec()).collect(),
            qvel: states().flat_map(|s| s[nq..].to_vec()).collect(),
        })
    }
}
