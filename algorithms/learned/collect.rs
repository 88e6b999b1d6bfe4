//! Collects episodes of an explorer at truths drawn from the prior: the training data of an
//! estimator.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use asid_core::progress::Silent;
use asid_core::{Error, Explorer, Problem, Result};

use crate::episodes::EpisodeBatch;
use crate::history::History;

/// Episode histories with their true values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dataset {
    /// Histories, `n x len`.
    pub histories: Vec<f64>,
    /// Truths, prior-scaled, `n x unknowns`.
    pub truths: Vec<f64>,
    /// Numbers per history.
    pub len: usize,
    /// Numbers per history that are entries; the rest are masks.
    pub entries: usize,
    /// Marks per history; the entries of one mark are contiguous, and so are its masks.
    pub marks: usize,
}

impl Dataset {
    /// Number of episodes.
    #[must_use]
    pub fn episodes(&self) -> usize {
        self.histories.len() / self.len.max(1)
    }

    /// The first `n` episodes, and the others.
    #[must_use]
    pub fn split(&self, n: usize) -> (Self, Self) {
        let d = self.truths.len() / self.episodes().max(1);
        let part = |histories: &[f64], truths: &[f64]| Self {
            histories: histories.to_vec(),
            truths: truths.to_vec(),
            len: self.len,
            entries: self.entries,
            marks: self.marks,
        };
        let (first, rest) = self.histories.split_at(n * self.len);
        let (theirs, others) = self.truths.split_at(n * d);
        (part(first, theirs), part(rest, others))
    }
}

/// Plays `episodes` episodes of an explorer over the problem's threads, each with its own random
/// stream.
///
/// Episodes that diverged are left out. An explorer that has to learn its policy first does so
/// once, from the problem's own streams; all episodes play that policy.
///
/// # Errors
/// When the explorer or the engine fails, or more than half of the episodes diverge.
pub fn collect(problem: &Problem<'_>, explorer: &dyn Explorer, episodes: usize) -> Result<Dataset> {
    let history = History::new(problem)?;
    // Every episode asks the explorer for its policy, on any thread and with streams of its own.
    // What it learns is therefore learned here, and kept by the explorer.
    drop(explorer.explore(problem, None)?);
    let threads = match problem.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        n => n,
    };
    let next = AtomicUsize::new(0);
    let rows: Mutex<Vec<(usize, Option<Row>)>> = Mutex::new(Vec::with_capacity(episodes));
    problem
        .progress
        .begin("estimator: episodes", episodes as u64);
    let work = || -> Result<()> {
        let own = Problem {
            threads: 1,
            progress: &Silent,
            ..*problem
        };
        let mut batch = EpisodeBatch::new(&own, 1, own.streams.stream("estimator"))?;
        loop {
            let i = next.fetch_add(1, Ordering::Relaxed);
            if i >= episodes {
                return Ok(());
            }
            let row = one(&own, explorer, &history, &mut batch, i);
            if row.is_err() {
                // Stops the other threads as well.
                next.store(episodes, Ordering::Relaxed);
            }
            let row = row?;
            problem.progress.advance(1);
            if let Ok(mut rows) = rows.lock() {
                rows.push((i, row));
            }
        }
    };
    let done: Vec<Result<()>> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let join = |w: std::thread::ScopedJoinHandle<'_, Result<()>>| {
            w.join()
                .unwrap_or_else(|_| Err(Error::Failed("an episode's thread broke off".into())))
        };
        workers.into_iter().map(join).collect()
    });
    problem.progress.end();
    done.into_iter().collect::<Result<Vec<()>>>()?;
    let mut rows = rows.into_inner().unwrap_or_else(|e| e.into_inner());
    rows.sort_by_key(|r| r.0);
    let mut all = Dataset {
        len: history.len(),
        entries: history.entries(),
        marks: history.marks(),
        ..Dataset::default()
    };
    for (numbers, truth) in rows.into_iter().filter_map(|r| r.1) {
        all.histories.extend(numbers);
        all.truths.extend(truth);
    }
    if all.episodes() * 2 < episodes {
        let message = format!(
            "only {} of {episodes} episodes did not diverge",
            all.episodes()
        );
        return Err(Error::Failed(message));
    }
    Ok(all)
}

