//! `asid compare --figure NAME`: the figures of the paper as commands. Each plays exploration
//! episodes, counts what the paper's figure shows, and writes data, numbers and the picture.

mod displacement;
mod distractors;
mod episodes;
mod generalization;
mod laptop;
mod map;
mod patches;

use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use asid_comparison::statistics;
use asid_core::registry::{TaskEntry, find};
use asid_core::{Error, Task};
use asid_report::page::{Cell, Column, Figure, Page, Section, Table, Tone};
use asid_report::plot::{Panels, Plan};
use serde::Serialize;

use super::options::Common;
use super::output::{OutFolder, write_json, write_text};
use super::result::figure as digits;

/// What a figure is drawn with.
pub struct Request {
    /// Options of the command.
    pub common: Common,
    /// Episodes of each explorer, or of each square of a map.
    pub episodes: Option<u64>,
    /// Explorers in place of the figure's own.
    pub explorers: Vec<String>,
    /// Coarser maps and fewer episodes.
    pub quick: bool,
}

impl Request {
    /// The explorers to show: those asked for, else the figure's own.
    fn explorers(&self, own: &[&str]) -> Vec<String> {
        if self.explorers.is_empty() {
            return own.iter().map(|&e| e.to_owned()).collect();
        }
        self.explorers.clone()
    }

    /// Seed of the first episode.
    fn seed(&self) -> u64 {
        self.common.seed.unwrap_or(0)
    }
}

/// A figure of the paper.
struct Entry {
    name: &'static str,
    about: &'static str,
    draw: fn(&Request) -> Result<Drawing>,
}

const FIGURES: [Entry; 5] = [
    Entry {
        name: "patches",
        about: "where the ball goes on three patches of friction (ASID, figure 4)",
        draw: patches::draw,
    },
    Entry {
        name: "displacement",
        about: "how far the ball is pushed from each start position (ASID, figure 7)",
        draw: displacement::draw,
    },
    Entry {
        name: "laptop",
        about: "how often the lid is moved (ASID, section 5.2)",
        draw: laptop::draw,
    },
    Entry {
        name: "distractors",
        about: "which of four balls is pushed (ASID, figure 10)",
        draw: distractors::draw,
    },
    Entry {
        name: "generalization",
        about: "pushes from start positions and masses never trained on (ASID, figure 13)",
        draw: generalization::draw,
    },
];

/// A number that the figure shows.
#[derive(Clone, Debug, Serialize)]
pub struct Number {
    /// Which explorer.
    pub explorer: String,
    /// What it is.
    pub quantity: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// The number.
    pub value: f64,
    /// 95 % interval.
    pub interval95: [f64; 2],
    /// Episodes behind it.
    pub n: usize,
}

/// What the paper says of the figure, and whether these numbers agree.
#[derive(Clone, Debug, Serialize)]
pub struct Claim {
    /// The statement, with the numbers found.
    pub statement: String,
    /// What the paper reports.
    pub paper: String,
    /// Whether the numbers agree in direction.
    pub holds: bool,
}

/// A file of data.
pub struct Data {
    /// File name.
    pub name: String,
    /// Titles of its columns.
    pub columns: Vec<&'static str>,
    /// Rows of cells.
    pub rows: Vec<Vec<String>>,
}

/// A figure: data, numbers, claims and pictures.
pub struct Drawing {
    pub title: String,
    pub lead: String,
    pub data: Vec<Data>,
    pub numbers: Vec<Number>,
    pub claims: Vec<Claim>,
    pub panels: Vec<(String, Plan, String)>,
}

/// `result.json` of a figure.
#[derive(Serialize)]
struct FigureResult<'a> {
    schema: u32,
    figure: &'a str,
    numbers: &'a [Number],
    claims: &'a [Claim],
    versions: Versions,
    command: String,
}

#[derive(Serialize)]
struct Versions {
    asid: &'static str,
    git: &'static str,
}

/// Draws a figure and writes its folder.
pub fn figure(name: &str, request: &Request) -> Result<()> {
    let entry = FIGURES.iter().find(|f| f.name == name);
    let entry =
        entry.ok_or_else(|| Error::unknown("figure", name, FIGURES.iter().map(|f| f.name)))?;
    let common = &request.common;
    let out = OutFolder::claim(common.out.as_deref(), &format!("figure-{name}"))?;
    let drawing = (entry.draw)(request)?;
    let result = FigureResult {
        schema: 1,
        figure: name,
        numbers: &drawing.numbers,
        claims: &drawing.claims,
        versions: Versions {
            asid: env!("CARGO_PKG_VERSION"),
            git: env!("ASID_GIT"),
        },
        command: super::run::command_line(),
    };
    out.write(|folder| {
        write_json(&folder.join("result.json"), &result)?;
        for data in &drawing.data {
            write_text(&folder.join(&data.name), &data.csv())?;
        }
        write_text(&folder.join("picture.svg"), &drawing.picture())?;
        write_text(
            &folder.join("report.html"),
            &drawing.html(entry, &result.command),
        )
    })?;
    let mut stdout = std::io::stdout().lock();
    if common.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&result)?)?;
        return Ok(());
    }
    tell(&mut stdout, &drawing, &out.path())
}

