//! Exploration episodes of several explorers, played with the same seeds. Every figure is made of
//! these.

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use anyhow::Result;
use asid_comparison::preset;
use asid_comparison::schedule;
use asid_core::real_world::{RealEpisode, RealWorld as _};
use asid_core::registry::{ExplorerEntry, find};
use asid_core::{Episode, Error, Explorer, Policy};
use asid_worlds::SimulatedWorld;

use super::variant::Variant;
use super::wanted::Wanted;
use crate::cli::compare::arm::reaches;
use crate::cli::options::{Algorithms, Common, Worlds};
use crate::cli::session::Session;

/// An episode that was played.
pub struct Played {
    /// The request that it was played for.
    pub wanted: Wanted,
    /// Start pose of the object.
    pub start: Vec<f64>,
    /// The log, with the trackers' noise.
    pub log: Episode,
    /// True readings, `frames + 1` rows as in the log.
    pub readings: Vec<f64>,
    /// Actions, `horizon x action`; only models of the motion replay them.
    #[cfg_attr(not(feature = "torch"), expect(dead_code))]
    pub actions: Vec<f64>,
    /// Share of control steps with contact.
    pub contact_fraction: f64,
}

impl Played {
    /// The true readings of a channel, one row a frame.
    pub fn channel(&self, name: &str) -> Result<Vec<&[f64]>> {
        let channels = &self.log.channels;
        let width: usize = channels.iter().map(|c| c.len).sum();
        let mut start = 0;
        for channel in channels {
            if channel.name == name {
                let rows = self.readings.chunks_exact(width);
                return Ok(rows.map(|r| &r[start..start + channel.len]).collect());
            }
            start += channel.len;
        }
        let known = channels.iter().map(|c| &*c.name);
        Err(Error::unknown("channel", name, known).into())
    }

    /// Positions of a body in the plane, m, from the sensor of its position.
    pub fn path(&self, sensor: &str) -> Result<Vec<[f64; 2]>> {
        Ok(self.channel(sensor)?.iter().map(|r| [r[0], r[1]]).collect())
    }

    /// Distance between the first and the last position of a body in the plane, m.
    pub fn displacement(&self, sensor: &str) -> Result<f64> {
        let path = self.path(sensor)?;
        let [first, last] = [path[0], path[path.len() - 1]];
        Ok((last[0] - first[0]).hypot(last[1] - first[1]))
    }
}

/// Plays all episodes on the requested number of threads; the order is that of `wanted`.
pub fn play(common: &Common, wanted: Vec<Wanted>) -> Result<Vec<Played>> {
    each(common, wanted, |wanted| {
        let session = open(common, wanted, false)?;
        let config = &session.config.explorer;
        let explorer = (find::<ExplorerEntry>(&config.name)?.make)(&config.settings)?;
        let problem = session.problem();
        let mut explored = explorer.explore(&problem, None)?;
        played(&session, wanted, &mut *explored.policy)
    })
}

/// Applies `work` to each episode on the requested number of threads, and shows the progress.
///
/// The results are in the order of `wanted`.
///
/// # Errors
/// When a setting is wrong, before any episode begins. Otherwise the first error of an episode; no
/// further episode begins after it.
pub fn each<T: Send>(
    common: &Common,
    wanted: Vec<Wanted>,
    work: impl Fn(&Wanted) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    let workers = common
        .threads
        .or_else(|| std::thread::available_parallelism().ok().map(usize::from))
        .unwrap_or(1);
    check(common, &wanted)?;
    let total = wanted.len();
    let done: Mutex<Vec<(usize, Result<T>)>> = Mutex::new(Vec::with_capacity(total));
    let stop = AtomicBool::new(false);
    let clock = Instant::now();
    let pieces: Vec<(usize, Wanted)> = wanted.into_iter().enumerate().collect();
    schedule::run(
        &pieces,
        workers,
        &stop,
        |(_, wanted)| work(wanted),
        |(index, wanted), result| {
            let defect = |_| Err(Error::Failed("an episode broke off by a defect".into()).into());
            let result = result.unwrap_or_else(defect);
            stop.fetch_or(result.is_err(), Ordering::SeqCst);
            let mut all = done.lock().unwrap_or_else(PoisonError::into_inner);
            all.push((*index, result));
            if !common.quiet {
                let each = clock.elapsed().as_secs_f64() / all.len() as f64;
                let _ = write!(
                    std::io::stderr(),
                    "\r{}/{total} episodes, {:.0} s left ({}, {})      ",
                    all.len(),
                    each * (total - all.len()) as f64,
                    wanted.task,
                    Variant::of(&wanted.explorer).label()
                );
            }
        },
    )?;
    if !common.quiet {
        let _ = writeln!(std::io::stderr());
    }
    let mut all = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    all.sort_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, result)| result).collect()
}

