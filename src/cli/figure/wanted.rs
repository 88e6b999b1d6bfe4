//! Which episodes a figure plays, and with which explorers.

use anyhow::Result;
use asid_core::Error;

use super::Request;
use super::episodes::Played;
use super::variant::{Labels, Variant};

/// Episodes to play.
#[derive(Clone, Debug, Default)]
pub struct Wanted {
    /// The task.
    pub task: String,
    /// The explorer, as [`Variant::of`] reads it.
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

/// The explorers that a figure shows on a task, and why others are left out.
///
/// # Errors
/// When a name is unknown, or nothing is left.
pub fn playable(
    request: &Request<'_>,
    task: &str,
    own: &[&str],
) -> Result<(Vec<String>, Vec<String>)> {
    let (mut kept, mut notes) = (Vec::new(), Vec::new());
    for explorer in request.explorers(own) {
        match Variant::of(&explorer).lacks(task)? {
            Some(why) => notes.push(why),
            None => kept.push(explorer),
        }
    }
    if kept.is_empty() {
        return Err(Error::Failed(notes.join("; ")).into());
    }
    Ok((kept, notes))
}

/// The same episodes for each explorer: seeds from `first` on, each of which draws the start.
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
        seed,
        ..Wanted::default()
    };
    explorers
        .iter()
        .flat_map(|explorer| (first..first + episodes).map(move |seed| one(explorer, seed)))
        .collect()
}

/// Each explorer by its label, with its episodes.
pub fn by_explorer<'p>(
    explorers: &[String],
    played: &'p [Played],
) -> Vec<(String, Vec<&'p Played>)> {
    let labels = Labels::of(explorers);
    let of = |explorer: &String| {
        let own = played.iter().filter(|p| &p.wanted.explorer == explorer);
        (labels.get(explorer), own.collect())
    };
    explorers.iter().map(of).collect()
}
