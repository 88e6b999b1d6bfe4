//! The content of a figure (data, numbers, tables, claims and pictures) and its layout.

use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use asid_comparison::grid::Grid;
use asid_report::page::{Cell, Column, Figure, Page, Section, Table, Tone};
use asid_report::plot::{Panels, Plot};
use asid_statistics as statistics;
use serde::Serialize;

use super::claim::Claim;
use crate::cli::compare::page::table;
use crate::cli::result::figure as digits;

/// A number that the figure shows.
#[derive(Clone, Debug, Serialize)]
pub struct Number {
    /// Name of the explorer, method or model.
    pub explorer: String,
    /// Name of the quantity.
    pub quantity: String,
    /// Unit; empty for a pure number.
    pub unit: String,
    /// The number.
    pub value: f64,
    /// 95 % interval.
    pub interval95: [f64; 2],
    /// Episodes or runs behind it.
    pub n: usize,
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

/// A plot with its title and a caption that explains how to read it.
#[derive(Clone)]
pub struct Panel {
    title: String,
    plot: Arc<dyn Plot + Send + Sync>,
    caption: String,
}

impl Panel {
    /// A plot under a title.
    pub fn new(title: &str, plot: impl Plot + Send + Sync + 'static, caption: &str) -> Self {
        Self {
            title: title.to_owned(),
            plot: Arc::new(plot),
            caption: caption.to_owned(),
        }
    }
}

/// A figure: data, numbers, claims and pictures.
#[derive(Default)]
pub struct Drawing {
    /// Title of the page.
    pub title: String,
    /// What was played and what is shown.
    pub lead: String,
    /// Remarks, such as what was left out.
    pub notes: Vec<String>,
    /// Files of data.
    pub data: Vec<Data>,
    /// The numbers.
    pub numbers: Vec<Number>,
    /// Tables, where a figure has more than its numbers.
    pub tables: Vec<Grid>,
    /// What the paper says of it.
    pub claims: Vec<Claim>,
    /// The pictures.
    pub panels: Vec<Panel>,
}

/// The mean of values as a number of the figure, with its bootstrap interval.
pub fn mean(explorer: &str, quantity: &str, unit: &str, values: &[f64]) -> Number {
    of_values(explorer, quantity, unit, values, statistics::mean)
}

/// The median of values as a number of the figure, with its bootstrap interval.
pub fn median(explorer: &str, quantity: &str, unit: &str, values: &[f64]) -> Number {
    let statistic = |v: &[f64]| statistics::median(v.iter().copied());
    of_values(explorer, quantity, unit, values, statistic)
}

fn of_values(
    explorer: &str,
    quantity: &str,
    unit: &str,
    values: &[f64],
    statistic: impl Fn(&[f64]) -> f64,
) -> Number {
    let interval95 = if values.is_empty() {
        [f64::NAN; 2]
    } else {
        statistics::bootstrap(&[values.to_vec()], &statistic)
    };
    Number {
        explorer: explorer.to_owned(),
        quantity: quantity.to_owned(),
        unit: unit.to_owned(),
        value: statistic(values),
        interval95,
        n: values.len(),
    }
}

/// A share of episodes as a number of the figure, with its Wilson interval.
pub fn share(explorer: &str, quantity: &str, hits: usize, n: usize) -> Number {
    Number {
        explorer: explorer.to_owned(),
        quantity: quantity.to_owned(),
        unit: String::new(),
        value: hits as f64 / n.max(1) as f64,
        interval95: statistics::wilson(hits, n),
        n,
    }
}

impl Number {
    /// Value, unit and interval.
    pub fn text(&self) -> String {
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
    /// A file without rows.
    pub fn new(name: &str, columns: &[&'static str]) -> Self {
        Self {
            name: name.to_owned(),
            columns: columns.to_vec(),
            rows: Vec::new(),
        }
    }

    /// The file's text.
    pub fn csv(&self) -> Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.columns)?;
        for row in &self.rows {
            writer.write_record(row)?;
        }
        Ok(String::from_utf8(writer.into_inner()?)?)
    }
}

impl Drawing {
    /// An empty figure.
    pub fn new(title: &str, lead: String) -> Self {
        Self {
            title: title.to_owned(),
            lead,
            ..Self::default()
        }
    }