/// Opens one session for each task, explorer and settings, so that a wrong call ends before any
/// work.
fn check(common: &Common, wanted: &[Wanted]) -> Result<()> {
    let mut checked: Vec<&Wanted> = Vec::new();
    for one in wanted {
        let own = |w: &Wanted| {
            let parts = (&w.task, &w.explorer, &w.set, &w.effects);
            parts == (&one.task, &one.explorer, &one.set, &one.effects)
        };
        if !checked.iter().any(|w| own(w)) {
            open(common, one, false)?;
            checked.push(one);
        }
    }
    Ok(())
}

/// The session of an episode; `quick` cuts the searches of explorer and identifier as in a quick
/// comparison.
///
/// # Errors
/// When a setting is wrong or something is missing.
pub fn open(common: &Common, wanted: &Wanted, quick: bool) -> Result<Session> {
    let variant = Variant::of(&wanted.explorer);
    let mut own = common.clone();
    own.seed = Some(wanted.seed);
    // Episodes run in parallel, so each uses one thread.
    own.threads = Some(1);
    own.quiet = true;
    // A setting applies only to explorers that have it.
    let task = super::task(&wanted.task)?;
    own.set.retain(|assignment| {
        let key = assignment.trim_start().strip_prefix("explorer.");
        let key = key.and_then(|k| k.split(['.', '=']).next());
        key.is_none_or(|k| reaches::<dyn Explorer>(&*task, "explorer", variant.name, k.trim()))
    });
    let names_policy = |s: &String| s.trim_start().starts_with("explorer.policy");
    let given = own.set.iter().any(names_policy);
    let of_variant = variant.set()?.into_iter();
    own.set
        .extend(of_variant.filter(|s| !given || !names_policy(s)));
    own.set.extend(wanted.set.iter().cloned());
    let algorithms = Algorithms {
        explorer: Some(variant.name.to_owned()),
        ..Algorithms::default()
    };
    let mut worlds = Worlds::default();
    worlds.real.real_effect.clone_from(&wanted.effects);
    let session = Session::open(&wanted.task, &own, &algorithms, &worlds)?;
    if !quick {
        return Ok(session);
    }
    let config = &session.config;
    let halved = [
        preset::quick("explorer", &config.explorer.settings),
        preset::quick("identifier", &config.identifier.settings),
    ];
    let set = halved.into_iter().flatten();
    own.set
        .extend(set.map(|(key, value)| format!("{key}={value}")));
    let rounds = config.expected.rounds.div_ceil(2);
    own.set.push(format!("expected.rounds={rounds}"));
    Session::open(&wanted.task, &own, &algorithms, &worlds)
}

/// Plays a policy in the real world of a session.
///
/// # Errors
/// When the policy or the world fails.
pub fn played(session: &Session, wanted: &Wanted, policy: &mut dyn Policy) -> Result<Played> {
    let world = session.world(&session.truth())?;
    played_in(world, wanted, policy)
}

/// Plays a policy in a world, from the requested start.
///
/// # Errors
/// When the policy or the world fails.
pub fn played_in(
    mut world: SimulatedWorld<'_>,
    wanted: &Wanted,
    policy: &mut dyn Policy,
) -> Result<Played> {
    if let Some(start) = &wanted.start {
        world = world.with_exploration_start(start.clone());
    }
    let start = world.exploration_start();
    let RealEpisode {
        episode,
        actions,
        contact_fraction,
        true_readings,
        ..
    } = world.explore(policy)?;
    Ok(Played {
        start,
        readings: true_readings.unwrap_or_else(|| episode.readings.clone()),
        log: episode,
        actions,
        contact_fraction,
        wanted: wanted.clone(),
    })
}
