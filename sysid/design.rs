//! The search for the motion that tells the most and keeps all limits.
//!
//! The cross-entropy method makes the objective small among the candidates that keep all limits; those that do not rank behind
//! them, by how much they break ([`crate::candidates`]). A candidate that is better than all before it is played at the middle, the ends and
//! corners of the ranges, with the limits looked at after every physics step; where it breaks one there, the search
//! looks at that point from then on. The answer is made smaller until no limit is broken.

use asid_algorithms::fisher::Objective;
use asid_algorithms::optimise::cem::{Cem, CemSettings};
use asid_core::error::{Error, Result};
use asid_core::rng::Rng;
use asid_core::{Parameter, Progress, Streams};
use rand::Rng as _;

use crate::candidates::{BROKEN, Candidates, ends, far};
use crate::limits::Excess;
use crate::motion::{Family, Shape};
use crate::play::{Played, Player};
use crate::tells::{Told, differences, of_plays};

/// How a motion is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Fisher information by the cross-entropy method over splines.
    FisherCem,
    /// Spline heights that are drawn.
    Random,
    /// A multisine with Schroeder's phases.
    Multisine,
    /// A Fourier series whose coefficients are drawn.
    Fourier,
}

impl Method {
    /// All, with their names on the command line.
    pub const ALL: [(&'static str, Self); 4] = [
        ("fisher-cem", Self::FisherCem),
        ("random", Self::Random),
        ("multisine", Self::Multisine),
        ("fourier", Self::Fourier),
    ];

    /// The method of a name.
    ///
    /// # Errors
    /// When there is none.
    pub fn named(name: &str) -> Result<Self> {
        let found = Self::ALL.iter().find(|(n, _)| *n == name);
        found.map(|(_, m)| *m).ok_or_else(|| {
            Error::unknown(
                "explorer of any machine",
                name,
                Self::ALL.iter().map(|(n, _)| *n),
            )
        })
    }

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        let found = Self::ALL.iter().find(|(_, m)| *m == self);
        found.map_or("", |(n, _)| n)
    }

    /// The curve that it moves.
    #[must_use]
    pub fn shape(self, settings: &DesignSettings) -> Shape {
        match self {
            Self::FisherCem | Self::Random => Shape::Spline(settings.knots),
            Self::Multisine | Self::Fourier => Shape::Fourier(settings.harmonics),
        }
    }
}

/// How widely the search goes.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DesignSettings {
    /// Heights of a spline an actuator: more follow faster motions, and need a longer search.
    pub knots: usize,
    /// Harmonics of a Fourier series an actuator: five in the field's usual excitations (Swevers 1997).
    pub harmonics: usize,
    /// Rounds of the search at most.
    pub iterations: usize,
    /// Candidates a round.
    pub population: usize,
    /// Physics steps of the whole search, which bound its time: after them no round begins, of which 8 are kept. Two cores
    /// take some 5e5 steps of an arm of six joints a second; those of a machine of more coordinates count for more.
    pub physics_steps: f64,
}

impl Default for DesignSettings {
    fn default() -> Self {
        Self {
            knots: 12,
            harmonics: 5,
            iterations: 40,
            population: 40,
            physics_steps: 3e7,
        }
    }
}

/// Coordinates of the machine whose physics steps count once.
const SIX_JOINTS: f64 = 6.0;

/// Power of the number of coordinates that the time of a physics step grows with: between the linear one of a chain and the
/// cubic one of its constraints.
const GROWTH: f64 = 1.5;

/// Share of a round's candidates that the next one is drawn about.
const ELITE: f64 = 0.2;

/// Rounds of the search at least.
const FEWEST_ROUNDS: usize = 8;

/// First deviation of the search in each coefficient, about its best draw; coefficients reach from -1 to 1.
const SPREAD: f64 = 0.3;

/// Factors by which a motion is made smaller to keep limits.
const SHRINK: f64 = 0.85;

/// Times that it is made smaller at most: down to a thousandth.
const SHRINKS: usize = 43;

/// Smallest size of the first draws: a machine that hardly damps comes to rest from small motions only.
const SMALLEST: f64 = 1e-3;

/// Sizes in which each round tries the best motion so far.
const SIZES: [f64; 4] = [1.0, 0.9, 1.15, 1.4];

/// Candidates of a round that are looked at everywhere, at most: each that breaks a limit shows the search a new point.
const LOOKS: usize = 4;

/// How much larger the answer is played to see which limit it would break first.
const LARGER: f64 = 1.25;

