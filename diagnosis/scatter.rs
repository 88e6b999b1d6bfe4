//! What predictions of a study's logs scatter by: starts, the integrator, an engine's clock.

use asid_core::Result;
use asid_core::rng::Rng;
use nalgebra::DMatrix;

use crate::bench::{Bench, Explanation, Record, Trial, specs};
use crate::linearise::{Differences, linearise};
use crate::machine::Machine;
use crate::predict::{Point, Predictor};
use crate::prepare::HEAD;
use crate::roughness::{self, Spread, Whitening};

/// Deviation of the integrator's error in units of what half the time step changes: an
/// integrator of first order is still as far off again.
const INTEGRATOR: f64 = 3.0;
/// Share of the gap up to which what is open of the starts is small.
/// Deviation of the integrator's error, in units of the noise, from which on a prediction tells
/// nothing: beyond it an error is no longer proportional to its cause.
const HORIZON: f64 = 30.0;
const SMALL: f64 = 0.3;
/// Deviation of a start, m or rad or per second, that no record is too short to tell.
const VAGUE: f64 = 0.1;

/// Estimates what predictions scatter by.
pub struct Scatter {
    /// The same machine with half the time step.
    pub(crate) halved: Option<Machine>,
    pub(crate) rng: Rng,
    /// How far apart the starts of the training logs may be.
    pub(crate) starts: Spread,
}

impl Scatter {
    /// Sets the scatter about a point: on the training logs, whose starts are known or
    /// fitted, what nobody can repeat; on those held out also what their starts leave open.
    pub(crate) fn estimate(&mut self, bench: &mut Bench, point: &Point) -> Result<()> {
        let held = Point {
            theta: point.theta.clone(),
            starts: bench.test.starts.clone(),
        };
        let train = self.of(bench, &bench.train, &[], point, &self.starts.clone())?;
        let test = self.held_out(bench, &[], &held)?;
        bench.train.whitening = train;
        bench.test.whitening = test;
        Ok(())
    }

