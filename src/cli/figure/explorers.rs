//! Explorers ranked by what their episodes tell: the posterior deviation after identification, the
//! error of its mean, and the deviation that was expected of the episode.
//!
//! All are in units of the prior's deviation, so that unknowns of any unit are comparable.

mod shown;

use crate::pipeline::{episode_information_as, simulated_in};
use anyhow::Result;
use asid_algorithms::fisher::FisherSettings;
use asid_algorithms::identify::expected::ExpectedSettings;
use asid_core::registry::{ExplorerEntry, IdentifierEntry, find};
use asid_core::{Model, RealWorld as _};

use super::episodes::{each, open};
use super::variant::Labels;
use super::wanted::{Wanted, of_each, playable};
use super::{Data, Drawing, Number, Request, mean, median};
use shown::{against, claims, ranking, table};

/// Tasks that are shown where none are named: those of the paper's table 1 with one unknown.
const TASKS: [&str; 2] = ["rod-balancing", "sphere-striking"];

/// Every objective in both forms, and the other explorers.
const OWN: [&str; 11] = [
    "random",
    "fisher-cem:fisher.objective=trace+fisher.form=one-step",
    "fisher-cem:fisher.objective=a-optimal+fisher.form=one-step",
    "fisher-cem:fisher.objective=d-optimal+fisher.form=one-step",
    "fisher-cem:fisher.objective=trace+fisher.form=trajectory",
    "fisher-cem:fisher.objective=a-optimal+fisher.form=trajectory",
    "fisher-cem:fisher.objective=d-optimal+fisher.form=trajectory",
    "fisher-ppo",
    "maxmi",
    "max",
    "task-ppo",
];

/// Episodes of an explorer on a task.
const EPISODES: u64 = 30;

/// What an episode told of one unknown, in prior deviations.
#[derive(Clone, Debug)]
struct Told {
    unknown: String,
    /// Whether it is binary; its expected deviation does not follow from slopes.
    binary: bool,
    truth: f64,
    estimate: f64,
    expected: f64,
    actual: f64,
    error: f64,
}

/// An episode with what it told.
struct Episode {
    wanted: Wanted,
    contact: f64,
    residual: f64,
    told: Vec<Told>,
}

/// What the episodes of an explorer told of one unknown.
struct Row {
    task: String,
    unknown: String,
    binary: bool,
    explorer: String,
    contact: Number,
    expected: Number,
    actual: Number,
    error: Number,
    ratio: Number,
    /// Expected and actual deviation of each episode.
    pairs: Vec<[f64; 2]>,
}

