//! Episodes that the recursions are tested on.
//!
//! [`dense`] compares with the same normal distribution written as dense matrices, and [`known`]
//! with known answers. [`noise`] tests the sums from which the noise model is estimated. [`digits`]
//! tests the effect of rounding.

mod dense;
mod digits;
mod known;
mod noise;

use rand::Rng;

use super::regress::BLOCK;
use super::*;

/// Tolerance of two computations of the same number of order one, through a few dozen operations on
/// well-conditioned matrices.
const SAME: f64 = 1e-8;

/// An episode that owns what a [`Problem`] borrows.
#[derive(Clone)]
struct Case {
    walk: Walk,
    linear: LinearEpisode,
    b: Vec<f64>,
    start: Start,
    free: Vec<f64>,
    noise: NoiseModel,
    /// Columns of the regression.
    m: usize,
}

impl Case {
    /// A random episode of `rows` unevenly spaced rows, `nv` degrees of freedom, `ns` entries per
    /// row and `m` columns. A fifth of the readings is missing, and every third row has a free
    /// force.
    fn random(nv: usize, rows: usize, ns: usize, m: usize) -> Self {
        let mut rng = asid_core::Streams::new(7).stream(&format!("{nv}"));
        let nx = 2 * nv;
        let mut draw =
            |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let positive = |x: Vec<f64>| -> Vec<f64> { x.into_iter().map(|x| 0.6 + 0.5 * x).collect() };
        let mut residual = draw(rows * ns);
        residual
            .iter_mut()
            .skip(3)
            .step_by(5)
            .for_each(|y| *y = f64::NAN);
        let mut time = vec![0.0];
        for gap in positive(draw(rows - 1)) {
            time.push(time[time.len() - 1] + gap);
        }
        let mut free = positive(draw(rows * nv));
        for (k, row) in free.chunks_exact_mut(nv).enumerate() {
            if k % 3 != 1 {
                row.fill(0.0);
            }
        }
        Self {
            walk: Walk {
                episode: 0,
                rows: (0..rows).collect(),
                time,
                substeps: vec![1; rows - 1],
                ctrl: Vec::new(),
                at_steps: Vec::new(),
                segment: None,
            },
            linear: LinearEpisode {
                rows,
                defect: draw((rows - 1) * nx),
                a: draw((rows - 1) * nx * nx),
                b: Vec::new(),
                residual,
                h: draw(rows * ns * nx),
                state_columns: draw((rows - 1) * nx * m),
                reading_columns: draw(rows * ns * m),
                ..LinearEpisode::default()
            },
            b: draw((rows - 1) * nx * nv),
            start: Start {
                mean: draw(nx),
                variance: positive(draw(nx)),
                unknown: positive(draw(nx)),
            },
            free,
            noise: NoiseModel {
                q: positive(draw(nv)),
                tau: positive(draw(nv)),
                white: positive(draw(nv)),
                r: positive(draw(ns)),
            },
            m,
        }
    }

    /// Removes all coupling of degrees of freedom 0 and 2 with the others; odd entries of a reading
    /// then depend on the others alone.
    fn uncoupled(mut self) -> Self {
        let (nv, ns) = (self.noise.q.len(), self.noise.r.len());
        let nx = 2 * nv;
        let part = |at: usize| at % nv % 2;
        let cut = |all: &mut Vec<f64>, n: usize, row: &dyn Fn(usize) -> usize| {
            for (i, x) in all.iter_mut().enumerate() {
                if row(i / n) != part(i % n) {
                    *x = 0.0;
                }
            }
        };
        cut(&mut self.linear.a, nx, &|row| part(row % nx));
        cut(&mut self.b, nv, &|row| part(row % nx));
        cut(&mut self.linear.h, nx, &|row| row % ns % 2);
        self
    }