/// History and prior-scaled truth of an episode.
type Row = (Vec<f64>, Vec<f64>);

/// Plays episode `i`; `None` where it diverged.
fn one(
    problem: &Problem<'_>,
    explorer: &dyn Explorer,
    history: &History,
    batch: &mut EpisodeBatch<'_>,
    i: usize,
) -> Result<Option<Row>> {
    let streams = problem.streams.child(&format!("estimator episode {i}"));
    let own = Problem {
        streams,
        ..*problem
    };
    batch.reseed(streams.stream("world"));
    batch.begin()?;
    let mut explored = explorer.explore(&own, None)?;
    explored.policy.reset();
    let protocol = problem.task.exploration();
    let mut numbers = history.blank();
    history.write(&mut numbers, 0, batch.reading(0));
    let mut action = vec![0.0; protocol.action.len()];
    for step in 0..protocol.horizon {
        explored.policy.act(step, batch.reading(0), &mut action)?;
        for (a, c) in action.iter_mut().zip(&protocol.action) {
            *a = a.clamp(c.range[0], c.range[1]);
        }
        batch.step(&action)?;
        if !batch.alive(0) {
            return Ok(None);
        }
        history.write(&mut numbers, step + 1, batch.frames(0));
    }
    let truth = batch.theta().iter().zip(problem.parameters);
    let scaled = truth.map(|(x, p)| p.to_scaled(*x)).collect();
    Ok(Some((numbers, scaled)))
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use asid_core::explore::{Explored, Policy};
    use asid_core::registry::{ExplorerEntry, find};

    use super::*;
    use crate::testing::with_problem;

    /// Always the same push.
    struct Push(f64);

    impl Policy for Push {
        fn reset(&mut self) {}

        fn act(&mut self, _step: usize, _reading: &[f64], action: &mut [f64]) -> Result<()> {
            action.fill(0.05 * self.0);
            Ok(())
        }

        fn export(&self) -> serde_json::Value {
            serde_json::Value::Null
        }
    }

    /// Learns a push on the spot, from the streams of the first problem that it is asked about.
    struct Learner(OnceLock<f64>);

    fn learned(problem: &Problem<'_>) -> f64 {
        rand::Rng::random(&mut problem.streams.stream("learner"))
    }

    impl Explorer for Learner {
        fn explore<'a>(
            &'a self,
            problem: &'a Problem<'a>,
            _start: Option<&[f64]>,
        ) -> Result<Explored<'a>> {
            let push = *self.0.get_or_init(|| learned(problem));
            Ok(Explored {
                policy: Box::new(Push(push)),
                curve: Vec::new(),
                curve_label: "",
                objective: String::new(),
            })
        }
    }

    /// Symptom: an estimator for an explorer that learns on the spot was another one at each number
    /// of threads, and from another policy than a run with the same seed plays. Cause: each thread
    /// had the explorer learn for itself, from the streams of one of its episodes.
    #[test]
    fn an_explorer_learns_once_and_from_the_problems_own_streams() {
        with_problem("rod-balancing", |problem| {
            let explorer = Learner(OnceLock::new());
            collect(problem, &explorer, 2).unwrap();
            assert_eq!(explorer.0.get(), Some(&learned(problem)));
        });
    }

    #[test]
    fn episodes_do_not_depend_on_the_number_of_threads() {
        let random = (find::<ExplorerEntry>("random").unwrap().make)(&Default::default()).unwrap();
        let mut found: Vec<Dataset> = Vec::new();
        for threads in [1, 3] {
            with_problem("rod-balancing", |problem| {
                let problem = Problem {
                    threads,
                    ..*problem
                };
                found.push(collect(&problem, &*random, 5).unwrap());
            });
        }
        assert_eq!(found[0].episodes(), 5);
        // NaN never occurs: a simulation has no missing readings.
        assert_eq!(found[0], found[1]);
        // Every episode has its own truth, start and actions.
        let rows: Vec<&[f64]> = found[0].histories.chunks_exact(found[0].len).collect();
        assert!(rows[0][0] != rows[1][0] && found[0].truths[0] != found[0].truths[1]);
        assert!(rows[0][45..] != rows[1][45..]);
    }
}
