//! How explorers are shown side by side: table, pictures and claims.

use asid_comparison::grid::{Entry, Grid};
use asid_comparison::rows::FEWEST;
use asid_report::plot::{Axis, Chart, Colour, Layer, Ranked, Ranking, Spacing};

use super::super::{Claim, Number, Panel, median};
use super::Row;

/// Range of the median ratio of expected to actual deviation that counts as calibrated.
const CALIBRATED: [f64; 2] = [0.7, 1.4];

/// Deviations below this share of the prior's are drawn at this value.
const FLOOR: f64 = 1e-4;

/// The table.
pub fn table(rows: &[Row]) -> Grid {
    let caption = "Medians over episodes with 95 % bootstrap intervals, in deviations of the prior; the narrowest \
                   posterior of a task's unknown first, in bold where its interval is apart from the next one's. \
                   Ratio: expected over actual deviation. Contact: mean share of control steps.";
    let mut grid = Grid::new("What episodes tell", caption)
        .text("unknown")
        .text("explorer")
        .number("n")
        .number("posterior")
        .number("expected")
        .number("ratio")
        .number("error")
        .number("contact");
    let cell = |n: &Number| {
        let [low, high] = n.interval95;
        format!("{} ({} to {})", short(n.value), short(low), short(high))
    };
    for (i, row) in rows.iter().enumerate() {
        let mate = |other: &&Row| (&other.task, &other.unknown) == (&row.task, &row.unknown);
        let first = i == 0 || !mate(&&rows[i - 1]);
        let next = rows.get(i + 1).filter(mate);
        let apart = |n: &Row| row.actual.interval95[1] < n.actual.interval95[0];
        let best = first && row.pairs.len() >= FEWEST && next.is_some_and(apart);
        grid.rows.push(vec![
            format!("{}: {}", row.task, row.unknown).into(),
            (&*row.explorer).into(),
            row.pairs.len().to_string().into(),
            Entry {
                text: cell(&row.actual),
                best,
            },
            cell(&row.expected).into(),
            cell(&row.ratio).into(),
            cell(&row.error).into(),
            format!("{:.0} %", 100.0 * row.contact.value).into(),
        ]);
    }
    grid
}

/// A number with two significant figures, for values of about 1 or less.
fn short(x: f64) -> String {
    match x.abs() {
        a if a >= 10.0 || a.is_nan() => format!("{x:.0}"),
        a if a >= 1.0 => format!("{x:.1}"),
        a if a >= 0.095 => format!("{x:.2}"),
        _ => format!("{x:.3}"),
    }
}

/// Kinds of explorers with their colours.
const KINDS: [(&str, Colour); 3] = [
    ("random", Colour::Muted),
    ("Fisher", Colour::Blue),
    ("others", Colour::Vermillion),
];

fn kind(explorer: &str) -> (&'static str, Colour) {
    match explorer {
        e if e.starts_with("random") => KINDS[0],
        e if e.starts_with("fisher") => KINDS[1],
        _ => KINDS[2],
    }
}

/// Posterior deviations of one unknown for each explorer, as bars.
pub fn ranking(of: &[&Row]) -> Panel {
    let [task, unknown] = [&of[0].task, &of[0].unknown];
    let title = format!("{task}: {unknown}");
    let lowest = lowest(of);
    let axis = Axis::new("posterior over prior deviation", "")
        .spacing(Spacing::Log)
        .domain([lowest, 1.15]);
    let bars = of.iter().map(|row| {
        let [low, high] = row.actual.interval95;
        let text = format!(
            "{} ({} to {})",
            short(row.actual.value),
            short(low),
            short(high)
        );
        Ranked::new(&*row.explorer, row.actual.value, text).colour(kind(&row.explorer).1)
    });
    let plot = Ranking::new(&title, axis).base(lowest).rows(bars);
    Panel::new(
        &title,
        plot,
        "Median over episodes with its 95 % interval; short: much was learned.",
    )
}

/// Expected against actual deviations of one unknown, over all episodes.
pub fn against(of: &[&Row]) -> Panel {
    let title = format!("{}: {}, expected against actual", of[0].task, of[0].unknown);
    let axis = |label: &str| {
        Axis::new(label, "")
            .spacing(Spacing::Log)
            .domain([lowest(of), 2.0])
    };
    let chart = Chart::new(&title, axis("actual deviation"), axis("expected deviation"));
    let (low, high) = (lowest(of), 2.0);
    let chart = chart.layer(
        Layer::line(vec![[low, low], [high, high]])
            .colour(Colour::Muted)
            .dashed()
            .label("as expected"),
    );
    let chart = KINDS.iter().fold(chart, |chart, kind| {
        let own = of.iter().filter(|r| self::kind(&r.explorer) == *kind);
        let dots: Vec<[f64; 2]> = own
            .flat_map(|r| &r.pairs)
            .filter(|p| p.iter().all(|x| x.is_finite()))
            .map(|[expected, actual]| [actual.max(FLOOR), expected.max(FLOOR)])
            .collect();
        if dots.is_empty() {
            return chart;
        }
        let (label, colour) = *kind;
        let layer = Layer::dots(dots).colour(colour).opacity(0.6);
        chart.layer(layer.label(label))
    });
    Panel::new(
        &title,
        chart,
        "A dot an episode, in deviations of the prior.",
    )
}

/// Lower end of the axes: a little below the smallest value.
fn lowest(of: &[&Row]) -> f64 {
    let all = of.iter().flat_map(|r| &r.pairs).flatten();
    let seen = all.copied().filter(|x| x.is_finite());
    0.7 * seen.fold(1.0, f64::min).max(FLOOR)
}

/// Claims: Fisher exploration tells more than random actions, and the expected deviations match the
/// actual ones.
pub fn claims(rows: &[Row]) -> Vec<Claim> {
    let mut claims = Vec::new();
    let mut groups: Vec<(&str, &str)> = Vec::new();
    for row in rows.iter().filter(|r| !r.binary) {
        if !groups.contains(&(&row.task, &row.unknown)) {
            groups.push((&row.task, &row.unknown));
        }
    }
    for (task, unknown) in groups {
        let of = || {
            rows.iter()
                .filter(|r| (&*r.task, &*r.unknown) == (task, unknown))
        };
        let best = of().find(|r| r.explorer.starts_with("fisher"));
        let random = of().find(|r| r.explorer == "random");
        if let (Some(fisher), Some(random)) = (best, random) {
            claims.push(Claim::new(
                format!(
                    "{task}, {unknown}: {} leaves {} of the prior's deviation, random actions {}",
                    fisher.explorer,
                    short(fisher.actual.value),
                    short(random.actual.value)
                ),
                "Fisher exploration tells more than random actions (table 1)",
                [fisher.actual.n, random.actual.n],
                fisher.actual.interval95[1] < random.actual.interval95[0],
            ));
        }
        let ratios: Vec<f64> = of()
            .flat_map(|r| &r.pairs)
            .map(|[expected, actual]| expected / actual)
            .filter(|x| x.is_finite())
            .collect();
        let ratio = median("all", "", "", &ratios);
        let [low, high] = CALIBRATED;
        claims.push(Claim::new(
            format!(
                "{task}, {unknown}: expected over actual deviation {} in the median over {} episodes",
                short(ratio.value),
                ratio.n
            ),
            format!("says nothing of it; {low} to {high} is asked for here"),
            // All explorers meet the same truths, so episodes are counted once.
            of().map(|r| r.ratio.n),
            (low..=high).contains(&ratio.value),
        ));
    }
    claims
}
