//! Runs a world through its episodes.

use crate::anatomy::Anatomy;
use crate::engine::Sim;
use crate::error::{Error, Result};
use crate::motion::Motion;
use crate::world::World;

/// The sensors' readings without noise: one series per episode, one row per time step.
#[derive(Clone, Debug)]
pub struct Record {
    /// Time step, s.
    pub dt: f64,
    /// Number of values in a row.
    pub width: usize,
    /// Each episode, `steps x width`.
    pub episodes: Vec<Vec<f64>>,
    /// Typical motion and forces of the machine.
    pub typical: Typical,
}

/// Typical magnitudes over all episodes; root mean squares unless a field says otherwise.
#[derive(Clone, Debug, Default)]
pub struct Typical {
    /// Speed of each degree of freedom, rad/s or m/s.
    pub speed: Vec<f64>,
    /// Force of the drives at each degree of freedom, N m or N.
    pub drive: Vec<f64>,
    /// Gravity and inertial coupling forces at each degree of freedom, N m or N.
    pub weight: Vec<f64>,
    /// Standard deviation of each command.
    pub command: Vec<f64>,
    /// Largest force of the drives at each degree of freedom, N m or N.
    pub peak: Vec<f64>,
    /// Standard deviation of each value of the readings.
    pub spread: Vec<f64>,
    /// Mean of each position.
    pub mean: Vec<f64>,
    /// Standard deviation of each position.
    pub roam: Vec<f64>,
}

impl Record {
    /// A reading at a time of an episode, interpolated linearly between time steps.
    #[must_use]
    pub fn at(&self, episode: usize, time: f64, column: usize) -> f64 {
        let rows = &self.episodes[episode];
        let last = rows.len() / self.width - 1;
        let place = (time / self.dt).clamp(0.0, last as f64);
        // A time that equals a multiple of the step except for rounding is that step.
        let near = place.round();
        if (place - near).abs() < 1e-6 {
            return rows[near as usize * self.width + column];
        }
        let low = place.floor();
        let (i, share) = (low as usize, place - low);
        let (a, b) = (
            rows[i * self.width + column],
            rows[(i + 1) * self.width + column],
        );
        a + share * (b - a)
    }
}

/// Runs all episodes of a world.
///
/// # Errors
/// If the model is refused or a simulation diverges.
pub fn simulate(anatomy: &Anatomy, world: &mut World, motions: &[Motion]) -> Result<Record> {
    watched(anatomy, world, motions, &mut |_, _| {})
}

/// Runs all episodes of a world; calls `look` after each step, with its number in its episode.
///
/// # Errors
/// As [`simulate`].
pub fn watched(
    anatomy: &Anatomy,
    world: &mut World,
    motions: &[Motion],
    look: &mut dyn FnMut(&Sim, usize),
) -> Result<Record> {
    let name = anatomy.machine.name;
    let mut sim = Sim::new(world.compile(name)?, world.by_rapier);
    let (width, nu) = (anatomy.width(), anatomy.drives.len());
    let mut episodes = Vec::with_capacity(motions.len());
    let mut tally = Tally::new(anatomy);
    for (number, motion) in motions.iter().enumerate() {
        sim.begin(number, &motion.qpos, &motion.qvel);
        for (drive, path) in &mut world.commands {
            path.episode(number);
            path.begin(motion.commands[*drive], sim.dt);
        }
        for force in &mut world.forces {
            force.begin(&mut sim);
        }
        let held = motion.period / sim.dt;
        let steps = ((motion.rows - 1) as f64 * held).round() as usize + 1;
        let mut rows = Vec::with_capacity(steps * width);
        for step in 0..steps {
            for force in &mut world.forces {
                force.before(&mut sim);
            }
            sim.observe();
            for sensor in &anatomy.sensors {
                rows.extend_from_slice(
                    &sim.readings()[sensor.address..sensor.address + sensor.len],
                );
            }
            let row = ((step as f64 / held + 1e-9) as usize).min(motion.rows - 1);
            let sent = &motion.commands[row * nu..(row + 1) * nu];
            sim.ctrl().copy_from_slice(sent);
            for (drive, path) in &mut world.commands {
                let arriving = sim.ctrl()[*drive];
                sim.ctrl()[*drive] = path.next(arriving);
            }
            for force in &mut world.forces {
                force.act(&mut sim);
            }
            if !sim.advance() {
                return Err(Error::Diverged {
                    machine: name.to_owned(),
                    time: sim.time,
                });
            }
            tally.add(&sim, sent);
            look(&sim, step);
        }
        let mut column = vec![0.0; steps];
        for (place, path) in &world.readings {
            for (value, row) in column.iter_mut().zip(rows.chunks(width)) {
                *value = row[*place];
            }
            path.distort(&mut column, sim.dt, number);
            for (value, row) in column.iter().zip(rows.chunks_mut(width)) {
                row[*place] = *value;
            }
        }
        episodes.push(rows);
    }
    Ok(Record {
        dt: sim.dt,
        width,
        typical: tally.typical(&episodes, width),
        episodes,
    })
}

