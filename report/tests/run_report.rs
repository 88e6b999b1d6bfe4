//! The page of a run: complete, well-formed and legible, whatever data the run kept.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../examples/gallery/synthetic.rs"]
mod synthetic;

mod legible;

use asid_report::run::RunReport;
use legible::xml;
use roxmltree::Document;

fn runs() -> [RunReport; 4] {
    [
        synthetic::full_run(),
        synthetic::bare_run(),
        synthetic::crowded_run(),
        RunReport::default(),
    ]
}

#[test]
fn every_page_is_well_formed_with_unique_identifiers_and_finite_coordinates() {
    for run in runs() {
        legible::well_formed(&run.html(), &run.task);
    }
}

#[test]
fn nothing_is_fetched_from_elsewhere() {
    for run in runs() {
        legible::fetches_nothing(&run.html());
    }
}

#[test]
fn texts_of_a_plot_do_not_overlap_and_stay_inside() {
    for run in runs() {
        legible::texts_apart(&run.html(), &run.task);
    }
}

#[test]
fn names_from_files_cannot_break_out_of_the_page() {
    let hostile = "</title><script>alert(1)</script>&\"'";
    let mut run = synthetic::full_run();
    run.task = hostile.into();
    run.parameters[0].name = hostile.into();
    run.signals[0].name = hostile.into();
    run.signals[0].unit = hostile.into();
    run.command = hostile.into();
    if let Some(downstream) = &mut run.downstream {
        downstream.phases[0].name = hostile.into();
        downstream.rule = hostile.into();
    }
    let html = run.html();
    assert!(Document::parse(xml(&html)).is_ok());
    assert!(!html.contains("<script>alert"));
}

#[test]
fn a_stored_trace_gives_the_same_page() {
    for run in runs() {
        let read = RunReport::from_json(&run.to_json().unwrap()).unwrap();
        assert!(read.html() == run.html(), "{} differs", run.task);
    }
    // NaN is null in JSON and becomes NaN again.
    assert!(
        RunReport::from_json("{\"schema\":1,\"wall_s\":null}")
            .unwrap()
            .wall_s
            .is_nan()
    );
}

#[test]
fn a_trace_that_is_none_gives_one_clear_line() {
    for text in [
        "",
        "[]",
        "{\"schema\":99}",
        "{}",
        "{\"schema\":1,\"parameters\":[{\"interval95\":[1]}]}",
    ] {
        let message = RunReport::from_json(text).unwrap_err().to_string();
        assert!(
            message.contains("trace.json") && !message.contains('\n'),
            "{message}"
        );
    }
}

#[test]
fn the_answer_and_the_verdict_are_on_the_page() {
    let html = synthetic::full_run().html();
    assert!(html.contains("mass_offset is 0.0612\u{a0}±\u{a0}0.0021\u{a0}m (truth 0.0600); tilt in the real world is 0.3°: success."));
    let bare = synthetic::bare_run().html();
    assert!(bare.contains("No downstream part") && bare.contains("No learning curve"));
}

/// A trial states its iteration. A `trace.json` with 2147483647 there took 8 s, because each
/// iteration up to that number was visited.
#[test]
fn an_iteration_of_any_number_is_drawn_at_once() {
    let mut run = synthetic::full_run();
    let search = run.downstream.as_mut().and_then(|d| d.search.as_mut());
    search.unwrap().trials[0].iteration = u32::MAX;
    let began = std::time::Instant::now();
    let html = run.html();
    assert!(html.contains("4294967296 iterations of the solver"));
    // It takes milliseconds; counting up takes ten seconds and more.
    assert!(began.elapsed().as_secs_f64() < 5.0);
}
