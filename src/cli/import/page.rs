//! The picture of an import: which column is what, and every column over time.

use asid_logs::propose::Proposal;
use asid_report::page::{Cell, Column, Figure, Page, Section, Table, Tone};
use asid_report::plot::{Axis, Chart, Colour, Layer};

use super::Imported;
use super::files::Files;
use super::table::cells;

/// Largest number of points in a drawn line, which keeps a page below some MB.
const DRAWN: usize = 1500;

/// The page.
pub(super) fn page(study: &Files<'_>, notes: &[String]) -> String {
    let proposal = study.proposal;
    let found = proposal
        .matches
        .iter()
        .filter(|m| m.mapping.is_some())
        .count();
    let mut page = Page::new(&format!("Logs of {}", study.subject.name))
        .kicker("asid import")
        .answer(format!(
            "{found} of {} quantities of the model have a column. Look whether they are what they should be; study.toml has what \
             can be changed.",
            proposal.matches.len()
        ))
        .fact("episodes", study.count().to_string())
        .fact("held out", study.held_out().to_string());
    if !notes.is_empty() {
        page = page.badge("see the notes", Tone::Fair);
    }
    page.section(mapping(proposal, notes))
        .section(pictures(study))
        .html()
}

fn mapping(proposal: &Proposal, notes: &[String]) -> Section {
    let mut table = Table::new(vec![
        Column::text("quantity"),
        Column::text("column"),
        Column::text("read as"),
        Column::number("Hz"),
        Column::text("values"),
    ])
    .caption("Range of the values after the conversion of units, in the unit of the model.");
    for found in &proposal.matches {
        let [column, read, rate, values, why] = cells(found);
        table = table.row(vec![
            found.name.clone().into(),
            Cell::from(column).note(why),
            read.into(),
            rate.into(),
            values.into(),
        ]);
    }
    let mut section = Section::new("Which column is what").table(table);
    for note in notes {
        section = section.note(note.clone());
    }
    for (what, columns) in [
        ("State of the first row", &proposal.start),
        ("Not used", &proposal.unused),
    ] {
        if !columns.is_empty() {
            section = section.note(format!("{what}: {}.", columns.join(", ")));
        }
    }
    section
}

/// One figure for each sensor of the first episode, with the command of its joint where that is a
/// position.
fn pictures(study: &Files<'_>) -> Section {
    let Some(first) = study.imported.first() else {
        return Section::new("Over time");
    };
    let plant = &study.subject.plant;
    let mut figures = Vec::new();
    for (sensor, reads) in plant.layout.sensors.iter().zip(&plant.sensors) {
        let Some(columns) = first.episode.channel(&sensor.name) else {
            continue;
        };
        let joint = match reads {
            asid_mjcf::plant::Reads::Joint(j) if sensor.kind == "jointpos" => Some(*j),
            _ => None,
        };
        let title = sensor.name.clone();
        let mut chart = Chart::new(
            &title,
            Axis::new("time", "s"),
            Axis::new(&title, sensor.unit()),
        );
        let servo = joint.and_then(|j| plant.drives_of(j).find(|(_, d)| d.is_position_servo()));
        if let Some((actuator, _)) = servo {
            let command = commands(first, actuator);
            chart = chart.layer(Layer::steps(command).colour(Colour::Muted).label("command"));
        }
        let colours = [
            Colour::Blue,
            Colour::Vermillion,
            Colour::Green,
            Colour::Purple,
        ];
        for (column, colour) in columns.zip(colours.into_iter().cycle()) {
            chart = chart.layer(Layer::line(readings(first, column)).colour(colour));
        }
        let caption = match servo {
            Some(_) => "As read, with what was commanded: it should follow.",
            None => "As read.",
        };
        figures.push(Figure::new(title, chart, caption));
    }
    for (a, actuator) in plant.layout.actuators.iter().enumerate() {
        if plant.drives[a].is_some_and(|d| d.is_position_servo()) {
            continue;
        }
        let title = format!("Command of {}", actuator.name);
        let chart = Chart::new(&title, Axis::new("time", "s"), Axis::new("command", ""))
            .layer(Layer::steps(commands(first, a)).colour(Colour::Blue));
        figures.push(Figure::new(
            title,
            chart,
            "As sent, each held until the next.",
        ));
    }
    Section::new("Over time")
        .lead(format!("The episode {}.", first.raw.name))
        .figures(figures)
}

/// Every n-th point, so that a line has no more than [`DRAWN`] points.
fn thinned(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let every = points.len().div_ceil(DRAWN).max(1);
    points.into_iter().step_by(every).collect()
}

fn commands(one: &Imported, actuator: usize) -> Vec<[f64; 2]> {
    let nu = one.episode.actuators.len();
    let values = one.episode.ctrl.iter().skip(actuator).step_by(nu.max(1));
    thinned(
        one.episode
            .time
            .iter()
            .zip(values)
            .map(|(t, x)| [*t, *x])
            .collect(),
    )
}

fn readings(one: &Imported, column: usize) -> Vec<[f64; 2]> {
    let width = one.episode.width();
    let values = one
        .episode
        .readings
        .iter()
        .skip(column)
        .step_by(width.max(1));
    let points = one.episode.time.iter().zip(values);
    thinned(
        points
            .map(|(t, x)| [*t, *x])
            .filter(|p| p[1].is_finite())
            .collect(),
    )
}
