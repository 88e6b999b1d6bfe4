//! The scoreboard as a page.

use asid_report::page::{Cell, Column, Figure as Drawing, Page, Section, Table, Tile, Tone};
use asid_report::plot::{Axis, Chart, Colour, Layer, Ranked, Ranking, Spacing};

use crate::board::{Row, Score};
use crate::judge::Standing;
use crate::lines::{figure, percent};

/// What the page tells besides the scores.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// The call.
    pub command: String,
    /// Name and version of the engine.
    pub engine: String,
    /// What a control has to show, where the check was spoilt on purpose.
    pub control: Option<&'static str>,
    /// Time that each case was given, s.
    pub limit: Option<f64>,
}

/// The page of some scores on one set of cases, the first one's in full.
#[must_use]
pub fn page(scores: &[Score], about: &About) -> String {
    let Some(score) = scores.first() else {
        return Page::new("Withheld causes").html();
    };
    let mut page = Page::new("Withheld causes")
        .kicker("asid withheld")
        .answer(answer(score))
        .fact("engine", &*about.engine)
        .fact("cases", score.cases.to_string())
        .fact(
            "limit",
            about
                .limit
                .map_or_else(|| "none".into(), |l| format!("{l} s a case")),
        );
    if let Some(control) = about.control {
        page = page.lead(format!("A control, which must fail: {control}."));
    }
    page = tiles(page, score);
    if scores.len() > 1 {
        page = page.section(methods(scores));
    }
    page = page.section(machines(score));
    if !score.power.is_empty() {
        page = page.section(power(score));
    }
    page = page.section(probabilities(score)).section(confusion(score));
    for (by, title) in [
        ("world", "Clean and dirty worlds"),
        ("cause", "Causes"),
        ("magnitude", "Magnitudes"),
        ("fault", "Faults of logs and wiring"),
    ] {
        if score.rows.iter().any(|r| r.by == by) {
            page = page.section(part(score, by, title));
        }
    }
    page.section(cases(score))
        .section(Section::new("Again").command(&*about.command))
        .html()
}

fn answer(score: &Score) -> String {
    let interval = score
        .rows
        .first()
        .map_or_else(String::new, |r| percent(&r.right));
    format!(
        "{} of {} cases are right: {interval}.",
        score.right, score.cases
    )
}

fn tiles(page: Page, s: &Score) -> Page {
    let mut page = page;
    let log = s
        .log_score
        .map_or_else(|| "-".into(), |l| format!("{:.2}", l.value));
    let closed = s.rows.first().and_then(|r| r.closed);
    for (label, value, note) in [
        (
            "among the two most probable",
            s.top2.to_string(),
            format!("of {}", s.cases),
        ),
        (
            "in the ambiguity set",
            s.covered.to_string(),
            format!("of {}", s.cases),
        ),
        (
            "false alarms, clean worlds",
            s.clean_alarms.effect.text(),
            format!("{} more say unknown", s.clean_alarms.unknown.count),
        ),
        (
            "false alarms, dirty worlds",
            s.dirty_alarms.effect.text(),
            format!("{} say unknown, counted apart", s.dirty_alarms.apart.count),
        ),
        ("unknowns found", s.unknowns.text(), String::new()),
        (
            "log score",
            log,
            format!("base rate {:.2}", s.base_log_score),
        ),
        (
            "closed of the possible",
            closed.map_or_else(|| "-".into(), |c| format!("{:.0} %", 100.0 * c.value)),
            "median".into(),
        ),
        (
            "slowest case",
            format!("{:.0} s", s.slowest),
            s.largest_memory_mib
                .map_or_else(String::new, |m| format!("at most {m:.0} MiB")),
        ),
    ] {
        page = page.tile(Tile::new(label, &value).note(note));
    }
    page
}

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
        r.right.of.to_string().into(),
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

fn table(first: &str, rows: &[&Row]) -> Table {
    let table = Table::new(columns(first));
    rows.iter().fold(table, |t, r| t.row(cells(&r.name, r)))
}

fn methods(scores: &[Score]) -> Section {
    let mut all = Table::new(columns("method"));
    for score in scores {
        if let Some(r) = score.rows.first() {
            all = all.row(cells(&score.method, r));
        }
    }
    Section::new("Methods")
        .lead("The same cases, answered by baselines: what the diagnosis is worth is what it is better than these.")
        .table(all)
}

fn by<'a>(score: &'a Score, by: &str) -> Vec<&'a Row> {
    score.rows.iter().filter(|r| r.by == by).collect()
}

fn machines(score: &Score) -> Section {
    let rows = by(score, "machine");
    let bar = |r: &&Row| {
        let share = r.right.value().unwrap_or(f64::NAN);
        Ranked::new(&*r.name, 100.0 * share, r.right.text()).colour(Colour::Blue)
    };
    let axis = Axis::new("right", "%").domain([0.0, 100.0]);
    let drawn = Ranking::new("Share right by machine", axis).rows(rows.iter().map(bar));
    Section::new("Machines")
        .lead(
            "`closed` is the median share of the gap closed, of what the true effects, fitted by the scorer, close. \
             `true p` is the mean probability given to right sets, `set` the median size of the ambiguity set.",
        )
        .figures(vec![Drawing::new("Share right by machine", drawn, "Cases of one kind of machine, clean and dirty, with any cause or none.")])
        .table(table("machine", &rows))
}

