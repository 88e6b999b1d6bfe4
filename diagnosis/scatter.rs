//! What predictions of a study's logs scatter by: starts, the integrator, an engine's clock.

use asid_core::Result;
use asid_core::rng::Rng;
use nalgebra::DMatrix;

use crate::bench::{Bench, Record};
use crate::linearise::{Differences, linearise};
use crate::machine::Machine;
use crate::predict::{Point, Predictor};
use crate::prepare::HEAD;
use crate::roughness::{self, Spread, Whitening};

/// Deviation of the integrator's error in units of what half the time step changes: an
/// integrator of first order is still as far off again.
const INTEGRATOR: f64 = 3.0;
/// Share of the gap up to which what is open of the starts is small.
const SMALL: f64 = 0.3;
/// Deviation of a start, m or rad or per second, that no record is too short to tell.
const VAGUE: f64 = 0.1;

/// Estimates what predictions scatter by.
pub(crate) struct Scatter<'r> {
    /// The same machine with half the time step.
    pub(crate) halved: Option<Machine>,
    pub(crate) rng: &'r mut Rng,
    /// How far apart the starts of the training logs may be.
    pub(crate) starts: Spread,
}

impl Scatter<'_> {
    /// Sets the scatter about a point: on the training logs, whose starts are known or
    /// fitted, what nobody can repeat; on those held out also what their starts leave open.
    pub(crate) fn estimate(&mut self, bench: &mut Bench, point: &Point) -> Result<()> {
        let layout = bench.layout().clone();
        let train = self.of(bench, &bench.train, point, &self.starts.clone())?;
        let held = Point {
            theta: point.theta.clone(),
            starts: bench.test.starts.clone(),
        };
        let spread = if bench.open.is_empty() {
            Spread::of_known_starts(&layout)
        } else {
            start_spread(bench, &bench.head, &held)?
        };
        let test = self.of(bench, &bench.test, &held, &spread)?;
        bench.train.whitening = train;
        bench.test.whitening = test;
        Ok(())
    }

    /// Keeps the starts that the first tenths of the training logs give, where what they leave open
    /// is far less than the gap: it counts as scatter, and fits are the cheaper for it.
    pub(crate) fn keep_starts(&mut self, bench: &mut Bench, point: &Point) -> Result<()> {
        let head = bench.train.cut(&bench.layout().clone(), HEAD);
        let spread = start_spread(bench, &head, point)?;
        let whitening = self.of(bench, &bench.train, point, &spread)?;
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
        point: &Point,
        spread: &Spread,
    ) -> Result<Vec<Whitening>> {
        let layout = bench.layout();
        let mut predictor = bench.predictor(&[], record)?;
        let mut all = roughness::estimate(&mut predictor, layout, point, spread, self.rng)?;
        let rough: Vec<bool> = all.iter().map(|d| Whitening::of(d).lost() > 0).collect();
        if let Some(halved) = &self.halved {
            // A different integrator is one more direction.
            let model = halved.with(&[])?;
            let logs = record.logs.replanned(model.layout());
            let threads = halved.threads;
            let mut finer = Predictor::new(&*model, &bench.parameters, &logs, 1, threads)?;
            predictor.set_whitening(Vec::new());
            let here = predictor.residuals(std::slice::from_ref(point))?;
            let there = finer.residuals(std::slice::from_ref(point))?;
            for (e, directions) in all.iter_mut().enumerate() {
                let range = record.logs.offset(e)..record.logs.offset(e + 1);
                let pairs = here[0][range.clone()].iter().zip(&there[0][range]);
                let change: Vec<f64> = pairs.map(|(a, b)| INTEGRATOR * (a - b)).collect();
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
        let whitenings = all.iter().map(|d| Whitening::of(d)).zip(rough);
        Ok(whitenings
            .map(|(mut whitening, rough)| {
                whitening.rough = rough;
                whitening
            })
            .collect())
    }
}

/// How well starts are known from the first tenth of their episodes, `head`.
fn start_spread(bench: &Bench, head: &Record, point: &Point) -> Result<Spread> {
    let layout = bench.layout();
    let mut unknowns = bench.unknowns(&[]);
    unknowns.iter_mut().for_each(|u| u.free = false);
    let mut predictor = bench.predictor(&[], head)?;
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
