//! The tables of the page.

use asid_report::page::{Cell, Column, Section, Table, Tone};

use crate::board::{Row, Score};
use crate::judge::Standing;

fn columns(first: &str) -> Vec<Column> {
    let mut all = vec![Column::text(first)];
    for title in [
        "cases",
        "right",
        "95 %",
        "top 2",
        "covered",
        "no answer",
        "true p",
        "set",
        "closed",
        "s",
    ] {
        all.push(Column::number(title));
    }
    all
}

fn cells(name: &str, r: &Row) -> Vec<Cell> {
    let number = |x: Option<f64>, decimals: usize| {
        x.map_or_else(|| "-".to_owned(), |x| format!("{x:.decimals$}"))
    };
    let interval = r.right.interval95.map_or_else(
        || "-".to_owned(),
        |[low, high]| format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high),
    );
    vec![
        name.into(),
        r.cases.to_string().into(),
        r.right.count.to_string().into(),
        interval.into(),
        r.top2.count.to_string().into(),
        r.covered.count.to_string().into(),
        r.unanswered.count.to_string().into(),
        number(r.true_probability.map(|p| p.value), 2).into(),
        number(r.set_size, 1).into(),
        number(r.closed.map(|c| c.value), 2).into(),
        number(r.seconds, 1).into(),
    ]
}

pub(super) fn table(first: &str, rows: &[&Row]) -> Table {
    let table = Table::new(columns(first));
    rows.iter().fold(table, |t, r| t.row(cells(&r.name, r)))
}

pub(super) fn methods(scores: &[Score]) -> Section {
    let mut all = Table::new(columns("method"));
    for score in scores {
        if let Some(r) = score.rows.first() {
            all = all.row(cells(&score.method, r));
        }
    }
    Section::new("Methods")
        .lead("Each method answers the same cases. The value of the diagnosis is its margin over the baselines.")
        .table(all)
}

pub(super) fn by<'a>(score: &'a Score, by: &str) -> Vec<&'a Row> {
    score.rows.iter().filter(|r| r.by == by).collect()
}

pub(super) fn part(score: &Score, key: &str, title: &str) -> Section {
    Section::new(title).table(table(key, &by(score, key)))
}

pub(super) fn confusion(score: &Score) -> Section {
    let mut all = Table::new(vec![
        Column::text("truth"),
        Column::number("cases"),
        Column::prose("verdicts"),
    ]);
    for (truth, row) in &score.confusion {
        let mut cells: Vec<(&String, &usize)> = row.iter().collect();
        cells.sort_by(|a, b| b.1.cmp(a.1).then(a.0.cmp(b.0)));
        let text: Vec<String> = cells
            .iter()
            .map(|(said, n)| format!("{said} {n}"))
            .collect();
        let cases: usize = row.values().sum();
        all = all.row(vec![
            truth.as_str().into(),
            cases.to_string().into(),
            text.join(", ").into(),
        ]);
    }
    Section::new("Truth and verdict")
        .lead("By names without sites. A right answer counts for the truth, however it is named.")
        .table(all)
}

pub(super) fn cases(score: &Score) -> Section {
    let columns = vec![
        Column::text("case"),
        Column::text("machine"),
        Column::text(""),
        Column::prose("truth"),
        Column::prose("verdict"),
        Column::number("p"),
        Column::number("true p"),
        Column::number("gap"),
        Column::number("closed"),
        Column::number("s"),
        Column::number("MiB"),
    ];
    let mut all = Table::new(columns);
    for c in &score.answers {
        let tone = match c.standing {
            Standing::Wrong | Standing::NoAnswer => Tone::Bad,
            Standing::Apart | Standing::NamesNothing => Tone::Fair,
            _ => Tone::Good,
        };
        let closed = c.physics.gaps.and_then(|g| g.closed_of_possible);
        let number = |x: Option<f64>, decimals: usize| {
            x.map_or_else(|| "-".to_owned(), |x| format!("{x:.decimals$}"))
        };
        all = all.row(vec![
            c.case.as_str().into(),
            c.world.as_str().into(),
            Cell::toned(c.standing.word(), tone),
            c.truth.join(" + ").into(),
            c.failure
                .clone()
                .unwrap_or_else(|| c.verdict.join(" + "))
                .into(),
            number(Some(c.probability), 2).into(),
            number(Some(c.true_probability), 2).into(),
            number(Some(c.cause_gap).filter(|g| *g > 0.0), 1).into(),
            number(closed, 2).into(),
            number(Some(c.seconds), 1).into(),
            number(c.memory_mib, 0).into(),
        ]);
    }
    for (case, why) in &score.left_out {
        all = all.row(vec![
            case.as_str().into(),
            "".into(),
            Cell::toned("left out", Tone::Fair),
            "".into(),
            why.as_str().into(),
        ]);
    }
    Section::new("Cases")
        .lead("gap is the excess gap of the causes alone, in units of the noise.")
        .table(all)
}
