//! `asid compare --figure NAME`: the figures of the paper as commands. Each plays exploration
//! episodes, computes the quantities of the paper's figure, and writes data, numbers and the
//! picture.
//!
//! Two figures are not in the paper: `explorers` ranks explorers by what their episodes tell, and
//! `difficulty` shows how methods fare as a task gets harder.

mod claim;
mod difficulty;
mod displacement;
mod distractors;
mod drawing;
mod episodes;
mod explorers;
mod generalization;
mod laptop;
#[cfg(feature = "torch")]
mod learned_model;
mod map;
mod patches;
mod variant;
mod wanted;

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_comparison::rows::ComparisonResult;
use asid_core::registry::{TaskEntry, find};
use asid_core::{Error, Task};
use serde::Serialize;

use super::options::Common;
use super::output::{OutFolder, write_json, write_text};
use super::result::Program;
use claim::Claim;
use drawing::{Data, Drawing, Number, Panel, mean, median, share};

/// Compares methods on a task under one more setting, in a folder of its own that can be resumed.
pub type CompareAt<'a> = Box<dyn Fn(&str, &str, &Path) -> Result<ComparisonResult> + Sync + 'a>;

/// What a figure is drawn with.
pub struct Request<'a> {
    /// Options of the command.
    pub common: Common,
    /// Tasks that replace the figure's own.
    pub tasks: Vec<String>,
    /// Episodes of each explorer, or of each square of a map.
    pub episodes: Option<u64>,
    /// Explorers that replace the figure's own.
    pub explorers: Vec<String>,
    /// Levels of a difficulty, as `NAME=VALUE,VALUE`, that replace the task's own.
    pub levels: Option<String>,
    /// Coarser maps, fewer episodes, smaller searches.
    pub quick: bool,
    /// Runs the requested comparison, with the requested conditions and seeds.
    pub compare: CompareAt<'a>,
}

impl Request<'_> {
    /// The explorers to show, without repetition: the requested ones, else the figure's own.
    fn explorers(&self, own: &[&str]) -> Vec<String> {
        if self.explorers.is_empty() {
            return own.iter().map(|&e| e.to_owned()).collect();
        }
        variant::distinct(&self.explorers)
    }

    /// Episodes of each explorer: the requested number, else the figure's own.
    fn episodes(&self, quick: u64, whole: u64) -> u64 {
        self.episodes
            .unwrap_or(if self.quick { quick } else { whole })
    }

    /// Seed of the first episode.
    fn seed(&self) -> u64 {
        self.common.seed.unwrap_or(0)
    }
}

