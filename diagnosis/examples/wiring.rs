//! Measures the check of wiring alone, over a folder of studies made by `asid withheld --make`.
//!
//! `cargo run --release --features mujoco --example wiring -- FOLDER [--spoil SEED]`: says of each study which faults of wiring
//! are found, against its label. With `--spoil` each study without a fault is spoilt in memory by one of every kind
//! besides, and the mending is compared with what was done to it.

#![allow(clippy::print_stdout)]

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

use asid::core::{Episode, Layout, Streams};
use asid::diagnosis::machine::Machine;
use asid::diagnosis::study::Study;
use asid::diagnosis::wiring::{Settings, hypotheses, mend};
use asid::logs::episode::{self, ColumnMapping};
use rand::Rng as _;
use rand::seq::IndexedRandom as _;
use serde_json::Value;

/// Offsets, in deviations of the column, and delays, s: those of `asid withheld`.
const OFFSET: std::ops::Range<f64> = 0.5..1.5;
const CLOCK: std::ops::Range<f64> = 0.03..0.12;

/// What was found of what was there.
#[derive(Default)]
struct Tally {
    cases: usize,
    found: usize,
    wrong: usize,
}

/// A fault that was put into a study: its name, its columns and its size.
struct Spoilt {
    fault: String,
    columns: Vec<String>,
    size: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = PathBuf::from(arguments.next().ok_or("give a folder of studies")?);
    let seed: Option<u64> = match (arguments.next().as_deref(), arguments.next()) {
        (Some("--spoil"), Some(seed)) => Some(seed.parse()?),
        _ => None,
    };
    let labels = [
        folder.join("sealed/labels.json"),
        folder.join("labels.json"),
    ];
    let labels = labels
        .iter()
        .find(|p| p.is_file())
        .ok_or("no labels.json")?;
    let labels: BTreeMap<String, Value> = serde_json::from_str(&std::fs::read_to_string(labels)?)?;
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    for (case, label) in &labels {
        let at = [folder.join("studies").join(case), folder.join(case)];
        let Some(at) = at.iter().find(|p| p.is_dir()) else {
            continue;
        };
        let study = Study::read(at)?;
        let backend: Box<dyn asid::core::Backend> =
            (asid::core::registry::find::<asid::core::registry::BackendEntry>("mujoco")?.make)()?;
        let machine = Machine::new(
            backend.into(),
            &study.scene,
            &study.fixed,
            &study.effects,
            0,
        )?;
        let wired = label["wiring"].as_array().and_then(|w| w.first());
        let spoilt = wired.map(|w| Spoilt {
            fault: w["fault"].as_str().unwrap_or_default().into(),
            columns: serde_json::from_value(w["columns"].clone()).unwrap_or_default(),
            size: w["value"].as_f64().unwrap_or_default(),
        });
        let what = format!(
            "{case} {} {} {} {}",
            label["world"], label["effects"], label["excess_gap"], label["log_faults"]
        );
        let none = spoilt.is_none();
        look(&study, &machine, spoilt.as_ref(), &what, &mut tallies)?;
        if let (Some(seed), true) = (seed, none) {
            for (study, spoilt) in spoil(&study, &machine, seed, case)? {
                look(&study, &machine, Some(&spoilt), &what, &mut tallies)?;
            }
        }
    }
    for (fault, t) in tallies {
        println!(
            "{fault}: {} cases, {} right, {} wrong",
            t.cases, t.found, t.wrong
        );
    }
    Ok(())
}

/// Looks at one study and adds what is found to the tallies.
fn look(
    study: &Study,
    machine: &Machine,
    spoilt: Option<&Spoilt>,
    what: &str,
    tallies: &mut BTreeMap<String, Tally>,
) -> Result<(), Box<dyn std::error::Error>> {
    let clock = Instant::now();
    let mended = mend(study, machine, &Settings::default())?;
    let seconds = clock.elapsed().as_secs_f64();
    let name = spoilt.map_or("none", |s| &s.fault);
    let tally = tallies.entry(name.to_owned()).or_default();
    tally.cases += 1;
    let right = match (spoilt, &mended.wiring[..]) {
        (None, found) => found.is_empty(),
        (Some(s), [one]) => {
            let mut columns = one.columns.clone();
            let mut wanted = s.columns.clone();
            columns.sort();
            wanted.sort();
            one.fault == s.fault && columns == wanted
        }
        _ => false,
    };
    tally.found += usize::from(right);
    tally.wrong += usize::from(!right && !mended.wiring.is_empty());
    let found: Vec<String> = mended
        .wiring
        .iter()
        .map(|w| {
            format!(
                "{} {:?} {:.3} [{}]",
                w.fault,
                w.columns,
                w.probability,
                w.mend.replace('\n', " ")
            )
        })
        .collect();
    let verdict = if right { "ok" } else { "MISS" };
    let put = spoilt.map_or_else(String::new, |s| {
        format!("{} {:?} {:.4}", s.fault, s.columns, s.size)
    });
    let nearest = mended.nearest.map_or_else(String::new, |n| {
        format!("nearest {} {:?} {:.2}", n.fault, n.columns, n.shrinkage)
    });
    println!(
        "{verdict} {seconds:.2}s {what} | {put} -> {} {:.2?} {nearest}",
        found.join("; "),
        mended.shrinkage
    );
    Ok(())
}