fn part(score: &Score, key: &str, title: &str) -> Section {
    Section::new(title).table(table(key, &by(score, key)))
}

fn power(score: &Score) -> Section {
    let layers = [("right", Colour::Blue, 0), ("noticed", Colour::Muted, 1)];
    let axis = Axis::new("excess gap of the causes", "noise").spacing(Spacing::Log);
    let mut chart = Chart::new("Power", axis, Axis::new("cases", "%").domain([0.0, 100.0]));
    for (label, colour, which) in layers {
        let share = |p: &crate::board::Power| if which == 0 { p.right } else { p.noticed };
        let points = score
            .power
            .iter()
            .map(|p| [p.mean_gap, 100.0 * share(p).value().unwrap_or(f64::NAN)]);
        let points: Vec<[f64; 2]> = points.collect();
        if which == 0 {
            let whiskers = score.power.iter().map(|p| {
                let [low, high] = share(p).interval95.unwrap_or([f64::NAN; 2]);
                [p.mean_gap, 100.0 * low, 100.0 * high]
            });
            chart = chart.layer(Layer::whiskers(whiskers.collect()).colour(colour));
        }
        chart = chart
            .layer(Layer::dots(points.clone()).colour(colour))
            .layer(Layer::line(points).colour(colour).label(label));
    }
    let caption = "How often the answer is right, and how often anything is said to be missing, by how far the world \
                   with its causes is from its model after the study's parameters are fitted. Bars: 95 %.";
    Section::new("Power").figures(vec![Drawing::new(
        "Share right against the true excess gap",
        chart.description(caption),
        caption,
    )])
}

fn probabilities(score: &Score) -> Section {
    let c = &score.calibration;
    let dots = c
        .bins
        .iter()
        .map(|b| [b.stated, b.true_share.value().unwrap_or(f64::NAN)]);
    let whiskers = c.bins.iter().map(|b| {
        let [low, high] = b.true_share.interval95.unwrap_or([f64::NAN; 2]);
        [b.stated, low, high]
    });
    let unit = |name: &str| Axis::new(name, "").domain([0.0, 1.0]);
    let chart = Chart::new(
        "Calibration",
        unit("stated probability"),
        unit("share that came true"),
    )
    .layer(
        Layer::line(vec![[0.0, 0.0], [1.0, 1.0]])
            .colour(Colour::Muted)
            .dashed(),
    )
    .layer(Layer::whiskers(whiskers.collect()).colour(Colour::Blue))
    .layer(Layer::dots(dots.collect()).colour(Colour::Blue));
    let caption = "The event is that everything is so that the verdict claims. On the dashed line answers are calibrated.";
    let facts = vec![
        ("calibration error".to_owned(), format!("{:.3}", c.error)),
        (
            "of a calibrated answer".to_owned(),
            format!(
                "{:.3}, at most {:.3} in 19 of 20",
                c.error_of_chance, c.error_of_chance95
            ),
        ),
        (
            "log score".to_owned(),
            figure(score.log_score.as_ref(), 1.0, 2),
        ),
        (
            "log score of the base rate".to_owned(),
            format!("{:.2}", score.base_log_score),
        ),
        (
            "Brier score".to_owned(),
            figure(score.brier.as_ref(), 1.0, 3),
        ),
        (
            "F1 of columns".to_owned(),
            figure(score.localization_signals.as_ref(), 1.0, 2),
        ),
        (
            "F1 of columns and regimes".to_owned(),
            figure(score.localization_regimes.as_ref(), 1.0, 2),
        ),
        (
            "effect values".to_owned(),
            format!(
                "median error {} %, covered {}",
                figure(score.effect_values.error.as_ref(), 100.0, 1),
                percent(&score.effect_values.covered)
            ),
        ),
        (
            "the study's parameters".to_owned(),
            format!(
                "median error {} %, covered {}",
                figure(score.parameters.error.as_ref(), 100.0, 2),
                percent(&score.parameters.covered)
            ),
        ),
        (
            "wiring faults".to_owned(),
            format!(
                "found {}, named where there is none {}",
                score.wiring.found.text(),
                score.wiring.false_alarms.text()
            ),
        ),
    ];
    // A figure of nothing is left out.
    let facts = facts
        .into_iter()
        .filter(|(_, value)| value != "-" && !value.contains("- %"));
    Section::new("Probabilities and values")
        .figures(vec![Drawing::new(
            "Stated and true",
            chart.description(caption),
            caption,
        )])
        .facts(facts.collect())
}

fn confusion(score: &Score) -> Section {
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

fn cases(score: &Score) -> Section {
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
            Standing::Apart => Tone::Fair,
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
        .lead("`gap` is the excess gap of the causes alone, in units of the noise.")
        .table(all)
}
