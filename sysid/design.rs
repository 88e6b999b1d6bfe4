//! The design of a motion that is most informative and keeps all limits.
//!
//! A method ([`crate::method`]) gives the coefficients of a motion: by a search, by a draw, or by a
//! rule. The motion is then simulated at the middle, the ends and corners of the ranges. Limits are
//! checked after every physics step, and the motion is scaled down until it keeps all of them.

use asid_algorithms::fisher::Objective;
use asid_core::error::{Error, Result};
use asid_core::rng::Rng;
use asid_core::{Parameter, Progress, Streams};
use rand::Rng as _;

use crate::candidates::{Candidates, ends};
use crate::expected::Expected;
use crate::limits::Excess;
use crate::method::{DesignSettings, Method};
use crate::motion::Family;
use crate::play::{Played, Player};
use crate::tells::Told;

/// Factor by which each attempt scales a motion down to keep limits.
const SHRINK: f64 = 0.85;

/// Most attempts: they scale down to a thousandth.
const SHRINKS: usize = 43;

/// Factor by which the answer is enlarged to see which limit it would break first.
const LARGER: f64 = 1.25;

/// Most corners of the ranges that a search checks a motion at.
const CORNERS: usize = 16;

/// Most corners that the answer is checked at: those of eight entries, in one batch.
const ALL_CORNERS: usize = 256;

/// A designed motion.
#[derive(Clone, Debug)]
pub struct Designed {
    /// Commands, `frames x nu`.
    pub commands: Vec<f64>,
    /// Information of the motion.
    pub told: Told,
    /// Information by slopes alone: more where bodies touch ([`crate::expected`]).
    pub by_slopes: Told,
    /// Its play at the middle of the unknowns.
    pub played: Played,
    /// Violations of limits over all checked points; none where they are kept.
    pub excess: Excess,
    /// The limit that a motion larger by a quarter would break.
    pub next_limit: Option<String>,
    /// Factor by which the method's motion was scaled down.
    pub scale: f64,
    /// Best cost after each round.
    pub course: Vec<f64>,
}

/// Input of a design.
pub struct Designer<'p, 'a> {
    /// Simulates motions.
    pub player: &'p mut Player<'a>,
    /// The family of motions.
    pub family: Family,
    /// Unknowns, then nuisance entries.
    pub parameters: &'p [Parameter],
    /// Number of unknowns.
    pub sought: usize,
    /// Values of the parameters about which the motion is designed.
    pub values: Vec<f64>,
    /// Information beside the prior, such as from logs.
    pub known: Told,
    /// Objective that is minimised.
    pub objective: Objective,
    /// Physics steps in a frame.
    pub substeps: usize,
}