/// How a figure is drawn.
enum Draw {
    /// From episodes that this command plays.
    Episodes(fn(&Request<'_>) -> Result<Drawing>),
    /// From comparisons, kept in the figure's folder under [`Draw::KEPT`].
    Comparisons(fn(&Request<'_>, &Path) -> Result<Drawing>),
}

impl Draw {
    /// Folder of a figure's comparisons, below its own.
    const KEPT: &'static str = "levels";
}

/// A figure.
struct Entry {
    name: &'static str,
    about: &'static str,
    /// Whether the figure shows the named tasks rather than its own.
    tasks: bool,
    draw: Draw,
}

/// What a figure uses.
pub struct Uses {
    /// The tasks that are named.
    pub tasks: bool,
    /// Comparisons with their options, rather than episodes that this command plays.
    pub comparisons: bool,
}

/// What the figure of this name uses.
///
/// # Errors
/// When there is no such figure.
pub fn uses(name: &str) -> Result<Uses> {
    let entry = entry(name)?;
    Ok(Uses {
        tasks: entry.tasks,
        comparisons: matches!(entry.draw, Draw::Comparisons(_)),
    })
}

/// The figure of this name.
fn entry(name: &str) -> Result<&'static Entry> {
    let found = FIGURES.iter().find(|f| f.name == name);
    Ok(found.ok_or_else(|| Error::unknown("figure", name, FIGURES.iter().map(|f| f.name)))?)
}

const FIGURES: [Entry; 8] = [
    Entry {
        name: "patches",
        about: "where the ball goes on three patches of friction (ASID, figure 4)",
        tasks: false,
        draw: Draw::Episodes(patches::draw),
    },
    Entry {
        name: "displacement",
        about: "how far the ball is pushed from each start position (ASID, figure 7)",
        tasks: false,
        draw: Draw::Episodes(displacement::draw),
    },
    Entry {
        name: "laptop",
        about: "how often the lid is moved (ASID, section 5.2)",
        tasks: false,
        draw: Draw::Episodes(laptop::draw),
    },
    Entry {
        name: "distractors",
        about: "which of four balls is pushed (ASID, figure 10)",
        tasks: false,
        draw: Draw::Episodes(distractors::draw),
    },
    Entry {
        name: "learned-model",
        about: "learned models of the motion beside the simulator, where nothing was seen (ASID, appendix)",
        tasks: false,
        draw: Draw::Episodes(draw_learned_model),
    },
    Entry {
        name: "generalization",
        about: "pushes from start positions and masses never trained on (ASID, figure 13)",
        tasks: false,
        draw: Draw::Episodes(generalization::draw),
    },
    Entry {
        name: "explorers",
        about: "explorers ranked by the posterior that their episodes lead to, and what was expected of it",
        tasks: true,
        draw: Draw::Episodes(explorers::draw),
    },
    Entry {
        name: "difficulty",
        about: "success of methods as a task gets harder",
        tasks: true,
        draw: Draw::Comparisons(difficulty::draw),
    },
];

/// `result.json` of a figure.
#[derive(Serialize)]
struct FigureResult<'a> {
    schema: u32,
    figure: &'a str,
    quick: bool,
    notes: &'a [String],
    numbers: &'a [Number],
    claims: &'a [Claim],
    versions: Program,
    command: String,
}

/// Draws a figure and writes its folder.
pub fn figure(name: &str, request: &Request<'_>) -> Result<()> {
    let entry = entry(name)?;
    let common = &request.common;
    let (out, stem) = (common.out.as_deref(), format!("figure-{name}"));
    let (out, drawing) = match entry.draw {
        Draw::Episodes(draw) => (OutFolder::claim(out, &stem)?, draw(request)?),
        Draw::Comparisons(draw) => {
            let out = OutFolder::claim_with(out, &stem, Draw::KEPT)?;
            let kept: PathBuf = out.path().join(Draw::KEPT);
            let drawing = draw(request, &kept)?;
            (out, drawing)
        }
    };
    let result = FigureResult {
        schema: 2,
        figure: name,
        quick: request.quick,
        notes: &drawing.notes,
        numbers: &drawing.numbers,
        claims: &drawing.claims,
        versions: Program::THIS,
        command: super::run::command_line(),
    };
    out.write(|folder| {
        write_json(&folder.join("result.json"), &result)?;
        for data in &drawing.data {
            write_text(&folder.join(&data.name), &data.csv()?)?;
        }
        if let Some(tables) = drawing.markdown() {
            write_text(&folder.join("table.md"), &tables)?;
        }
        write_text(&folder.join("picture.svg"), &drawing.picture())?;
        let html = drawing.html(name, entry.about, request.quick, &result.command);
        write_text(&folder.join("report.html"), &html)
    })?;
    let mut stdout = std::io::stdout().lock();
    if common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&result)?)?;
        return Ok(());
    }
    drawing.tell(&mut stdout, &out.path())
}

#[cfg(feature = "torch")]
use learned_model::draw as draw_learned_model;

#[cfg(not(feature = "torch"))]
fn draw_learned_model(_: &Request<'_>) -> Result<Drawing> {
    Err(Error::Missing {
        what: "the figure `learned-model`".into(),
        message: "learning a model of the motion needs libtorch, and this build is without it: `cargo xtask \
                  setup`, `--features torch`"
            .into(),
    }
    .into())
}

/// The task of this name.
fn task(name: &str) -> Result<Box<dyn Task>> {
    Ok((find::<TaskEntry>(name)?.make)()?)
}