    /// Prints numbers and claims on the terminal.
    pub fn tell(&self, out: &mut impl std::io::Write, folder: &Path) -> Result<()> {
        for note in &self.notes {
            writeln!(out, "{note}")?;
        }
        for grid in &self.tables {
            writeln!(out, "{}", grid.markdown())?;
        }
        if self.tables.is_empty() {
            for n in &self.numbers {
                writeln!(out, "{}: {} {}", n.explorer, n.quantity, n.text())?;
            }
        }
        for claim in &self.claims {
            let mark = claim.verdict.mark();
            writeln!(out, "{mark}: {} (paper: {})", claim.statement, claim.paper)?;
        }
        writeln!(out, "results: {}", folder.display())?;
        Ok(())
    }

    /// The tables as Markdown; `None` where there are none.
    pub fn markdown(&self) -> Option<String> {
        let tables: Vec<String> = self.tables.iter().map(Grid::markdown).collect();
        let notes: String = self.notes.iter().map(|n| format!("> {n}\n")).collect();
        (!tables.is_empty()).then(|| [&notes, "\n", &tables.join("\n")].concat())
    }

    /// All pictures as one SVG file.
    pub fn picture(&self) -> String {
        let columns = self.panels.len().clamp(1, 3);
        let panels = self.panels.iter().cloned();
        panels
            .fold(Panels::new(columns), |p, panel| {
                p.panel(panel.title, panel.plot)
            })
            .svg()
    }

    /// The page; `about` says what the figure shows, `command` repeats it.
    pub fn html(&self, name: &str, about: &str, quick: bool, command: &str) -> String {
        let figures = self.panels.iter().cloned();
        let figures: Vec<Figure> = figures
            .map(|panel| Figure::new(panel.title, panel.plot, panel.caption))
            .collect();
        let mut page = Page::new(&self.title)
            .kicker(&format!("ASID compare --figure {name}"))
            .lead(self.lead.clone());
        if quick {
            page = page.badge("quick look", Tone::Fair);
        }
        if !self.notes.is_empty() {
            let section = Section::new("What to know");
            page = page.section(self.notes.iter().cloned().fold(section, Section::note));
        }
        let mut page = page.section(Section::new("Pictures").lead(about).figures(figures));
        for grid in &self.tables {
            page = page.section(Section::new(&grid.title).table(table(grid)));
        }
        if self.tables.is_empty() {
            page = page.section(Section::new("Numbers").table(self.table_of_numbers()));
        }
        if !self.claims.is_empty() {
            page = page.section(Section::new("Beside the paper").table(self.table_of_claims()));
        }
        page.section(Section::new("Repeat it").command(command))
            .html()
    }

    fn table_of_numbers(&self) -> Table {
        let columns = vec![
            Column::text("of"),
            Column::text("quantity"),
            Column::number("value (95 %)"),
        ];
        self.numbers.iter().fold(Table::new(columns), |t, n| {
            t.row(vec![
                Cell::from(n.explorer.clone()),
                Cell::from(n.quantity.clone()),
                Cell::from(n.text()),
            ])
        })
    }

    fn table_of_claims(&self) -> Table {
        let columns = vec![
            Column::prose("found here"),
            Column::prose("the paper"),
            Column::text("direction"),
        ];
        self.claims.iter().fold(Table::new(columns), |t, c| {
            t.row(vec![
                Cell::from(c.statement.clone()),
                Cell::from(c.paper.clone()),
                Cell::toned(c.verdict.words(), c.verdict.tone()),
            ])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_with_a_comma_is_one_cell_of_the_file() -> Result<()> {
        let mut data = Data::new("a.csv", &["explorer", "covered"]);
        data.rows.push(vec!["cem:a=1,b=2".into(), "0.5".into()]);
        assert_eq!(data.csv()?, "explorer,covered\n\"cem:a=1,b=2\",0.5\n");
        Ok(())
    }
}