/// Numbers and claims on the terminal.
fn tell(stdout: &mut impl std::io::Write, drawing: &Drawing, folder: &Path) -> Result<()> {
    for n in &drawing.numbers {
        writeln!(stdout, "{}: {} {}", n.explorer, n.quantity, n.text())?;
    }
    for claim in &drawing.claims {
        let mark = if claim.holds { "agrees" } else { "DIFFERS" };
        writeln!(
            stdout,
            "{mark}: {} (paper: {})",
            claim.statement, claim.paper
        )?;
    }
    writeln!(stdout, "results: {}", folder.display())?;
    Ok(())
}

impl Number {
    /// Value, unit and interval.
    fn text(&self) -> String {
        let [low, high] = self.interval95;
        let unit = if self.unit.is_empty() { "" } else { " " };
        format!(
            "{}{unit}{} ({} to {}; n = {})",
            digits(self.value),
            self.unit,
            digits(low),
            digits(high),
            self.n
        )
    }
}

impl Data {
    fn csv(&self) -> String {
        let mut text = self.columns.join(",") + "\n";
        for row in &self.rows {
            text += &row.join(",");
            text.push('\n');
        }
        text
    }
}

impl Drawing {
    fn picture(&self) -> String {
        let columns = self.panels.len().clamp(1, 3);
        let panels = self.panels.iter().cloned();
        panels
            .fold(Panels::new(columns), |p, (title, plan, _)| {
                p.panel(title, plan)
            })
            .svg()
    }

    fn html(&self, entry: &Entry, command: &str) -> String {
        let figures = self.panels.iter().cloned();
        let figures: Vec<Figure> = figures
            .map(|(title, plan, caption)| Figure::new(title, plan, caption))
            .collect();
        let columns = vec![
            Column::text("explorer"),
            Column::text("quantity"),
            Column::number("value (95 %)"),
        ];
        let table = self.numbers.iter().fold(Table::new(columns), |t, n| {
            t.row(vec![
                Cell::from(n.explorer.clone()),
                Cell::from(n.quantity.clone()),
                Cell::from(n.text()),
            ])
        });
        let columns = vec![
            Column::prose("found here"),
            Column::prose("the paper"),
            Column::text("direction"),
        ];
        let claims = self.claims.iter().fold(Table::new(columns), |t, c| {
            let (word, tone) = if c.holds {
                ("agrees", Tone::Good)
            } else {
                ("differs", Tone::Bad)
            };
            t.row(vec![
                Cell::from(c.statement.clone()),
                Cell::from(c.paper.clone()),
                Cell::toned(word, tone),
            ])
        });
        Page::new(&self.title)
            .kicker(&format!("ASID compare --figure {}", entry.name))
            .lead(self.lead.clone())
            .section(Section::new("Pictures").lead(entry.about).figures(figures))
            .section(Section::new("Numbers").table(table))
            .section(Section::new("Beside the paper").table(claims))
            .section(Section::new("Repeat it").command(command))
            .html()
    }
}

/// The task of this name.
fn task(name: &str) -> Result<Box<dyn Task>> {
    Ok((find::<TaskEntry>(name)?.make)()?)
}

/// The mean of some values as a number of the figure, with its bootstrap interval.
fn mean(explorer: &str, quantity: &str, unit: &str, values: &[f64]) -> Number {
    let n = values.len();
    Number {
        explorer: explorer.to_owned(),
        quantity: quantity.to_owned(),
        unit: unit.to_owned(),
        value: statistics::mean(values),
        interval95: statistics::bootstrap(&[values.to_vec()], statistics::mean),
        n,
    }
}

/// A share of episodes as a number of the figure, with its Wilson interval.
fn share(explorer: &str, quantity: &str, hits: usize, n: usize) -> Number {
    Number {
        explorer: explorer.to_owned(),
        quantity: quantity.to_owned(),
        unit: String::new(),
        value: hits as f64 / n.max(1) as f64,
        interval95: statistics::wilson(hits, n),
        n,
    }
}
