//! The page of a run: whole, well-formed and legible, whatever the run kept.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../examples/gallery/synthetic.rs"]
mod synthetic;

use std::collections::HashSet;

use asid_report::markup::text_width;
use asid_report::plot::FONT_SIZE;
use asid_report::run::RunReport;
use roxmltree::{Document, Node};

/// The page without its document type, which is not XML's.
fn xml(html: &str) -> &str {
    html.strip_prefix("<!DOCTYPE html>").unwrap()
}

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
        let html = run.html();
        let document = Document::parse(xml(&html)).unwrap();
        let mut seen = HashSet::new();
        for id in document.descendants().filter_map(|n| n.attribute("id")) {
            assert!(seen.insert(id), "{id} twice in {}", run.task);
        }
        // Whatever an attribute refers to is there.
        for labels in document
            .descendants()
            .filter_map(|n| n.attribute("aria-labelledby"))
        {
            assert!(labels.split(' ').all(|id| seen.contains(id)), "{labels}");
        }
        for svg in document.descendants().filter(|n| n.has_tag_name("svg")) {
            for attribute in svg.descendants().flat_map(|n| n.attributes()) {
                let value = attribute.value();
                assert!(
                    !value.contains("NaN") && !value.contains("inf"),
                    "{}={value}",
                    attribute.name()
                );
            }
        }
    }
}

#[test]
fn nothing_is_fetched_from_elsewhere() {
    for run in runs() {
        let html = run.html();
        for fetching in ["<link", "<img", "src=", "@import", "url(http", "<iframe"] {
            assert!(!html.contains(fetching), "{fetching}");
        }
    }
}

#[test]
fn texts_of_a_plot_do_not_overlap_and_stay_inside() {
    for run in runs() {
        let html = run.html();
        let document = Document::parse(xml(&html)).unwrap();
        for svg in document.descendants().filter(|n| n.has_tag_name("svg")) {
            let size: Vec<f64> = svg
                .attribute("viewBox")
                .unwrap()
                .split(' ')
                .map(|t| t.parse().unwrap())
                .collect();
            let boxes: Vec<([f64; 4], &str)> = svg
                .descendants()
                .filter(|n| n.has_tag_name("text"))
                .map(text_box)
                .collect();
            for (i, (a, a_text)) in boxes.iter().enumerate() {
                assert!(
                    a[0] > -0.5 && a[2] < size[2] + 0.5 && a[3] < size[3] + 0.5,
                    "{a_text} leaves {size:?}: {a:?}"
                );
                for (b, b_text) in &boxes[i + 1..] {
                    let apart = a[2] <= b[0] || b[2] <= a[0] || a[3] <= b[1] || b[3] <= a[1];
                    assert!(apart, "{a_text} {a:?} meets {b_text} {b:?} in {}", run.task);
                }
            }
        }
    }
}

/// `[left, top, right, bottom]` of a text from its cap height to its baseline, by estimated width.
fn text_box<'a>(node: Node<'a, '_>) -> ([f64; 4], &'a str) {
    let number = |name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
    let text = node.text().unwrap_or("");
    let width = text_width(text, FONT_SIZE);
    let left = match node.attribute("text-anchor") {
        Some("middle") => number("x") - 0.5 * width,
        Some("end") => number("x") - width,
        _ => number("x"),
    };
    (
        [
            left,
            number("y") - 0.75 * FONT_SIZE,
            left + width,
            number("y"),
        ],
        text,
    )
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
    // NaN is null in JSON and comes back as NaN.
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