/// Corners of the ranges that the answer is played at, at most.
const CORNERS: usize = 16;

/// A motion that was found.
#[derive(Clone, Debug)]
pub struct Designed {
    /// Commands, `frames x nu`.
    pub commands: Vec<f64>,
    /// What it tells.
    pub told: Told,
    /// Its play at the middle of the unknowns.
    pub played: Played,
    /// By how much limits are passed at the worst of all points; nothing where they are kept.
    pub excess: Excess,
    /// The limit that a motion larger by a quarter would break.
    pub next_limit: Option<String>,
    /// Factor that its largest motion was made smaller by.
    pub scale: f64,
    /// Best cost after each round.
    pub course: Vec<f64>,
}

/// What a search works on.
pub struct Designer<'p, 'a> {
    /// Plays motions.
    pub player: &'p mut Player<'a>,
    /// Motions.
    pub family: Family,
    /// Unknowns, then nuisance entries.
    pub parameters: &'p [Parameter],
    /// Number of unknowns.
    pub sought: usize,
    /// Values about which is searched.
    pub values: Vec<f64>,
    /// What is known beside the prior, such as from logs.
    pub known: Told,
    /// What is made small.
    pub objective: Objective,
    /// Physics steps of a frame.
    pub substeps: usize,
}

impl<'a> Designer<'_, 'a> {
    /// Finds a motion.
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
        if self.family.is_empty() {
            return Err(Error::Config {
                key: "actuator".into(),
                message: "no actuator has a range to move in: give its joint or command one, such as --limit-position \
                          JOINT:LOW:HIGH"
                    .into(),
            });
        }
        let mut rng = streams.stream("design");
        let corners = self.corners(&mut streams.stream("corners"));
        let ends = ends(self.parameters, &self.values);
        let points = [vec![self.values.clone()], ends, corners].concat();
        let (coefficients, course) = match method {
            Method::FisherCem => self.search(settings, &points, &mut rng, progress)?,
            Method::Multisine => (self.family.multisine(), Vec::new()),
            Method::Random | Method::Fourier => (self.family.random(&mut rng), Vec::new()),
        };
        self.finish(&coefficients, course, &points)
    }

    /// The cross-entropy search; the best coefficients, and the best cost after each round.
    fn search(
        &mut self,
        settings: &DesignSettings,
        points: &[Vec<f64>],
        rng: &mut Rng,
        progress: &dyn Progress,
    ) -> Result<(Vec<f64>, Vec<f64>)> {
        let n = self.family.len();
        // What a step counts.
        let size = self.player.coordinates() as f64 / SIX_JOINTS;
        let bound = settings.physics_steps / size.max(1.0).powf(GROWTH);
        let begun = self.player.steps();
        let rounds = settings.iterations.max(FEWEST_ROUNDS);
        progress.begin("explore", rounds as u64 + 1);
        // Draws, and curves like those of the baselines, at sizes from the whole down to a thousandth: the best that keeps the
        // limits is the middle of the search.
        let fourier = Family {
            shape: Shape::Fourier(settings.harmonics),
            ..self.family.clone()
        };
        let mut draws = vec![vec![0.0; n]];
        let mut sizes = vec![SMALLEST];
        while draws.len() < settings.population {
            let along = (draws.len() - 1) as f64 / (settings.population - 2).max(1) as f64;
            let size = SMALLEST.powf(along);
            let drawn = match draws.len() % 3 {
                0 => self.family.random(rng),
                1 => self.family.near(&fourier, &fourier.random(rng)),
                _ => self.family.near(&fourier, &fourier.multisine()),
            };
            draws.push(drawn.iter().map(|c| c * size).collect());
            sizes.push(size);
        }
        let mut far = far(self.parameters, &self.values);
        let mut costs = self.candidates(&far).costs(&draws, 1)?;
        let mut looks = (draws.len(), f64::INFINITY);
        let first = self.best(&draws, &mut costs, looks, points, &mut far)?;
        let first = first.unwrap_or(0);
        let spread = SPREAD * sizes[first];
        progress.advance(1);
        let rule = CemSettings {
            elite_fraction: ELITE,
            ..CemSettings::default()
        };
        let mut search = Cem::new(
            rule,
            &draws[first],
            &vec![spread; n],
            &vec![-1.0; n],
            &vec![1.0; n],
        );
        let mut course = vec![costs[first]];
        let mut best = (draws[first].clone(), costs[first]);
        for round in 0..rounds {
            if round >= FEWEST_ROUNDS && (self.player.steps() - begun) as f64 >= bound {
                break;
            }
            // The best so far, also larger and smaller: limits bind the size before the shape.
            let mut candidates: Vec<Vec<f64>> = SIZES
                .iter()
                .map(|size| best.0.iter().map(|c| (c * size).clamp(-1.0, 1.0)).collect())
                .collect();
            let drawn = settings.population.saturating_sub(SIZES.len()).max(2);
            candidates.extend(search.ask(drawn, rng));
            let elite = (ELITE * candidates.len() as f64).round() as usize;
            let mut costs = self.candidates(&far).costs(&candidates, elite.max(2))?;
            looks = (LOOKS, best.1);
            if let Some(k) = self.best(&candidates, &mut costs, looks, points, &mut far)? {
                best = (candidates[k].clone(), costs[k]);
            }
            search.tell(&candidates, &costs);
            course.push(best.1);
            progress.note(&format!("explore, {:.3}", best.1));
            progress.advance(1);
        }
        progress.end();
        Ok((best.0, course))
    }

    /// The best candidate below a cost that keeps all limits at all points, of so many that are looked at; where all break one, that
    /// which does by the least. Points where better ones break a limit join those far from the middle, and their costs say so.
    fn best(
        &mut self,
        candidates: &[Vec<f64>],
        costs: &mut [f64],
        (looks, below): (usize, f64),
        points: &[Vec<f64>],
        far: &mut Vec<Vec<f64>>,
    ) -> Result<Option<usize>> {
        for _ in 0..looks {
            let order = |&i: &usize, &j: &usize| costs[i].total_cmp(&costs[j]);
            let best = (0..costs.len()).min_by(order);
            let Some(k) = best.filter(|&k| costs[k] < below) else {
                return Ok(None);
            };
            if costs[k] >= BROKEN {
                return Ok(Some(k));
            }
            let all = self.excess_at(&candidates[k], 1.0, points)?;
            if all.iter().all(Excess::is_none) {
                return Ok(Some(k));
            }
            costs[k] = BROKEN * (1.0 + joined(&all).total);
            let worst = points[worst_of(&all)].clone();
            if !far.contains(&worst) {
                far.push(worst);
            }
        }
        Ok(None)
    }

    /// What ranks candidates.
    fn candidates<'s>(&'s mut self, far: &'s [Vec<f64>]) -> Candidates<'s, 'a> {
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

    /// The entries in which a point differs from the middle.
    fn words(&self, point: &[f64]) -> String {
        let entries = self.parameters.iter().zip(point).zip(&self.values);
        let moved = entries.filter(|((_, x), middle)| x != middle);
        let words: Vec<String> = moved
            .map(|((p, x), _)| format!("{} = {x}", p.name))
            .collect();
        words.join(", ")
    }

    /// Corners of the ranges: all of them where they are few, else draws.
    fn corners(&self, rng: &mut Rng) -> Vec<Vec<f64>> {
        let n = self.parameters.len();
        let few = n < usize::BITS as usize && 1 << n <= CORNERS;
        let count = if few { 1 << n } else { CORNERS };
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

    /// By how much a motion passes limits at each of some points, with every physics step looked at.
    fn excess_at(
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

    /// Plays the answer with every step looked at, smaller and smaller until nothing is broken.
    fn finish(
        &mut self,
        coefficients: &[f64],
        course: Vec<f64>,
        points: &[Vec<f64>],
    ) -> Result<Designed> {
        let mut scale = 1.0;
        let mut excess = Excess::default();
        // Where the last size broke the most: a size that breaks a limit there needs no look elsewhere.
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
        let (near, widths) = differences(self.parameters, &self.values);
        let jobs: Vec<(&[f64], &[f64])> = near.iter().map(|p| (&commands[..], &p[..])).collect();
        let plays = self.player.play(&jobs, self.substeps)?;
        Ok(Designed {
            told: of_plays(self.player, &plays, &widths, self.sought),
            played: plays
                .into_iter()
                .next()
                .ok_or_else(|| Error::Failed("nothing was played".into()))?,
            commands,
            next_limit: larger.worst.map(|(what, _)| what),
            excess,
            scale,
            course,
        })
    }
}

/// Excesses of several plays as one.
fn joined(all: &[Excess]) -> Excess {
    let mut one = Excess::default();
    all.iter().for_each(|e| one.join(e));
    one
}

/// The place of the largest excess.
fn worst_of(all: &[Excess]) -> usize {
    (0..all.len())
        .max_by(|&i, &j| all[i].total.total_cmp(&all[j].total))
        .unwrap_or(0)
}