impl<'a> Designer<'_, 'a> {
    /// Designs a motion.
    ///
    /// # Errors
    /// When nothing can move, or the engine fails.
    pub fn design(
        &mut self,
        method: Method,
        settings: &DesignSettings,
        streams: Streams,
        progress: &dyn Progress,
    ) -> Result<Designed> {
        self.bound_open_drives()?;
        if self.family.is_empty() {
            let message = if self.player.plant.layout.nu() == 0 {
                "the model has no actuator: without a command there is no motion to plan"
            } else {
                "no actuator has a range to move in: give its joint or command one, such as --limit-position \
                 JOINT:LOW:HIGH or --limit-speed JOINT:SPEED"
            };
            return Err(Error::Config {
                key: "actuator".into(),
                message: message.into(),
            });
        }
        let mut rng = streams.stream("design");
        let corners = self.corners(CORNERS, &mut streams.stream("corners"));
        let ends = ends(self.parameters, &self.values);
        let points = [vec![self.values.clone()], ends, corners].concat();
        let (coefficients, course) = match method {
            Method::FisherCem => self.search(settings, &points, &mut rng, progress)?,
            Method::Multisine => (self.family.multisine(), Vec::new()),
            Method::Random | Method::Fourier => (self.family.random(&mut rng), Vec::new()),
        };
        let all = self.corners(ALL_CORNERS, &mut streams.stream("all corners"));
        self.finish(&coefficients, course, &[points, all].concat())
    }

    /// The points of the ranges that a motion is checked at, in words.
    #[must_use]
    pub fn checked_at(entries: usize) -> String {
        if is_few(entries, ALL_CORNERS) {
            "at the ends and corners of the unknowns' ranges too".into()
        } else {
            format!("at the ends and {ALL_CORNERS} random corners of the unknowns' ranges too")
        }
    }

    /// The ranking of candidates, with points `far` from the middle.
    pub(crate) fn candidates<'s>(&'s mut self, far: &'s [Vec<f64>]) -> Candidates<'s, 'a> {
        let family = self.family.clone();
        Candidates {
            player: &mut *self.player,
            family,
            parameters: self.parameters,
            sought: self.sought,
            values: &self.values,
            known: &self.known,
            objective: self.objective,
            substeps: self.substeps,
            far,
        }
    }

    /// Describes the entries in which a point differs from the middle.
    fn words(&self, point: &[f64]) -> String {
        let entries = self.parameters.iter().zip(point).zip(&self.values);
        let moved = entries.filter(|((_, x), middle)| x != middle);
        let words: Vec<String> = moved
            .map(|((p, x), _)| format!("{} = {x}", p.name))
            .collect();
        words.join(", ")
    }

    /// Corners of the ranges: all of them if they are no more than `most`, else so many random ones.
    fn corners(&self, most: usize, rng: &mut Rng) -> Vec<Vec<f64>> {
        let n = self.parameters.len();
        let few = is_few(n, most);
        let count = if few { 1 << n } else { most };
        (0..count)
            .map(|k| {
                let upper =
                    |i: usize, rng: &mut Rng| if few { k >> i & 1 == 1 } else { rng.random() };
                (0..n)
                    .map(|i| self.parameters[i].range[usize::from(upper(i, rng))])
                    .collect()
            })
            .collect()
    }

    /// Violations of a motion at each of some points, checked after every physics step.
    pub(crate) fn excess_at(
        &mut self,
        coefficients: &[f64],
        scale: f64,
        points: &[Vec<f64>],
    ) -> Result<Vec<Excess>> {
        let commands = self.family.commands(coefficients, scale);
        let rows = commands.chunks_exact(self.family.base.len());
        let fine: Vec<f64> = rows.flat_map(|row| row.repeat(self.substeps)).collect();
        let jobs: Vec<(&[f64], &[f64])> = points.iter().map(|p| (&fine[..], &p[..])).collect();
        let plays = self.player.play(&jobs, 1)?;
        let pairs = plays.iter().zip(points);
        Ok(pairs
            .map(|(played, point)| played.excess.at(|| self.words(point)))
            .collect())
    }

    /// Scales the motion down until it keeps all limits, checked after every physics step.
    fn finish(
        &mut self,
        coefficients: &[f64],
        course: Vec<f64>,
        points: &[Vec<f64>],
    ) -> Result<Designed> {
        let mut scale = 1.0;
        let mut excess = Excess::default();
        // The point that the last size violated most: a size that fails there needs no check
        // elsewhere.
        let mut worst = 0;
        for _ in 0..SHRINKS {
            excess = joined(&self.excess_at(coefficients, scale, &points[worst..=worst])?);
            if excess.is_none() {
                let all = self.excess_at(coefficients, scale, points)?;
                excess = joined(&all);
                if excess.is_none() {
                    break;
                }
                worst = worst_of(&all);
            }
            scale *= SHRINK;
        }
        let larger = joined(&self.excess_at(coefficients, LARGER * scale, points)?);
        let commands = self.family.commands(coefficients, scale);
        let about = (self.parameters, &self.values[..]);
        let motion = (&commands[..], self.substeps);
        let expected = Expected::of(self.player, motion, about, self.sought)?;
        Ok(Designed {
            told: expected.told,
            by_slopes: expected.by_slopes,
            played: expected
                .played
                .ok_or_else(|| Error::Failed("nothing was played".into()))?,
            commands,
            next_limit: larger.worst.map(|(what, _)| what),
            excess,
            scale,
            course,
        })
    }
}

/// Whether the ranges of `n` entries have no more than `most` corners.
fn is_few(n: usize, most: usize) -> bool {
    n < usize::BITS as usize && 1 << n <= most
}

/// Violations of several plays combined.
pub(crate) fn joined(all: &[Excess]) -> Excess {
    let mut one = Excess::default();
    all.iter().for_each(|e| one.join(e));
    one
}

/// Index of the largest violation.
pub(crate) fn worst_of(all: &[Excess]) -> usize {
    (0..all.len())
        .max_by(|&i, &j| all[i].total.total_cmp(&all[j].total))
        .unwrap_or(0)
}