pub fn draw(request: &Request<'_>) -> Result<Drawing> {
    let mut tasks: Vec<&str> = Vec::new();
    for task in request.tasks.iter().map(String::as_str) {
        if !tasks.contains(&task) {
            tasks.push(task);
        }
    }
    if tasks.is_empty() {
        tasks.extend(TASKS);
    }
    let labels = Labels::of(&request.explorers(&OWN));
    let count = request.episodes(3, EPISODES);
    let (mut notes, mut wanted) = (Vec::new(), Vec::new());
    for &task in &tasks {
        let (explorers, left_out) = playable(request, task, &OWN)?;
        notes.extend(left_out);
        wanted.extend(of_each(task, &explorers, &[], request.seed(), count));
    }
    let episodes = each(&request.common, wanted, |wanted| told(request, wanted))?;
    let rows = rows(&tasks, &episodes, &labels);
    let mut drawing = Drawing {
        notes,
        data: vec![data(&episodes, &labels)],
        tables: vec![table(&rows)],
        claims: claims(&rows),
        ..Drawing::new(
            "What episodes of explorers tell",
            format!(
                "{count} exploration episodes of each explorer, at truths drawn from the prior, each identified. \
                 Deviations and errors are shares of the prior's deviation: 1 is nothing learned. All explorers meet \
                 the same truths, starts and noise."
            ),
        )
    };
    let mut groups: Vec<[&str; 2]> = Vec::new();
    for row in &rows {
        let group = [&*row.task, &*row.unknown];
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    for group in groups {
        let of: Vec<&Row> = rows
            .iter()
            .filter(|r| [&*r.task, &*r.unknown] == group)
            .collect();
        drawing.panels.extend([ranking(&of), against(&of)]);
    }
    for row in rows {
        let own = [row.expected, row.actual, row.error, row.ratio, row.contact];
        drawing.numbers.extend(own);
    }
    Ok(drawing)
}

/// Plays an episode, identifies from it, and computes what was expected of it.
fn told(request: &Request<'_>, wanted: &Wanted) -> Result<Episode> {
    let session = open(&request.common, wanted, request.quick)?;
    let config = &session.config;
    let explorer = (find::<ExplorerEntry>(&config.explorer.name)?.make)(&config.explorer.settings)?;
    let identifier =
        (find::<IdentifierEntry>(&config.identifier.name)?.make)(&config.identifier.settings)?;
    let problem = session.problem();
    let truth = session.truth();
    let mut policy = explorer.explore(&problem, None)?.policy;
    let real = session.world(&truth)?.explore(&mut *policy)?;
    let ensemble = session.ensemble_if(identifier.assumes().scatter)?;
    let models = ensemble.as_ref().map(|e| e as &dyn Model);
    let episodes = std::slice::from_ref(&real.episode);
    let found = identifier.identify(&simulated_in(&problem, models), episodes)?;
    // The same settings as in a run.
    let expected = ExpectedSettings {
        assumes: identifier.assumes(),
        ..config.expected.settings()
    };
    let information = episode_information_as(
        &problem,
        models,
        &FisherSettings::default(),
        &expected,
        &found.posterior.mean(),
        &found.starts[0],
        &real.actions,
    )?;
    let expected = information.expected_std.last();
    let marginals = found.posterior.marginals.iter().zip(&session.parameters);
    let told = marginals
        .zip(&truth)
        .enumerate()
        .map(|(i, ((m, p), &truth))| {
            let unit = p.unscale_std(m.estimate, 1.0);
            Told {
                unknown: p.name.clone(),
                binary: p.is_binary(),
                truth,
                estimate: m.estimate,
                expected: expected
                    .and_then(|e| e.get(i))
                    .map_or(f64::NAN, |e| e / unit),
                actual: m.std / unit,
                error: (p.to_scaled(m.estimate) - p.to_scaled(truth)).abs(),
            }
        });
    Ok(Episode {
        told: told.collect(),
        contact: real.contact_fraction,
        residual: found.residual,
        wanted: wanted.clone(),
    })
}

/// Rows by task and unknown, the explorer with the narrowest posterior first.
fn rows(tasks: &[&str], episodes: &[Episode], labels: &Labels) -> Vec<Row> {
    let mut rows = Vec::new();
    for &task in tasks {
        let here = || episodes.iter().filter(|e| e.wanted.task == task);
        let mut explorers: Vec<&str> = Vec::new();
        for episode in here() {
            if !explorers.contains(&&*episode.wanted.explorer) {
                explorers.push(&episode.wanted.explorer);
            }
        }
        let unknowns = here().next().map_or(0, |e| e.told.len());
        for i in 0..unknowns {
            let of = |explorer: &str| {
                let own = here().filter(|e| e.wanted.explorer == explorer);
                row(task, labels.get(explorer), i, &own.collect::<Vec<_>>())
            };
            let mut group: Vec<Row> = explorers.iter().map(|e| of(e)).collect();
            group.sort_by(|a, b| a.actual.value.total_cmp(&b.actual.value));
            rows.append(&mut group);
        }
    }
    rows
}

fn row(task: &str, explorer: String, i: usize, of: &[&Episode]) -> Row {
    let told: Vec<&Told> = of.iter().map(|e| &e.told[i]).collect();
    let unknown = told[0].unknown.clone();
    let number = |quantity: &str, value: &dyn Fn(&Told) -> f64| {
        let values: Vec<f64> = told
            .iter()
            .map(|t| value(t))
            .filter(|x| x.is_finite())
            .collect();
        median(
            &explorer,
            &format!("{task}, {unknown}: {quantity}"),
            "",
            &values,
        )
    };
    let contact: Vec<f64> = of.iter().map(|e| e.contact).collect();
    Row {
        task: task.to_owned(),
        binary: told[0].binary,
        contact: mean(
            &explorer,
            &format!("{task}: share of steps with contact"),
            "",
            &contact,
        ),
        expected: number("expected deviation", &|t| t.expected),
        actual: number("deviation of the posterior", &|t| t.actual),
        error: number("distance of the estimate from the truth", &|t| t.error),
        ratio: number("expected over actual deviation", &|t| t.expected / t.actual),
        pairs: told.iter().map(|t| [t.expected, t.actual]).collect(),
        unknown,
        explorer,
    }
}

fn data(episodes: &[Episode], labels: &Labels) -> Data {
    let mut data = Data::new(
        "episodes.csv",
        &[
            "task",
            "explorer",
            "seed",
            "unknown",
            "truth",
            "estimate",
            "expected_std",
            "posterior_std",
            "error",
            "contact_fraction",
            "residual",
        ],
    );
    for episode in episodes {
        for t in &episode.told {
            let wanted = &episode.wanted;
            let numbers = [
                t.truth,
                t.estimate,
                t.expected,
                t.actual,
                t.error,
                episode.contact,
                episode.residual,
            ];
            let mut cells = vec![
                wanted.task.clone(),
                labels.get(&wanted.explorer),
                wanted.seed.to_string(),
                t.unknown.clone(),
            ];
            cells.extend(numbers.map(|x| format!("{x:.6e}")));
            data.rows.push(cells);
        }
    }
    data
}
