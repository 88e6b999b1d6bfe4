//! What predictions of a study's logs scatter by: starts, the integrator, an engine's clock.

use asid_core::rng::Rng;
use asid_core::{Layout, Result};
use nalgebra::DMatrix;

use crate::bench::{Bench, Explanation, Trial, specs};
use crate::data::Logs;
use crate::linearise::{Differences, linearise};
use crate::machine::Machine;
use crate::predict::{Point, Predictor};
use crate::prepare::HEAD;
use crate::record::Record;
use crate::roughness::{self, Spread};
use crate::whitening::{Scattering, Whitening};

/// Deviation of the integrator's error in units of what half the time step changes: an
/// integrator of first order is still as far off again.
const INTEGRATOR: f64 = 3.0;
/// Share of the clocks and of what half the time step changes that is each episode's own: another
/// program's integrator errs otherwise, and not in the same proportion everywhere.
const OWN: f64 = 0.3;
/// Deviation of the integrator's error, in units of the noise, from which on a prediction tells
/// nothing: that part of it which is not proportional to the time step.
const HORIZON: f64 = 30.0;
/// Share of the gap up to which what is open of the starts is small.
const SMALL: f64 = 0.3;
/// Deviation of a start, m or rad or per second, that no record is too short to tell.
const VAGUE: f64 = 0.1;

/// Estimates what predictions scatter by.
pub struct Scatter {
    /// The same machine with half and with a quarter of the time step.
    pub(crate) finer: Option<[Machine; 2]>,
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
        bench.train.set_scattering(train);
        bench.test.set_scattering(test);
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
    ) -> Result<[Scattering; 2]> {
        let theta = explanation.fit.point.theta.clone();
        let part = &bench.stages[stage];
        let point = part.point(theta.clone(), &explanation.fit.point.starts);
        let spread = self.starts.of(&part.episodes);
        let of_stage = self.of(bench, &part.record, trials, &point, &spread)?;
        let mut held_out = Scattering::default();
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
    ) -> Result<Scattering> {
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
        let scattering = self.of(bench, &bench.train, &[], point, &spread)?;
        let variance = scattering.variance();
        let mut predictor = bench.predictor(&[], &bench.train)?;
        predictor.set_scattering(Scattering::default());
        let residuals = predictor.residuals(std::slice::from_ref(point))?;
        let gap: f64 = residuals[0].iter().map(|r| r * r).sum();
        if variance < SMALL * SMALL * gap {
            bench.fitted.clear();
            bench.train.set_scattering(scattering);
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
    ) -> Result<Scattering> {
        let logs = &record.logs;
        let (layout, n) = (bench.layout(), logs.entries.len());
        let mut predictor = bench.predictor(trials, record)?;
        let mut own = roughness::estimate(&mut predictor, layout, point, spread, &mut self.rng)?;
        let rough: Vec<bool> = own.iter().map(|d| Whitening::of(d).lost() > 0).collect();
        let mut horizons = vec![None; own.len()];
        let mut shared = Vec::new();
        let clocks = self.clocks(&mut predictor, layout, point)?;
        let steps = self.steps(bench, record, trials, point)?;
        // Where starts are open they are fitted an episode at a time, and so is all else.
        let together = bench.open.is_empty();
        let share = |d: &Vec<f64>| d.iter().map(|x| OWN * x).collect();
        if together {
            let some: Vec<Vec<f64>> = clocks.iter().map(share).collect();
            spread_out(&mut own, logs, &some);
            shared.extend(clocks);
        } else {
            spread_out(&mut own, logs, &clocks);
        }
        if let Some([halved, quartered]) = steps {
            let whole: Vec<f64> = halved.iter().map(|x| INTEGRATOR * x).collect();
            // What is not proportional to the step.
            let pairs = halved.iter().zip(&quartered);
            let rest: Vec<f64> = pairs.map(|(a, b)| INTEGRATOR * (a - 2.0 * b)).collect();
            for (e, horizon) in horizons.iter_mut().enumerate() {
                let rest = &rest[logs.offset(e)..logs.offset(e + 1)];
                let near = |x: &f64| x.abs() < HORIZON;
                if !rough[e] && !trials.is_empty() {
                    let row = rest.chunks(n).position(|row| !row.iter().all(near));
                    *horizon = row.map(|row| row * n);
                }
            }
            if together {
                spread_out(&mut own, logs, &[rest, share(&whole)]);
                if whole.iter().all(|x| x.is_finite()) {
                    shared.push(whole);
                }
            } else {
                spread_out(&mut own, logs, &[whole]);
            }
        }
        for (directions, horizon) in own.iter_mut().zip(&horizons) {
            if let Some(horizon) = *horizon {
                directions.iter_mut().for_each(|d| d[horizon..].fill(0.0));
            }
        }
        let whitenings = own.iter().map(|d| Whitening::of(d));
        let episodes = whitenings
            .zip(rough.iter().zip(horizons))
            .map(|(mut whitening, (&rough, horizon))| {
                whitening.rough = rough;
                whitening.horizon = horizon;
                whitening
            })
            .collect();
        Ok(Scattering::new(logs, episodes, shared))
    }

    /// Directions in which an engine's clock moves the residuals of all episodes, one a sensor.
    fn clocks(
        &self,
        predictor: &mut Predictor<'_>,
        layout: &Layout,
        point: &Point,
    ) -> Result<Vec<Vec<f64>>> {
        predictor.set_scattering(Scattering::default());
        let logs = predictor.logs();
        let readings = predictor.readings(std::slice::from_ref(point))?;
        let mut all = vec![vec![0.0; logs.len()]; logs.sensors.len()];
        for e in 0..logs.episodes.len() {
            let clocks = roughness::clocks(logs, e, &readings[0][e], layout.timestep);
            for (direction, own) in all.iter_mut().zip(clocks) {
                direction[logs.offset(e)..logs.offset(e + 1)].copy_from_slice(&own);
            }
        }
        Ok(all)
    }

    /// What half the time step changes of the residuals of all episodes, and what half of that
    /// changes again; `None` where the engine refuses such a step.
    fn steps(
        &self,
        bench: &Bench,
        record: &Record,
        trials: &[Trial<'_>],
        point: &Point,
    ) -> Result<Option<[Vec<f64>; 2]>> {
        let Some(finer) = &self.finer else {
            return Ok(None);
        };
        let parameters = bench.all_parameters(trials);
        let read = |machine: &Machine| -> Result<Vec<f64>> {
            let model = machine.with(&specs(trials))?;
            let logs = record.logs.replanned(model.layout());
            let mut predictor = Predictor::new(&*model, &parameters, &logs, 1, machine.threads)?;
            let mut residuals = predictor.residuals(std::slice::from_ref(point))?;
            Ok(residuals.pop().unwrap_or_default())
        };
        let [a, b, c] = [read(&bench.machine)?, read(&finer[0])?, read(&finer[1])?];
        let change = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x - y).collect();
        Ok(Some([change(&a, &b), change(&b, &c)]))
    }
}

/// Adds to each episode's directions its own part of some over all, where that is finite.
fn spread_out(own: &mut [Vec<Vec<f64>>], logs: &Logs, all: &[Vec<f64>]) {
    for (e, directions) in own.iter_mut().enumerate() {
        let parts = all.iter().map(|d| &d[logs.offset(e)..logs.offset(e + 1)]);
        let finite = parts.filter(|part| part.iter().all(|x| x.is_finite()));
        directions.extend(finite.map(<[f64]>::to_vec));
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
    predictor.set_scattering(Scattering::default());
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