    /// The scatter about an explanation of a stage, of the stage's logs and at the last stage of
    /// those held out. Where motion is chaotic it is another one along every trajectory: that of
    /// the model without an effect says little of how far its true explanation may be off.
    pub(crate) fn estimate_about(
        &mut self,
        bench: &Bench,
        stage: usize,
        trials: &[Trial<'_>],
        explanation: &Explanation,
    ) -> Result<[Vec<Whitening>; 2]> {
        let theta = explanation.fit.point.theta.clone();
        let part = &bench.stages[stage];
        let point = part.point(theta.clone(), &explanation.fit.point.starts);
        let spread = self.starts.of(&part.episodes);
        let of_stage = self.of(bench, &part.record, trials, &point, &spread)?;
        let mut held_out = Vec::new();
        if stage + 1 == bench.stages.len() {
            let starts = explanation.held_starts.clone();
            held_out = self.held_out(bench, trials, &Point { theta, starts })?;
        }
        Ok([of_stage, held_out])
    }

    fn held_out(
        &mut self,
        bench: &Bench,
        trials: &[Trial<'_>],
        point: &Point,
    ) -> Result<Vec<Whitening>> {
        let spread = if bench.open.is_empty() {
            Spread::of_known_starts(bench.layout())
        } else {
            start_spread(bench, &bench.head, trials, point)?
        };
        self.of(bench, &bench.test, trials, point, &spread)
    }

    /// Keeps the starts that the first tenths of the training logs give, where what they leave open
    /// is far less than the gap: it counts as scatter, and fits are the cheaper for it.
    pub(crate) fn keep_starts(&mut self, bench: &mut Bench, point: &Point) -> Result<()> {
        let head = bench.train.cut(&bench.layout().clone(), HEAD);
        let spread = start_spread(bench, &head, &[], point)?;
        let whitening = self.of(bench, &bench.train, &[], point, &spread)?;
        let variance: f64 = whitening.iter().map(Whitening::variance).sum();
        let mut predictor = bench.predictor(&[], &bench.train)?;
        predictor.set_whitening(Vec::new());
        let residuals = predictor.residuals(std::slice::from_ref(point))?;
        let gap: f64 = residuals[0].iter().map(|r| r * r).sum();
        if variance < SMALL * SMALL * gap {
            bench.fitted.clear();
            bench.train.whitening = whitening;
            self.starts = spread;
        }
        Ok(())
    }

    fn of(
        &mut self,
        bench: &Bench,
        record: &Record,
        trials: &[Trial<'_>],
        point: &Point,
        spread: &Spread,
    ) -> Result<Vec<Whitening>> {
        let layout = bench.layout();
        let n = record.logs.entries.len();
        let mut horizons = vec![None; record.logs.episodes.len()];
        let mut predictor = bench.predictor(trials, record)?;
        let mut all = roughness::estimate(&mut predictor, layout, point, spread, &mut self.rng)?;
        let rough: Vec<bool> = all.iter().map(|d| Whitening::of(d).lost() > 0).collect();
        let far = |x: &f64| !(x.abs() < HORIZON);
        if let Some(halved) = &self.halved {
            // A different integrator is one more direction.
            let model = halved.with(&specs(trials))?;
            let logs = record.logs.replanned(model.layout());
            let threads = halved.threads;
            let parameters = bench.all_parameters(trials);
            let mut finer = Predictor::new(&*model, &parameters, &logs, 1, threads)?;
            predictor.set_whitening(Vec::new());
            let here = predictor.residuals(std::slice::from_ref(point))?;
            let there = finer.residuals(std::slice::from_ref(point))?;
            for (e, directions) in all.iter_mut().enumerate() {
                let range = record.logs.offset(e)..record.logs.offset(e + 1);
                let pairs = here[0][range.clone()].iter().zip(&there[0][range]);
                let change: Vec<f64> = pairs.map(|(a, b)| INTEGRATOR * (a - b)).collect();
                if !rough[e] && !trials.is_empty() {
                    let row = change.chunks(n).position(|row| row.iter().any(far));
                    horizons[e] = row.map(|row| row * n);
                }
                if change.iter().all(|x| x.is_finite()) {
                    directions.push(change);
                }
            }
        }
        predictor.set_whitening(Vec::new());
        let readings = predictor.readings(std::slice::from_ref(point))?;
        for (e, directions) in all.iter_mut().enumerate() {
            let clocks = roughness::clocks(&record.logs, e, &readings[0][e], layout.timestep);
            directions.extend(clocks);
        }
        for (directions, horizon) in all.iter_mut().zip(&horizons) {
            if let Some(horizon) = *horizon {
                directions.iter_mut().for_each(|d| d[horizon..].fill(0.0));
            }
        }
        let whitenings = all.iter().map(|d| Whitening::of(d));
        Ok(whitenings
            .zip(rough.iter().zip(horizons))
            .map(|(mut whitening, (&rough, horizon))| {
                whitening.rough = rough;
                whitening.horizon = horizon;
                whitening
            })
            .collect())
    }
}

/// How well starts are known from the first tenth of their episodes, `head`.
fn start_spread(
    bench: &Bench,
    head: &Record,
    trials: &[Trial<'_>],
    point: &Point,
) -> Result<Spread> {
    let layout = bench.layout();
    let mut unknowns = bench.unknowns(trials);
    unknowns.iter_mut().for_each(|u| u.free = false);
    let mut predictor = bench.predictor(trials, head)?;
    predictor.set_whitening(Vec::new());
    let mut differences = Differences::new(unknowns.len(), bench.open.len());
    let open = &bench.open;
    let mut line = || {
        linearise(
            &mut predictor,
            layout,
            &unknowns,
            point,
            open,
            &mut differences,
        )
    };
    // Once for the size of the differences.
    line()?;
    let line = line()?;
    let logs = &head.logs;
    let root = |e: usize| {
        let range = logs.offset(e)..logs.offset(e + 1);
        let part = |i: usize| &line.start_columns[i][range.clone()];
        let information = DMatrix::from_fn(open.len(), open.len(), |i, j| {
            let pairs = part(i).iter().zip(part(j));
            let sum: f64 = pairs.map(|(x, y)| x * y).sum();
            sum + if i == j { VAGUE.powi(-2) } else { 0.0 }
        });
        let eigen = information.symmetric_eigen();
        let deviations = eigen.eigenvalues.map(|x| x.max(1e-12).sqrt().recip());
        eigen.eigenvectors * DMatrix::from_diagonal(&deviations)
    };
    let roots = (0..logs.episodes.len()).map(root).collect();
    Ok(Spread::Open(open.clone(), roots))
}
