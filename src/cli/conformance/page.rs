//! The HTML page of a conformance table.

use asid_conformance::{FAMILIES, Outcome, Row, checks};
use asid_report::page::{Cell, Column, Page, Section, Table, Tone};
use asid_results::naming::{count as counted, joined};

use super::cell::{cell, limit};
use super::result::{ConformanceResult, Count, Engine};

/// The page: each engine in a sentence, then failures, then the families of checks.
pub fn html(result: &ConformanceResult, command: &str) -> String {
    let total = Count::of(result.rows.iter());
    let (badge, tone) = match (total.fail, total.known_deviation) {
        (0, 0) => ("none fails".to_owned(), Tone::Good),
        (0, _) => ("none fails beyond what is known".to_owned(), Tone::Good),
        (n, _) => (format!("{n} fail"), Tone::Bad),
    };
    let asked = result.rows.len() / result.engines.len().max(1);
    let mut page = Page::new("Are the engines right?")
        .kicker("ASID conformance")
        .badge(&badge, tone)
        .lead(format!(
            "{asked} checks of {}, against closed-form theory and against the contract of a backend.",
            engines(result)
        ));
    for engine in &result.engines {
        page = page.fact(
            &format!("{} {}", engine.name, engine.version),
            verdict(engine),
        );
    }
    page = page.section(overview(result));
    for section in [
        listed(result, Outcome::Fail, "What fails", "Not within tolerance, or an error where there should be none."),
        listed(
            result,
            Outcome::KnownDeviation,
            "Known deviations",
            "Beyond the tolerance and within what the table of deviations accepts, with the reason that is inherent in the engine.",
        ),
    ]
    .into_iter()
    .flatten()
    {
        page = page.section(section);
    }
    let mut explain = true;
    for (family, about) in FAMILIES {
        if let Some(table) = family_table(result, family, explain) {
            page = page.section(Section::new(&title(family)).lead(*about).table(table));
            explain = false;
        }
    }
    if result.engines.iter().any(|e| e.count.not_claimed > 0) {
        page = page.section(not_claimed(result));
    }
    let origins = (result.engines.iter())
        .map(|e| {
            (
                e.name.clone(),
                format!("version {}, {}", e.version, e.origin),
            )
        })
        .collect();
    page.section(
        Section::new("Engines")
            .lead("Where each comes from.")
            .facts(origins),
    )
    .section(Section::new("Repeat it").command(command))
    .footer(format!(
        "asid {} ({})",
        result.versions.asid, result.versions.git
    ))
    .html()
}

/// The engines of a result, by name.
fn engines(result: &ConformanceResult) -> String {
    let names: Vec<&str> = result.engines.iter().map(|e| &*e.name).collect();
    if names.is_empty() {
        return "no engine".into();
    }
    joined(&names, "and")
}

/// An engine in one sentence.
fn verdict(engine: &Engine) -> String {
    let count = engine.count;
    let asked = count.pass + count.fail + count.known_deviation;
    let mut parts = vec![match count.fail {
        0 if count.known_deviation == 0 => {
            format!("Passes all {asked} checks of what it claims")
        }
        0 => format!("Passes {} of {asked} checks of what it claims", count.pass),
        n => format!("Fails {n} of {asked} checks of what it claims"),
    }];
    if count.known_deviation > 0 {
        parts.push(counted(count.known_deviation, "known deviation"));
    }
    if count.not_claimed > 0 {
        let plural = if count.not_claimed == 1 { "is" } else { "are" };
        parts.push(format!(
            "{} {plural} not asked, as it does not claim what they need or refuses it",
            count.not_claimed
        ));
    }
    parts.join("; ") + "."
}

fn title(family: &str) -> String {
    let mut letters = family.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}

/// How many checks of each family each engine passes.
fn overview(result: &ConformanceResult) -> Section {
    let mut columns = vec![Column::text("family")];
    columns.extend(result.engines.iter().map(|e| Column::text(&e.name)));
    let mut table = Table::new(columns);
    for (family, _) in FAMILIES {
        let cells: Vec<Cell> = (result.engines.iter())
            .map(|engine| {
                let rows = result.rows.iter();
                tally(Count::of(rows.filter(|row| {
                    row.family() == *family && row.engine == engine.name
                })))
            })
            .collect();
        let asked = result.rows.iter().any(|row| row.family() == *family);
        if asked {
            let mut row = vec![Cell::from(title(family))];
            row.extend(cells);
            table = table.row(row);
        }
    }
    Section::new("At a glance")
        .lead("Checks passed, of those that an engine's claims ask for.")
        .table(table)
}

