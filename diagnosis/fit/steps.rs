//! Linearisations and damped steps of a fit to replays.

use std::ops::Range;

use asid_core::layout::Layout;
use asid_core::{Progress, Result};

use crate::linearise::{Anew, Differences, Linearisation, NOTHING, Open, Unknown, linearise_anew};
use crate::normal::Normal;
use crate::predict::{Point, Predictor};

use super::cost;
use super::region::Region;

/// Maximum number of times that columns are computed again until the steps of their differences are
/// right.
const SETTLING: usize = 4;

/// Everything that the steps of a fit need.
pub(super) struct Steps<'w, 'r> {
    pub(super) predictor: &'w mut Predictor<'r>,
    pub(super) layout: &'w Layout,
    pub(super) unknowns: &'w [Unknown],
    pub(super) open: &'w Open,
    pub(super) reach: &'w [f64],
    pub(super) free: Vec<usize>,
    pub(super) bounds: Vec<Range<usize>>,
    pub(super) differences: Differences,
    pub(super) region: Option<&'w Region>,
}

impl Steps<'_, '_> {
    /// Linearises at a point; derivatives with respect to the initial states are taken from
    /// `nearby`, if given.
    pub(super) fn line(
        &mut self,
        point: &Point,
        nearby: Option<&Linearisation>,
    ) -> Result<Linearisation> {
        let due: Vec<bool> = (0..self.free.len() + self.open.len())
            .map(|column| column < self.free.len())
            .collect();
        self.anew(point, nearby.map(|nearby| Anew { due: &due, nearby }))
    }

    fn anew(&mut self, point: &Point, anew: Option<Anew<'_>>) -> Result<Linearisation> {
        linearise_anew(
            self.predictor,
            self.layout,
            self.unknowns,
            (point, self.open),
            &mut self.differences,
            anew,
        )
    }

    /// Makes the first linearisation; columns whose steps were far from what their responses ask
    /// for are computed again.
    pub(super) fn first(
        &mut self,
        point: &Point,
        nearby: Option<&Linearisation>,
        progress: &dyn Progress,
    ) -> Result<Linearisation> {
        let mut before = self.differences.clone();
        let mut line = self.line(point, nearby)?;
        for _ in 0..SETTLING {
            let due = self.differences.due_since(&before, &self.free);
            if !due.contains(&true) || progress.is_stopped() {
                break;
            }
            before = self.differences.clone();
            let (due, nearby) = (&due[..], &line);
            line = self.anew(point, Some(Anew { due, nearby }))?;
        }
        Ok(line)
    }

    /// Returns the best point of some damped steps with its cost, if that is below `best`.
    pub(super) fn stepped(
        &mut self,
        (line, point): (&Linearisation, &Point),
        damping: &mut f64,
        best: f64,
    ) -> Result<Option<(Point, f64)>> {
        for _ in 0..3 {
            let dampings = [*damping * 0.1, *damping, *damping * 10.0];
            let trials: Vec<Point> = dampings
                .iter()
                .map(|&d| self.trial((line, point), d))
                .collect();
            let residuals = self.predictor.residuals(&trials)?;
            let costs: Vec<f64> = residuals.iter().map(|r| cost(r)).collect();
            let lowest = (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]));
            if let Some(k) = lowest.filter(|&k| costs[k] < best) {
                *damping = dampings[k].clamp(1e-8, 1e8);
                return Ok(Some((trials[k].clone(), costs[k])));
            }
            *damping *= 100.0;
        }
        Ok(None)
    }

    /// Returns the point after a damped step, within the bounds and the region.
    fn trial(&self, (line, point): (&Linearisation, &Point), damping: f64) -> Point {
        let normal = Normal::new(line, &self.bounds, damping, self.reach);
        let parameter = |i: usize| &self.unknowns[i].parameter;
        let units = |theta: &[f64]| -> Vec<f64> {
            let own = self.free.iter();
            own.map(|&i| parameter(i).to_unit(theta[i])).collect()
        };
        let unit = units(&point.theta);
        let readings = line.residuals.len().max(1) as f64;
        let mut held: Vec<bool> = line
            .columns
            .iter()
            .map(|c| (cost(c) / readings).sqrt() < NOTHING)
            .collect();
        let mut step = normal.step(damping, &held);
        // A parameter at a bound that the step would leave is held.
        for _ in 0..self.free.len() {
            let mut again = false;
            for k in 0..self.free.len() {
                let leaves = (unit[k] <= 1e-12 && step[k] < 0.0)
                    || (unit[k] >= 1.0 - 1e-12 && step[k] > 0.0);
                if leaves && !held[k] {
                    held[k] = true;
                    again = true;
                }
            }
            if !again {
                break;
            }
            step = normal.step(damping, &held);
        }
        let mut next = point.clone();
        for (k, &i) in self.free.iter().enumerate() {
            next.theta[i] = parameter(i).from_unit((unit[k] + step[k]).clamp(0.0, 1.0));
        }
        if let Some(region) = self.region {
            region.pull_in(&mut next.theta);
            let moved = units(&next.theta)
                .into_iter()
                .zip(&unit)
                .map(|(a, b)| a - b);
            step.iter_mut().zip(moved).for_each(|(s, m)| *s = m);
        }
        if !self.open.is_empty() {
            for (e, start) in next.starts.iter_mut().enumerate() {
                let moves = normal.start_step(e, &step);
                for (&coordinate, by) in self.open.iter().zip(moves.iter()) {
                    start.shift(self.layout, coordinate, *by);
                }
            }
        }
        next
    }
}