    /// A mass on a slide, with its position read in each row, about a trajectory at rest at 0. The
    /// one column is a unit force.
    fn slide(mass: f64, dt: f64, places: &[f64], noise: NoiseModel) -> Self {
        let rows = places.len();
        let row_b = [0.5 * dt * dt / mass, dt / mass];
        Self {
            walk: Walk {
                episode: 0,
                rows: (0..rows).collect(),
                time: (0..rows).map(|k| k as f64 * dt).collect(),
                substeps: vec![1; rows - 1],
                ctrl: Vec::new(),
                at_steps: Vec::new(),
                segment: None,
            },
            linear: LinearEpisode {
                rows,
                defect: vec![0.0; 2 * (rows - 1)],
                a: [1.0, dt, 0.0, 1.0].repeat(rows - 1),
                b: Vec::new(),
                residual: places.to_vec(),
                h: [1.0, 0.0].repeat(rows),
                state_columns: row_b.repeat(rows - 1),
                reading_columns: vec![0.0; rows],
                ..LinearEpisode::default()
            },
            b: row_b.repeat(rows - 1),
            start: Start {
                mean: vec![0.0; 2],
                variance: vec![1.0; 2],
                unknown: vec![1.0; 2],
            },
            free: Vec::new(),
            noise,
            m: 1,
        }
    }

    fn problem(&self) -> Problem<'_> {
        Problem {
            walk: &self.walk,
            linear: &self.linear,
            b: &self.b,
            start: &self.start,
            free: &self.free,
            scatter: &[],
        }
    }

    /// Returns rows `range` as an episode of their own, which begins on the trajectory.
    fn part(&self, range: std::ops::Range<usize>) -> Self {
        let (nv, ns, m) = (self.noise.q.len(), self.noise.r.len(), self.m);
        let nx = 2 * nv;
        let rows = |x: &[f64], n: usize| x[range.start * n..range.end * n].to_vec();
        let steps = |x: &[f64], n: usize| x[range.start * n..(range.end - 1) * n].to_vec();
        let mut start = self.start.clone();
        if range.start > 0 {
            start.mean.fill(0.0);
            start.variance.clone_from(&start.unknown);
        }
        let linear = &self.linear;
        Self {
            walk: self.walk.part(range.clone()),
            linear: LinearEpisode {
                rows: range.len(),
                defect: steps(&linear.defect, nx),
                a: steps(&linear.a, nx * nx),
                b: Vec::new(),
                residual: rows(&linear.residual, ns),
                h: rows(&linear.h, ns * nx),
                state_columns: steps(&linear.state_columns, nx * m),
                reading_columns: rows(&linear.reading_columns, ns * m),
                ..LinearEpisode::default()
            },
            b: steps(&self.b, nx * nv),
            start,
            free: rows(&self.free, nv),
            noise: self.noise.clone(),
            m,
        }
    }
}

fn assert_same(got: f64, want: f64, what: &str) {
    assert!(
        (got - want).abs() < SAME * want.abs().max(1.0),
        "{what}: {got} instead of {want}"
    );
}

/// One degree of freedom with two entries per row, two with three, and three of which one is
/// uncoupled from the others.
fn cases() -> [Case; 3] {
    [
        Case::random(1, 6, 2, 3),
        Case::random(2, 6, 3, 4),
        Case::random(3, 6, 4, 3).uncoupled(),
    ]
}

#[test]
fn what_nothing_couples_is_filtered_apart() {
    let case = Case::random(3, 6, 4, 3).uncoupled();
    let blocks = Blocks::of(case.problem(), &case.noise).unwrap();
    assert_eq!(blocks.sizes(), [2, 1]);
    let coupled = Case::random(3, 6, 4, 3);
    assert!(Blocks::of(coupled.problem(), &coupled.noise).is_none());
}

/// Symptom: of a ball in flight of which only the place is read, what is left was said to be at its
/// spin, and effects counted that left the missing force as it was.
///
/// Cause: no reading tells of a torque there, so that its variance stays as the fit began, times
/// every common scale since. It was added to variances that are estimated.
#[test]
fn no_reading_tells_of_a_force_that_moves_nothing_that_is_read() {
    let mut case = Case::random(3, 6, 4, 3).uncoupled();
    let mut coupled = Case::random(3, 6, 4, 3);
    let told_in = |case: &Case| told(case.problem(), &case.noise);
    assert_eq!(told_in(&case), [true; 3]);
    // Only odd entries depend on the second degree of freedom.
    for case in [&mut case, &mut coupled] {
        let odd = case.linear.residual.iter_mut().skip(1).step_by(2);
        odd.for_each(|y| *y = f64::NAN);
    }
    assert_eq!(told_in(&case), [true, false, true]);
    assert_eq!(told_in(&coupled), [true; 3]);
    // Its variance is that of the prior in every row, whatever that is.
    let smoothed = smooth(case.problem(), &case.noise);
    for variance in smoothed.force_variance.iter().skip(1).step_by(3) {
        assert_same(*variance, case.noise.q[1], "variance of the force");
    }
}
