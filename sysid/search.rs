//! The cross-entropy search over the coefficients of a motion.
//!
//! It starts from a motion built one drive after the other ([`crate::by_drive`]), or from a random
//! motion of all drives if that is more informative. It minimises the objective among the
//! candidates that keep all limits; the others rank behind them, by the size of their violations
//! ([`crate::candidates`]). A candidate that beats all before it is simulated at the middle, the
//! ends and corners of the ranges, with limits checked after every physics step. Where it breaks a
//! limit at a point, the search checks that point from then on.

use asid_algorithms::optimise::cem::{Cem, CemSettings};
use asid_core::Progress;
use asid_core::error::Result;
use asid_core::rng::Rng;

use crate::by_drive::Start;
use crate::candidates::far;
use crate::design::Designer;
use crate::method::DesignSettings;
use crate::motion::{Family, Shape};
use crate::places::Places;

/// Number of velocity coordinates up to which a physics step counts once.
const SIX_JOINTS: f64 = 6.0;

/// Power of the number of coordinates by which the time of a physics step grows.
///
/// It lies between the linear time of a chain and the cubic time of its constraints.
const GROWTH: f64 = 1.5;

/// Share of a round's candidates that the next round's distribution is fitted to.
const ELITE: f64 = 0.2;

/// Fewest rounds of the search.
const FEWEST_ROUNDS: usize = 8;

/// Initial standard deviation of each coefficient, in units of its drive's reach.
const SPREAD: f64 = 0.3;

/// Smallest scale of the random motions of all drives, in units of each drive's own reach.
///
/// Together, drives push a machine further than alone.
const SMALLEST: f64 = 1e-2;

/// Scales at which each round tries the best motion so far.
const SIZES: [f64; 4] = [1.0, 0.9, 1.15, 1.4];

/// Most candidates of a round that are checked at all points.
///
/// Each that breaks a limit adds a point to the search's checks.
const LOOKS: usize = 4;

impl Designer<'_, '_> {
    /// Runs the search; returns the best coefficients, and the best cost after each round.
    ///
    /// # Errors
    /// When the engine fails.
    pub(crate) fn search(
        &mut self,
        settings: &DesignSettings,
        points: &[Vec<f64>],
        rng: &mut Rng,
        progress: &dyn Progress,
    ) -> Result<(Vec<f64>, Vec<f64>)> {
        // Weight of a physics step.
        let size = self.player.coordinates() as f64 / SIX_JOINTS;
        let bound = settings.physics_steps / size.max(1.0).powf(GROWTH);
        let begun = self.player.steps();
        let rounds = settings.iterations.max(FEWEST_ROUNDS);
        progress.begin("explore", rounds as u64 + 1);
        let mut places = Places {
            all: points,
            far: far(self.parameters, &self.values),
        };
        let start = self.by_drive(settings, &mut places, rng)?;
        let start = self.drawn(settings, start, &mut places, rng)?;
        progress.advance(1);
        let rule = CemSettings {
            elite_fraction: ELITE,
            ..CemSettings::default()
        };
        let n = self.family.len();
        let spread: Vec<f64> = start.reach.iter().map(|r| SPREAD * r).collect();
        let mut search = Cem::new(
            rule,
            &start.coefficients,
            &spread,
            &vec![-1.0; n],
            &vec![1.0; n],
        );
        let mut course = vec![start.cost];
        let mut best = (start.coefficients, start.cost);
        for round in 0..rounds {
            if round >= FEWEST_ROUNDS && (self.player.steps() - begun) as f64 >= bound {
                break;
            }
            // Include the best motion at several scales: limits bind its size before its shape.
            let mut candidates: Vec<Vec<f64>> = SIZES
                .iter()
                .map(|size| best.0.iter().map(|c| (c * size).clamp(-1.0, 1.0)).collect())
                .collect();
            let drawn = settings.population.saturating_sub(SIZES.len()).max(2);
            candidates.extend(search.ask(drawn, rng));
            let elite = (ELITE * candidates.len() as f64).round() as usize;
            let mut costs = self
                .candidates(&places.far)
                .costs(&candidates, elite.max(2))?;
            let below = (LOOKS, best.1);
            if let Some(k) = self.best(&candidates, &mut costs, below, &mut places)? {
                best = (candidates[k].clone(), costs[k]);
            }
            search.tell(&candidates, &costs);
            course.push(best.1);
            progress.note(&format!("explore, objective {:.3e}", best.1));
            progress.advance(1);
        }
        progress.end();
        Ok((best.0, course))
    }

    /// The best of some random motions of all drives where it beats the start, else the start.
    ///
    /// The motions are random splines and curves like those of the baselines. Each drive moves in
    /// units of its own reach, at scales from one down.
    fn drawn(
        &mut self,
        settings: &DesignSettings,
        start: Start,
        places: &mut Places<'_>,
        rng: &mut Rng,
    ) -> Result<Start> {
        let fourier = Family {
            shape: Shape::Fourier(settings.harmonics),
            ..self.family.clone()
        };
        let (mut draws, mut sizes) = (Vec::new(), Vec::new());
        while draws.len() < settings.population {
            let along = draws.len() as f64 / (settings.population - 1) as f64;
            let size = SMALLEST.powf(along);
            let drawn = match draws.len() % 3 {
                0 => self.family.random(rng),
                1 => self.family.near(&fourier, &fourier.random(rng)),
                _ => self.family.near(&fourier, &fourier.multisine()),
            };
            let pairs = drawn.iter().zip(&start.reach);
            draws.push(pairs.map(|(c, reach)| c * reach * size).collect());
            sizes.push(size);
        }
        let mut costs = self.candidates(&places.far).costs(&draws, 1)?;
        let below = (draws.len(), start.cost);
        let Some(k) = self.best(&draws, &mut costs, below, places)? else {
            return Ok(start);
        };
        Ok(Start {
            coefficients: draws.swap_remove(k),
            cost: costs[k],
            reach: start.reach.iter().map(|r| r * sizes[k]).collect(),
        })
    }
}