/// Sums for [`Typical`].
struct Tally {
    steps: f64,
    squares: Typical,
    sums: Vec<f64>,
}

impl Tally {
    fn new(anatomy: &Anatomy) -> Self {
        let (nv, nu) = (anatomy.nv, anatomy.drives.len());
        let nq = anatomy.qpos0.len();
        Self {
            steps: 0.0,
            sums: vec![0.0; nu],
            squares: Typical {
                speed: vec![0.0; nv],
                drive: vec![0.0; nv],
                weight: vec![0.0; nv],
                peak: vec![0.0; nv],
                command: vec![0.0; nu],
                spread: Vec::new(),
                mean: vec![0.0; nq],
                roam: vec![0.0; nq],
            },
        }
    }

    fn add(&mut self, sim: &Sim, sent: &[f64]) {
        self.steps += 1.0;
        let add = |sums: &mut [f64], values: &[f64]| {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += value * value;
            }
        };
        add(&mut self.squares.speed, sim.qvel());
        add(&mut self.squares.drive, sim.drive_forces());
        add(&mut self.squares.weight, sim.bias_forces());
        add(&mut self.squares.command, sent);
        add(&mut self.squares.roam, sim.qpos());
        for (sum, value) in self.squares.mean.iter_mut().zip(sim.qpos()) {
            *sum += value;
        }
        for (peak, force) in self.squares.peak.iter_mut().zip(sim.drive_forces()) {
            *peak = peak.max(force.abs());
        }
        for (sum, value) in self.sums.iter_mut().zip(sent) {
            *sum += value;
        }
    }

    fn typical(self, episodes: &[Vec<f64>], width: usize) -> Typical {
        let n = self.steps.max(1.0);
        let root = |sums: &[f64]| sums.iter().map(|s| (s / n).sqrt()).collect::<Vec<_>>();
        let command = self.squares.command.iter().zip(&self.sums);
        let spread = (0..width).map(|column| {
            let values = episodes
                .iter()
                .flat_map(|e| e.iter().skip(column).step_by(width));
            let mean = values.clone().sum::<f64>() / n;
            (values.map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
        });
        let mean: Vec<f64> = self.squares.mean.iter().map(|s| s / n).collect();
        let roam = self.squares.roam.iter().zip(&mean);
        let roam = roam.map(|(square, mean)| (square / n - mean * mean).max(0.0).sqrt());
        Typical {
            roam: roam.collect(),
            mean,
            speed: root(&self.squares.speed),
            drive: root(&self.squares.drive),
            weight: root(&self.squares.weight),
            peak: self.squares.peak.clone(),
            command: command
                .map(|(square, sum)| (square / n - (sum / n).powi(2)).max(0.0).sqrt())
                .collect(),
            spread: spread.collect(),
        }
    }
}
