//! Requirements on every page: well-formed, self-contained, and with legible texts.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::HashSet;

use asid_report::markup::text_width;
use asid_report::plot::FONT_SIZE;
use roxmltree::{Document, Node};

/// The page without its document type, which is not that of XML.
pub fn xml(html: &str) -> &str {
    html.strip_prefix("<!DOCTYPE html>").unwrap()
}

/// Checks that identifiers are unique, references resolve, and coordinates are numbers.
pub fn well_formed(html: &str, name: &str) {
    let document = Document::parse(xml(html)).unwrap();
    let mut seen = HashSet::new();
    for id in document.descendants().filter_map(|n| n.attribute("id")) {
        assert!(seen.insert(id), "{id} twice in {name}");
    }
    // Everything that an attribute refers to exists.
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
                "{}={value} in {name}",
                attribute.name()
            );
        }
    }
}

/// Checks that the page opens offline.
pub fn fetches_nothing(html: &str) {
    for fetching in ["<link", "<img", "src=", "@import", "url(http", "<iframe"] {
        assert!(!html.contains(fetching), "{fetching}");
    }
}

/// Checks that no text of a plot overlaps another one or leaves the plot.
pub fn texts_apart(html: &str, name: &str) {
    let document = Document::parse(xml(html)).unwrap();
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
                assert!(apart, "{a_text} {a:?} meets {b_text} {b:?} in {name}");
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