fn tally(count: Count) -> Cell {
    let asked = count.pass + count.fail + count.known_deviation;
    let text = format!("{} of {asked}", count.pass);
    match (asked, count.fail, count.known_deviation) {
        (0, _, _) => Cell::from("").note("not claimed"),
        (_, 0, 0) => Cell::toned(text, Tone::Good),
        (_, 0, known) => Cell::toned(text, Tone::Fair).note(format!("{known} known deviations")),
        (_, fail, _) => Cell::toned(text, Tone::Bad).note(format!("{fail} fail")),
    }
}

/// The checks of a family: one row a check, one column an engine.
fn family_table(result: &ConformanceResult, family: &str, explain: bool) -> Option<Table> {
    let of = |check: &str, engine: &str| {
        let mut rows = result.rows.iter();
        rows.find(|row| row.check == check && row.engine == engine)
    };
    let mut columns = vec![Column::prose("check, and where its tolerance comes from")];
    columns.push(Column::number("tolerance"));
    columns.extend(result.engines.iter().map(|e| Column::number(&e.name)));
    let mut table = Table::new(columns);
    let mut any = false;
    for check in checks().filter(|check| check.family() == family) {
        let cells: Vec<Option<&Row>> = (result.engines.iter())
            .map(|engine| of(check.name, &engine.name))
            .collect();
        let Some(some) = cells.iter().flatten().next() else {
            continue;
        };
        any = true;
        let name = check
            .name
            .split_once('/')
            .map_or(check.name, |(_, name)| name);
        // Engines of different precision have different tolerances.
        let mut limits: Vec<String> = cells.iter().flatten().map(|row| limit(row)).collect();
        let first = limits.first().cloned();
        limits.retain(|limit| Some(limit) != first.as_ref());
        limits.dedup();
        let mut tolerance = Cell::from(first.unwrap_or_default());
        if !limits.is_empty() {
            tolerance = tolerance.note(limits.join(", "));
        }
        let mut row = vec![
            Cell::from(name.replace('-', " "))
                .note(&*some.reason)
                .hint(check.name),
            tolerance,
        ];
        row.extend(cells.into_iter().map(cell));
        table = table.row(row);
    }
    if explain {
        table = table.caption(
            "A figure is a deviation, zero at best. Its bar is on a logarithmic scale that ends at ten times the tolerance, \
             with a tick at the tolerance; a ring is less than a millionth of it. Where engines differ in precision, that of the first engine comes first and those that differ follow: single precision has the larger.",
        );
    }
    any.then_some(table)
}

/// The rows of one outcome, with the details of each.
fn listed(
    result: &ConformanceResult,
    outcome: Outcome,
    title: &str,
    lead: &str,
) -> Option<Section> {
    let rows: Vec<&Row> = (result.rows.iter())
        .filter(|row| row.outcome == outcome)
        .collect();
    if rows.is_empty() {
        return None;
    }
    let mut table = Table::new(vec![
        Column::text("check"),
        Column::text("engine"),
        Column::number("figure"),
        Column::number("tolerance"),
        Column::prose("what is said"),
    ]);
    for row in rows {
        let said = if row.note.is_empty() {
            &row.reason
        } else {
            &row.note
        };
        table = table.row(vec![
            Cell::from(row.check.clone()),
            Cell::from(row.engine.clone()),
            cell(Some(row)),
            Cell::from(limit(row)),
            Cell::from(said.clone()),
        ]);
    }
    Some(Section::new(title).lead(lead).table(table))
}

/// The capabilities that each engine does not claim, and the checks that are skipped for it.
fn not_claimed(result: &ConformanceResult) -> Section {
    let mut table = Table::new(vec![
        Column::text("engine"),
        Column::prose("does not claim"),
        Column::prose("so these are not asked"),
    ]);
    for engine in result.engines.iter().filter(|e| e.count.not_claimed > 0) {
        let lacks = |name: &&str| name.to_lowercase().replace('_', " ");
        let names: Vec<String> = engine.lacks.iter().map(lacks).collect();
        let mut families: Vec<(&str, usize)> = Vec::new();
        for row in result.rows.iter() {
            if row.engine != engine.name || row.outcome != Outcome::NotClaimed {
                continue;
            }
            match families
                .iter_mut()
                .find(|(family, _)| *family == row.family())
            {
                Some((_, count)) => *count += 1,
                None => families.push((row.family(), 1)),
            }
        }
        let counts: Vec<String> = (families.iter())
            .map(|(family, count)| format!("{count} of {family}"))
            .collect();
        table = table.row(vec![
            Cell::from(engine.name.clone()),
            Cell::from(names.join(", ")),
            Cell::from(counts.join(", ")),
        ]);
    }
    Section::new("Not claimed")
        .lead(
            "An engine is checked on what it claims. What it does not claim it may refuse; what it takes all the same must be right.",
        )
        .table(table)
}
