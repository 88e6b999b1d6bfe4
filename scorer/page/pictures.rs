//! The pictures of the page.

use asid_report::page::{Figure as Drawing, Section};
use asid_report::plot::{Axis, Chart, Colour, Layer, Ranked, Ranking, Spacing};

use super::tables::{by, table};
use crate::board::{Row, Score};
use crate::lines::{figure, percent};

pub(super) fn machines(score: &Score) -> Section {
    let rows = by(score, "machine");
    let bar = |r: &&Row| {
        let share = r.right.value().unwrap_or(f64::NAN);
        Ranked::new(&*r.name, 100.0 * share, r.right.text()).colour(Colour::Blue)
    };
    let axis = Axis::new("right", "%").domain([0.0, 100.0]);
    let drawn = Ranking::new("Share right by machine", axis).rows(rows.iter().map(bar));
    Section::new("Machines")
        .lead(
            "closed is the median share of the gap closed, of what the true effects, fitted by the scorer, close. \
             true p is the mean probability given to right sets, set the median size of the ambiguity set.",
        )
        .figures(vec![Drawing::new("Share right by machine", drawn, "Cases of one kind of machine, clean and dirty, with any cause or none.")])
        .table(table("machine", &rows))
}

pub(super) fn power(score: &Score) -> Section {
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
    let caption = "Share of cases with a right answer, and share in which anything is said to be missing, against the excess gap of \
                   the causes alone, after the study's parameters are refitted. Bars: intervals of 95 %.";
    Section::new("Power").figures(vec![Drawing::new(
        "Share right against the true excess gap",
        chart.description(caption),
        caption,
    )])
}

pub(super) fn probabilities(score: &Score) -> Section {
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
    // Leave out figures without a value.
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