/// The study with one fault of each kind that it has columns for.
fn spoil(
    study: &Study,
    machine: &Machine,
    seed: u64,
    case: &str,
) -> Result<Vec<(Study, Spoilt)>, Box<dyn std::error::Error>> {
    let layout = &machine.plant.layout;
    let mut random = Streams::new(seed).stream(&format!("spoil {case}"));
    let sensors: Vec<String> = study.train[0]
        .1
        .channels
        .iter()
        .map(|c| c.name.clone())
        .collect();
    let all = hypotheses::quantities(&machine.plant, &sensors);
    let scalars: Vec<_> = all
        .iter()
        .filter(|q| !q.command && q.name == q.whole)
        .collect();
    let mut spoilt = Vec::new();
    let mut put =
        |fault: &str, mappings: Vec<ColumnMapping>, size: f64| -> Result<(), asid::core::Error> {
            let columns = mappings.iter().map(|m| m.name.clone()).collect();
            let mut study = study.clone();
            for (_, episode) in study.train.iter_mut().chain(&mut study.test) {
                *episode = remapped(episode, layout, &mappings)?;
            }
            let fault = fault.to_owned();
            spoilt.push((
                study,
                Spoilt {
                    fault,
                    columns,
                    size,
                },
            ));
            Ok(())
        };
    if let Some(q) = scalars.choose(&mut random) {
        let mapping = ColumnMapping {
            sign: -1.0,
            ..ColumnMapping::of(&q.name)
        };
        put("wiring-sign", vec![mapping], -1.0)?;
    }
    if let Some(q) = scalars.choose(&mut random) {
        let scale = 1.0 / q.units.first().map_or(1.0, |u| u.1);
        let mapping = ColumnMapping {
            scale,
            ..ColumnMapping::of(&q.name)
        };
        put("wiring-unit", vec![mapping], scale)?;
    }
    if let Some(q) = scalars.choose(&mut random) {
        let values: Vec<f64> = study
            .train
            .iter()
            .flat_map(|(_, e)| e.select(layout, std::slice::from_ref(&q.name)))
            .filter(|x| x.is_finite())
            .collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let spread = (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
        let offset = random.random_range(OFFSET) * spread;
        let mapping = ColumnMapping {
            offset,
            ..ColumnMapping::of(&q.name)
        };
        put("wiring-offset", vec![mapping], offset)?;
    }
    if let Some(a) = scalars.choose(&mut random) {
        let others: Vec<_> = scalars
            .iter()
            .filter(|b| b.name != a.name && b.kind == a.kind)
            .collect();
        if let Some(b) = others.choose(&mut random) {
            let from = |name: &str, from: &str| ColumnMapping {
                from: Some(from.to_owned()),
                ..ColumnMapping::of(name)
            };
            put(
                "wiring-swapped",
                vec![from(&a.name, &b.name), from(&b.name, &a.name)],
                0.0,
            )?;
        }
    }
    if layout.nu() > 0 {
        let delay = random.random_range(CLOCK);
        let late = |name: &String| ColumnMapping {
            delay: -delay,
            ..ColumnMapping::of(name)
        };
        put("wiring-clock", sensors.iter().map(late).collect(), delay)?;
    }
    Ok(spoilt)
}

/// The log with a fault; readings of before the first row are those of the first.
fn remapped(
    episode: &Episode,
    layout: &Layout,
    mappings: &[ColumnMapping],
) -> Result<Episode, asid::core::Error> {
    let mut spoilt = episode::remapped(episode, layout, (mappings, &[]))?;
    let width = spoilt.width();
    let late = mappings.iter().map(|m| -m.delay).fold(0.0, f64::max);
    for k in 0..spoilt.rows() {
        if spoilt.time[k] - spoilt.time[0] < late {
            for c in 0..width {
                if spoilt.readings[k * width + c].is_nan() {
                    spoilt.readings[k * width + c] = episode.readings[c];
                }
            }
        }
    }
    Ok(spoilt)
}
