//! The page of a diagnosis: complete, well-formed and legible, whatever was found.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../examples/gallery/diagnosed.rs"]
mod diagnosed;
mod legible;

use asid_results::diagnosis::{Kind, Verdict};
use diagnosed::Diagnosis;
use legible::xml;
use roxmltree::Document;

/// The page of a diagnosis.
fn page(d: &Diagnosis) -> String {
    asid_report::diagnosis::page(&d.result, &d.trace)
}

/// A diagnosis of each kind, an empty one, and ones with non-finite numbers.
fn diagnoses() -> [Diagnosis; 7] {
    let mut numberless = diagnosed::patch();
    numberless.result.gap = Default::default();
    for signal in &mut numberless.trace.signals {
        signal.noise = f64::NAN;
        signal.real.fill(f64::NAN);
        signal.refined.clear();
    }
    numberless.result.places[0].share = f64::NAN;
    numberless.trace.ladder[0].gap = f64::NAN;
    let values = &mut numberless.result.effects[0].parameters;
    values.insert("place".into(), f64::NAN);
    numberless.result.effects[1].gap_closed = None;
    let mut timeless = diagnosed::complete();
    timeless.trace.signals[0].time.clear();
    timeless.trace.signals[1].nominal.fill(f64::INFINITY);
    [
        diagnosed::patch(),
        diagnosed::by_force(),
        diagnosed::complete(),
        diagnosed::crowded(),
        Diagnosis::default(),
        numberless,
        timeless,
    ]
}

#[test]
fn every_page_is_well_formed_self_contained_and_legible() {
    for d in diagnoses() {
        let html = page(&d);
        legible::well_formed(&html, &d.result.study);
        legible::fetches_nothing(&html);
        legible::texts_apart(&html, &d.result.study);
    }
}

#[test]
fn names_from_files_cannot_break_out_of_the_page() {
    let hostile = "</title><script>alert(1)</script>&\"'";
    let mut d = diagnosed::patch();
    d.result.study = hostile.into();
    d.result.sentence = hostile.into();
    d.trace.signals[0].signal = hostile.into();
    d.trace.signals[0].unit = hostile.into();
    d.trace.signals[3].episode = hostile.into();
    d.result.places[0].condition = Some(hostile.into());
    d.result.hypotheses[0].effects = vec![hostile.into()];
    d.result.effects[0].site = hostile.into();
    d.result.verdict.ambiguous_with[0][0] = hostile.into();
    d.trace.ladder[1].label = hostile.into();
    d.result.checks[0].detail = hostile.into();
    d.trace.left_out[0].value = hostile.into();
    d.result.next_experiment.how = hostile.into();
    d.trace.command = hostile.into();
    d.trace.map.as_mut().unwrap().axes[0] = hostile.into();
    let html = page(&d);
    assert!(Document::parse(xml(&html)).is_ok());
    assert!(!html.contains("<script>alert"));
}

/// A diagnosis written to its files and read back.
fn stored(d: &Diagnosis) -> Diagnosis {
    let result = serde_json::to_string(&d.result).unwrap();
    let trace = serde_json::to_string(&d.trace).unwrap();
    Diagnosis {
        result: serde_json::from_str(&result).unwrap(),
        trace: serde_json::from_str(&trace).unwrap(),
    }
}

#[test]
fn stored_data_give_the_same_page() {
    for d in diagnoses() {
        // NaN is null in JSON and becomes NaN again; so do infinite values.
        let once = stored(&d);
        let twice = stored(&once);
        assert!(page(&once) == page(&twice), "{} differs", d.result.study);
    }
}

#[test]
fn each_kind_of_verdict_is_told_with_what_cannot_be_told_from_it() {
    let html = page(&diagnosed::patch());
    for told in [
        "The real board is rougher beyond 0.41 m",
        "cause narrowed down",
        "41 → 14 → 1.9",
        "95 % interval 96 to 99",
        "probably lacks friction-patch@board",
        "These data cannot tell it from friction-drift@board",
        "excitation",
        "noise floor",
    ] {
        assert!(html.contains(told), "{told}");
    }
    let mut sure = diagnosed::patch();
    sure.result.verdict.ambiguous_with.clear();
    assert!(
        page(&sure).contains("cause found")
            && page(&sure).contains("No other explanation that was tried")
    );

    let html = page(&diagnosed::complete());
    assert!(html.contains("No effect is missing") && !html.contains(">refined<"));
    let html = page(&diagnosed::crowded());
    assert!(
        html.contains("cause unknown")
            && html.contains("no effect of the catalogue explains enough of it")
    );
}

#[test]
fn a_verdict_of_two_effects_describes_both() {
    let mut d = diagnosed::patch();
    let both = ["friction-patch@board", "gravity-tilt"].map(str::to_owned);
    d.result.verdict = Verdict {
        kind: Kind::Effects,
        effects: both.to_vec(),
        probability: 0.99,
        ..Verdict::default()
    };
    let html = page(&d);
    assert!(html.contains("lacks friction-patch@board and gravity-tilt"));
    assert!(html.contains("gravity-tilt: The ground is not level; fitted: pitch = −0.021"));
}

#[test]
fn the_missing_force_is_drawn_with_the_law_and_an_early_end_says_what_was_left_out() {
    let html = page(&diagnosed::by_force());
    for told in [
        "shoulder: 1.3\u{a0}N m is missing, 0.13\u{a0}N m is left",
        "Against speed",
        "Against angle",
        "Against force of the drives",
        "How the explanations rank",
        "Which effects these logs tell apart",
        "1. friction-anisotropy@joint_0",
        "Stopped early",
        "linear-drag@puck and gravity-tilt",
    ] {
        assert!(html.contains(told), "{told}");
    }
    // Values that were not estimated are not shown.
    let html = page(&diagnosed::patch());
    for untold in [
        "that is missing",
        "How the explanations rank",
        "Stopped early",
    ] {
        assert!(!html.contains(untold), "{untold}");
    }
}

#[test]
fn missing_readings_interrupt_the_lines() {
    let mut d = diagnosed::complete();
    d.trace.signals.truncate(1);
    let count = |d: &Diagnosis| {
        let html = page(d);
        let document = Document::parse(xml(&html)).unwrap();
        let paths = document.descendants().filter_map(|n| n.attribute("d"));
        paths.map(|d| d.matches('M').count()).sum::<usize>()
    };
    let whole = count(&d);
    d.trace.signals[0].identified[40..50].fill(f64::NAN);
    // Two widths; the identified model is in the picture and in its residual.
    assert_eq!(count(&d), whole + 4);
}
