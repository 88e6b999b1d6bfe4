//! Exploration episodes of several explorers, played at the same seeds: what every figure is
//! made of.

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::Result;
use asid_comparison::schedule;
use asid_core::Error;
use asid_core::real_world::{RealEpisode, RealWorld as _};
use asid_core::registry::{ExplorerEntry, find};
use asid_learned::learning::SHIPPED;

use crate::cli::options::{Algorithms, Common, Worlds};
use crate::cli::session::Session;

/// Episodes that are to be played.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// The task.
    pub task: String,
    /// Name of the explorer.
    pub explorer: String,
    /// Settings, as `--set` takes them.
    pub set: Vec<String>,
    /// Effects of the world that the explorer does not know, as `--real-effect` takes them.
    pub effects: Vec<String>,
    /// Seed of truth, start and noise.
    pub seed: u64,
    /// Start pose; drawn by the seed where it is not given.
    pub start: Option<Vec<f64>>,
}

/// The same episodes of each explorer: seeds from `first` on, starts drawn by them.
pub fn of_each(
    task: &str,
    explorers: &[String],
    set: &[&str],
    first: u64,
    episodes: u64,
) -> Vec<Wanted> {
    let one = |explorer: &String, seed| Wanted {
        task: task.to_owned(),
        explorer: explorer.clone(),
        set: set.iter().map(|&s| s.to_owned()).collect(),
        effects: Vec::new(),
        seed,
        start: None,
    };
    explorers
        .iter()
        .flat_map(|explorer| (first..first + episodes).map(move |seed| one(explorer, seed)))
        .collect()
}

/// An episode that was played.
pub struct Played {
    /// What was wanted.
    pub wanted: Wanted,
    /// Where the object began.
    pub start: Vec<f64>,
    /// Channels of `readings`: name and entries.
    pub channels: Vec<(String, usize)>,
    /// True readings, `frames + 1` rows.
    pub readings: Vec<f64>,
    /// Share of control steps with contact.
    pub contact_fraction: f64,
}

impl Played {
    /// The true readings of a channel, a row a frame.
    pub fn channel(&self, name: &str) -> Result<Vec<&[f64]>> {
        let width: usize = self.channels.iter().map(|c| c.1).sum();
        let mut start = 0;
        for (channel, len) in &self.channels {
            if channel == name {
                let rows = self.readings.chunks_exact(width);
                return Ok(rows.map(|r| &r[start..start + len]).collect());
            }
            start += len;
        }
        let known = self.channels.iter().map(|c| &*c.0);
        Err(Error::unknown("channel", name, known).into())
    }

    /// Places of a body in the plane, m, by the sensor of its position.
    pub fn path(&self, sensor: &str) -> Result<Vec<[f64; 2]>> {
        Ok(self.channel(sensor)?.iter().map(|r| [r[0], r[1]]).collect())
    }

    /// Distance between the first and the last place of a body in the plane, m.
    pub fn displacement(&self, sensor: &str) -> Result<f64> {
        let path = self.path(sensor)?;
        let [first, last] = [path[0], path[path.len() - 1]];
        Ok((last[0] - first[0]).hypot(last[1] - first[1]))
    }
}

/// Plays all episodes on as many threads as are asked for; the order is that of `wanted`.
pub fn play(common: &Common, wanted: Vec<Wanted>) -> Result<Vec<Played>> {
    let workers = common
        .threads
        .or_else(|| std::thread::available_parallelism().ok().map(usize::from))
        .unwrap_or(1);
    let total = wanted.len();
    let done: Mutex<Vec<(usize, Result<Played>)>> = Mutex::new(Vec::with_capacity(total));
    let stop = AtomicBool::new(false);
    let clock = Instant::now();
    let pieces: Vec<(usize, Wanted)> = wanted.into_iter().enumerate().collect();
    schedule::run(
        &pieces,
        workers,
        &stop,
        |(_, wanted)| one(common, wanted.clone()),
        |(index, wanted), played| {
            let defect = |_| Err(Error::Failed("an episode broke off by a defect".into()).into());
            let played = played.unwrap_or_else(defect);
            stop.fetch_or(played.is_err(), Ordering::SeqCst);
            let mut all = done.lock().unwrap_or_else(PoisonError::into_inner);
            all.push((*index, played));
            if !common.quiet {
                let each = clock.elapsed().as_secs_f64() / all.len() as f64;
                let _ = write!(
                    std::io::stderr(),
                    "\r{}/{total} episodes, {:.0} s left ({}, {})      ",
                    all.len(),
                    each * (total - all.len()) as f64,
                    wanted.task,
                    wanted.explorer
                );
            }
        },
    )?;
    if !common.quiet {
        let _ = writeln!(std::io::stderr());
    }
    let mut all = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    all.sort_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, played)| played).collect()
}

/// Plays one episode.
fn one(common: &Common, wanted: Wanted) -> Result<Played> {
    let mut own = common.clone();
    own.seed = Some(wanted.seed);
    own.threads = Some(1);
    own.quiet = true;
    own.set.extend(wanted.set.iter().cloned());
    let defaults = (find::<ExplorerEntry>(&wanted.explorer)?.defaults)();
    let given = own
        .set
        .iter()
        .any(|s| s.trim_start().starts_with("explorer.policy"));
    // No episode trains for itself alone.
    if defaults.contains_key("policy") && !given {
        own.set.push(format!("explorer.policy={SHIPPED:?}"));
    }
    let algorithms = Algorithms {
        explorer: Some(wanted.explorer.clone()),
        ..Algorithms::default()
    };
    let mut worlds = Worlds::default();
    worlds.real.real_effect.clone_from(&wanted.effects);
    let session = Session::open(&wanted.task, &own, &algorithms, &worlds)?;
    let truth = session.truth();
    let config = &session.config.explorer;
    let explorer = (find::<ExplorerEntry>(&config.name)?.make)(&config.settings)?;
    let problem = session.problem();
    let mut explored = explorer.explore(&problem, None)?;
    let mut world = session.world(&truth)?;
    if let Some(start) = &wanted.start {
        world = world.with_exploration_start(start.clone());
    }
    let start = world.exploration_start();
    let RealEpisode {
        episode,
        contact_fraction,
        true_readings,
        ..
    } = world.explore(&mut *explored.policy)?;
    Ok(Played {
        start,
        channels: episode
            .channels
            .iter()
            .map(|c| (c.name.clone(), c.len))
            .collect(),
        readings: true_readings.unwrap_or(episode.readings),
        contact_fraction,
        wanted,
    })
}
