//! The scorer's own replays, on a cart that another program integrated: which sets are the same
//! physics, and what share of the gap that can be closed is closed.

#![allow(clippy::unwrap_used)]

#[path = "diagnosis_support/mod.rs"]
mod diagnosis_support;
#[path = "diagnosis/world.rs"]
mod world;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use asid::scorer::answer::{Answer, EffectValues, Hypothesis, ParameterEstimate, Verdict};
use asid::scorer::board::Score;
use asid::scorer::case::{Case, Run};
use asid::scorer::judge::{Judge, Standing};
use asid::scorer::label::{Label, WiringTruth, name_of, site_of};
use asid::scorer::physics::{self, Physics};
use diagnosis_support::engine;
use world::{MASS, Truth, write_study};

/// Effects as `NAME@SITE`, parameter and value.
type Named<'a> = [(&'a str, &'a str, f64)];

fn label(effects: &Named<'_>) -> Label {
    let value = |(e, p, v): &(&str, &str, f64)| (format!("{e}.{p}"), *v);
    Label {
        world: "cart".into(),
        effects: effects.iter().map(|e| e.0.to_owned()).collect(),
        effect_parameters: effects.iter().map(value).collect(),
        parameters: [("mass".to_owned(), MASS)].into(),
        noise: [("x".to_owned(), 5e-4), ("dx".to_owned(), 5e-3)].into(),
        ..Label::default()
    }
}

fn answer(effects: &Named<'_>) -> Answer {
    let labels: Vec<String> = effects.iter().map(|e| e.0.to_owned()).collect();
    let set = if labels.is_empty() {
        vec!["none".to_owned()]
    } else {
        labels.clone()
    };
    Answer {
        verdict: Verdict {
            kind: if labels.is_empty() { "none" } else { "effects" }.into(),
            effects: labels,
            probability: 0.9,
            ..Verdict::default()
        },
        hypotheses: vec![
            Hypothesis {
                effects: set,
                probability: 0.9,
            },
            Hypothesis {
                effects: vec!["unknown".into()],
                probability: 0.1,
            },
        ],
        effects: effects
            .iter()
            .map(|(e, p, v)| EffectValues {
                effect: name_of(e).into(),
                site: site_of(e).into(),
                parameters: [((*p).to_owned(), *v)].into(),
                ..EffectValues::default()
            })
            .collect(),
        parameters: vec![ParameterEstimate {
            name: "mass".into(),
            estimate: MASS,
            interval95: None,
        }],
        ..Answer::default()
    }
}

fn examine(study: &Path, label: &Label, answer: &Answer) -> Physics {
    let sites = physics::sites_of(study).unwrap();
    let catalogue = BTreeSet::new();
    let judge = Judge {
        label,
        sites: &sites,
        catalogue: &catalogue,
    };
    let found = physics::examine(engine(), study, &judge, answer);
    assert_eq!(found.skipped, None);
    found
}

const VISCOUS: (&str, &str, f64) = ("viscous-friction@rail", "damping", 1.5);

#[test]
fn a_drag_on_the_only_moving_body_is_friction_of_its_joint() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::Viscous(1.5));
    let truth = label(&[VISCOUS]);
    let same = |effects: &Named<'_>| {
        let found = examine(folder.path(), &truth, &answer(effects));
        (found.same_as_truth.unwrap(), found.distance.unwrap())
    };
    // -c v along the rail is both, up to how engines integrate a force and a damping.
    let drag = ("linear-drag@cart", "coefficient", 1.0);
    assert!(same(&[drag]).0, "{:?}", same(&[drag]));
    let (dry, distance) = same(&[("coulomb-friction@rail", "force", 0.5)]);
    assert!(!dry && distance > 1.0, "{distance}");
    // A set that contains the truth can imitate it, but is still another set.
    let both = [VISCOUS, ("coulomb-friction@rail", "force", 0.01)];
    assert!(!same(&both).0, "{:?}", same(&both));
    let none = same(&[]);
    assert!(!none.0 && none.1 > 1.0, "{none:?}");
}

