//! The page of a designed motion: what it tells, its course and its limits.

use asid_report::page::{Column, Figure, Page, Section, Table, Tile, Tone};
use asid_report::plot::{Axis, Chart, Colour, Layer};
use asid_results::view::View;
use asid_sysid::design::Designed;
use asid_sysid::limits::Limits;

use super::Subject;
use super::explore::{ExploreResult, lines, relative};
use crate::cli::result::figure;
use crate::cli::run::command_line;

/// Largest number of joints and actuators that are drawn; the files hold all.
const DRAWN: usize = 12;

/// The page.
pub fn page(
    result: &ExploreResult,
    subject: &Subject,
    found: &Designed,
    limits: &Limits,
    view: Option<&View>,
) -> String {
    let mut page = Page::new(&format!("A motion for {}", result.machine))
        .kicker("asid explore")
        .answer(lines(result).first().cloned().unwrap_or_default())
        .fact("engine", &result.engine)
        .fact("explorer", result.explorer)
        .fact("objective", result.objective)
        .fact("seed", result.seed.to_string());
    page = match &result.broken {
        None => page.badge("all limits hold", Tone::Good),
        Some(_) => page.badge("limits broken", Tone::Bad),
    };
    for u in &result.unknowns {
        let note = format!(
            "standard deviation {}, of {}",
            unit(figure(u.motion), &u.unit),
            unit(figure(u.prior), &u.unit)
        );
        page = page.tile(Tile::new(&u.name, &relative(u.motion, u.reference)).note(note));
    }
    let machine = Section::machine(
        view,
        "The motion in 3-D, as the simulator expects it. Drag to turn it. The slider moves the line in the plots below; a click in \
         a plot moves the slider.",
    );
    let page = page.section(told(result));
    let page = match machine {
        Some(machine) => page.section(machine),
        None => page,
    };
    page.section(commands(result, subject, found))
        .section(joints(result, subject, found, limits))
        .section(repeat(result))
        .html()
}

fn unit(text: String, unit: &str) -> String {
    if unit.is_empty() {
        text
    } else {
        format!("{text} {unit}")
    }
}

fn told(result: &ExploreResult) -> Section {
    let mut table = Table::new(vec![
        Column::text("unknown"),
        Column::number("value"),
        Column::number("prior"),
        Column::number("logs so far"),
        Column::number("this motion"),
        Column::number("both"),
        Column::number("plays"),
    ])
    .caption(
        "Standard deviations. Plays: of the motion, until the precision asked for is reached.",
    );
    for u in &result.unknowns {
        let maybe = |x: Option<f64>| x.map_or_else(String::new, figure);
        table = table.row(vec![
            u.name.clone().into(),
            unit(figure(u.value), &u.unit).into(),
            figure(u.prior).into(),
            maybe(u.logs).into(),
            figure(u.motion).into(),
            maybe(u.both).into(),
            u.repeats
                .map_or_else(|| "none suffices".to_owned(), |n| n.to_string())
                .into(),
        ]);
    }
    let mut section = Section::new("What it tells").table(table);
    for line in lines(result)
        .iter()
        .filter(|l| l.starts_with("stays unseen") || l.contains(": contact limits it"))
    {
        section = section.note(line.clone());
    }
    if !result.nuisance.is_empty() {
        section = section.note(format!(
            "Estimated along, and not sought: {}.",
            result.nuisance.join(", ")
        ));
    }
    for note in &result.notes {
        section = section.note(note.clone());
    }
    section
}

/// A line over the frames of a motion, the first of them after `first` periods.
fn series(period: f64, first: usize, values: impl Iterator<Item = f64>) -> Vec<[f64; 2]> {
    values
        .enumerate()
        .map(|(k, x)| [(first + k) as f64 * period, x])
        .collect()
}

/// The course of one of `nq` coordinates: `positions` are those at the ends of the frames.
fn course(positions: &[f64], (coordinate, nq): (usize, usize), period: f64) -> Vec<[f64; 2]> {
    let values = positions.iter().skip(coordinate).step_by(nq);
    series(period, 1, values.copied())
}

fn commands(result: &ExploreResult, subject: &Subject, found: &Designed) -> Section {
    let layout = &subject.plant.layout;
    let nu = layout.nu();
    let figures = layout
        .actuators
        .iter()
        .enumerate()
        .take(DRAWN)
        .map(|(a, actuator)| {
            let commands = found.commands.iter().skip(a).step_by(nu).copied();
            let points = series(result.period, 0, commands);
            let title = format!("Command of {}", actuator.name);
            let chart = Chart::new(&title, Axis::new("time", "s"), Axis::new("command", ""))
                .clock("", result.period)
                .layer(Layer::steps(points).colour(Colour::Blue));
            Figure::new(
                title,
                chart,
                "As in commands.csv, each held until the next.",
            )
        });
    Section::new("Commands").figures(figures.collect())
}

fn joints(result: &ExploreResult, subject: &Subject, found: &Designed, limits: &Limits) -> Section {
    let nq = subject.plant.layout.nq;
    let figures = limits.joints.iter().take(DRAWN).map(|joint| {
        let points = course(&found.played.qpos, (joint.qpos, nq), result.period);
        let title = format!("Position of {}", joint.name);
        let mut chart = Chart::new(
            &title,
            Axis::new("time", "s"),
            Axis::new("position", "rad or m"),
        )
        .clock("", result.period)
        .layer(Layer::line(points).colour(Colour::Blue));
        for end in joint.position.iter().flatten() {
            chart = chart.layer(Layer::horizontal(*end).colour(Colour::Muted).label("limit"));
        }
        let caption = match joint.speed {
            Some(speed) => format!("As the simulator expects it; its speed stays below {speed}."),
            None => "As the simulator expects it.".to_owned(),
        };
        Figure::new(title, chart, caption)
    });
    Section::new("The motion").figures(figures.collect())
}

fn repeat(result: &ExploreResult) -> Section {
    Section::new("Again")
        .text("commands.csv is played as it stands; the log of it, with the model's sensors as columns, joins the study.")
        .command(command_line())
        .facts(vec![
            ("physics steps".into(), result.cost.physics_steps.to_string()),
            ("time".into(), format!("{:.1} s", result.cost.wall_s)),
            ("made smaller by".into(), figure(result.scale)),
        ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: on the page a joint moved a period before its command. Cause: positions at the ends
    /// of the frames were drawn at their beginnings.
    #[test]
    fn positions_are_drawn_at_the_ends_of_their_frames() {
        // Under an acceleration of 1 m/s² a cart is at t²/2; a second joint rests at 7.
        let period = 0.1;
        let ends = (1..=20).map(|k| period * f64::from(k));
        let positions: Vec<f64> = ends.flat_map(|t| [0.5 * t * t, 7.0]).collect();
        let points = course(&positions, (0, 2), period);
        assert_eq!(points.len(), 20);
        for [t, x] in points {
            assert!((x - 0.5 * t * t).abs() < 1e-12, "{x} at {t}");
        }
        // A command begins with its frame.
        assert_eq!(series(period, 0, [4.0].into_iter())[0], [0.0, 4.0]);
    }
}