#[test]
fn the_share_closed_is_one_for_the_truth_and_less_for_half_of_it() {
    let folder = tempfile::tempdir().unwrap();
    write_study(folder.path(), Truth::Viscous(1.5));
    let closed = |damping: f64, truth: &Label| {
        let said = [("viscous-friction@rail", "damping", damping)];
        let gaps = examine(folder.path(), truth, &answer(&said)).gaps.unwrap();
        // Noise, and the error of the model's step of 2 ms.
        assert!(gaps.best < 2.5 && gaps.identified > 5.0, "{gaps:?}");
        gaps.closed_of_possible.unwrap()
    };
    let truth = label(&[VISCOUS]);
    assert!((closed(1.5, &truth) - 1.0).abs() < 0.02);
    let half = closed(0.75, &truth);
    assert!(half < 0.9, "{half}");
    // A column with the wrong sign is corrected before replays, by the label.
    let mut wired = truth.clone();
    wired.wiring = vec![WiringTruth {
        fault: "wiring-sign".into(),
        columns: vec!["x".into()],
        value: -1.0,
    }];
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "csv") {
            negate(&path, "x");
        }
    }
    assert!((closed(1.5, &wired) - 1.0).abs() < 0.02);
}

/// Changes the sign of a column.
fn negate(log: &Path, column: &str) {
    let text = std::fs::read_to_string(log).unwrap();
    let head = text.lines().next().unwrap();
    let at = head.split(',').position(|c| c == column).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[at] = (-cells[at].parse::<f64>().unwrap()).to_string();
        cells.join(",")
    });
    let rows: Vec<String> = std::iter::once(head.to_owned()).chain(rows).collect();
    std::fs::write(log, rows.join("\n") + "\n").unwrap();
}

#[test]
fn labels_of_other_cases_score_nothing() {
    let sets: [&Named<'_>; 4] = [
        &[],
        &[VISCOUS],
        &[("coulomb-friction@rail", "force", 1.0)],
        &[("sensor-bias@x", "bias", 0.02)],
    ];
    let names = sets
        .iter()
        .flat_map(|s| s.iter().map(|e| name_of(e.0).to_owned()));
    let (sites, catalogue) = (asid::scorer::sites::Sites::default(), names.collect());
    let score = |shift: usize| {
        let cases = (0..sets.len()).map(|i| {
            let label = label(sets[(i + shift) % sets.len()]);
            let judge = Judge {
                label: &label,
                sites: &sites,
                catalogue: &catalogue,
            };
            let run = Run {
                answer: Ok(answer(sets[i])),
                seconds: 1.0,
                memory_mib: None,
            };
            Case::new(&format!("case-{i}"), &run, &judge, Physics::default())
        });
        Score::of("test", cases.collect(), BTreeMap::new())
    };
    let right = score(0);
    assert_eq!((right.right, right.top2), (4, 4));
    // ln 0.9, and the squared distance of 0.9 from 1.
    assert!((right.log_score.unwrap().value - 0.9_f64.ln()).abs() < 1e-12);
    assert!((right.brier.unwrap().value - 0.01).abs() < 1e-12);
    let scrambled = score(1);
    assert_eq!((scrambled.right, scrambled.top2), (0, 0));
    assert!(scrambled.log_score.unwrap().value < scrambled.base_log_score);
    assert!((scrambled.calibration.error - 0.9).abs() < 1e-12);
    assert_eq!(scrambled.clean_alarms.effect.text(), "1 of 1");
}

#[test]
fn a_case_without_an_answer_is_wrong_and_no_false_alarm() {
    let (label, catalogue) = (label(&[]), BTreeSet::new());
    let judge = Judge {
        label: &label,
        sites: &asid::scorer::sites::Sites::default(),
        catalogue: &catalogue,
    };
    let run = Run {
        answer: Err("over the limit of 1 s".into()),
        seconds: 1.0,
        memory_mib: None,
    };
    let case = Case::new("case-0", &run, &judge, Physics::default());
    assert_eq!((case.standing, case.alarm), (Standing::NoAnswer, None));
    let score = Score::of("test", vec![case], BTreeMap::new());
    assert_eq!((score.cases, score.right), (1, 0));
    assert_eq!(score.clean_alarms.effect.of, 0);
}
