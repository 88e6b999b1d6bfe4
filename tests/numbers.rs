//! No number without a reason: every constant of the crates has a comment.

#![allow(clippy::unwrap_used)]

mod source_support;

use std::fs;

use source_support::{root, sources, untested};

/// Folders of the crates whose numbers are checked. The C ABI's numbers are those of its header,
/// which explains them.
const CRATES: [&str; 18] = [
    "asid-core",
    "diagnosis",
    "mjcf",
    "effects",
    "plugin",
    "backends/rapier/src",
    "backends/mujoco/src",
    "algorithms",
    "tasks",
    "worlds",
    "comparison",
    "conformance",
    "logs",
    "report",
    "sysid",
    "withheld",
    "scorer",
    "src",
];

/// Smallest number of words in a constant's comment: what it is, and its unit.
const FEWEST_WORDS: usize = 3;

/// Numeric types.
const TYPES: [&str; 5] = ["f64", "f32", "usize", "u64", "u32"];

/// Names of the numeric constants of a text with too few words of comment.
fn unexplained(text: &str) -> Vec<String> {
    let lines: Vec<&str> = untested(text).lines().map(str::trim).collect();
    let mut found = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let public = line
            .trim_start_matches("pub ")
            .trim_start_matches("pub(crate) ");
        let Some((name, rest)) = public
            .strip_prefix("const ")
            .and_then(|l| l.split_once(": "))
        else {
            continue;
        };
        let kind = rest
            .trim_start_matches('[')
            .split([' ', ';'])
            .next()
            .unwrap();
        if !TYPES.contains(&kind) {
            continue;
        }
        let above = lines[..i].iter().rev();
        let about = above.take_while(|l| l.starts_with("///") || l.starts_with("#["));
        let words = about
            .filter_map(|l| l.strip_prefix("///"))
            .flat_map(str::split_whitespace);
        if words.count() < FEWEST_WORDS {
            found.push(name.to_owned());
        }
    }
    found
}

#[test]
fn every_number_says_what_it_is() {
    let root = root();
    let mut silent = Vec::new();
    for folder in CRATES {
        for file in sources(&root.join(folder), true) {
            let text = fs::read_to_string(&file).unwrap();
            let place = file.strip_prefix(&root).unwrap().display().to_string();
            silent.extend(
                unexplained(&text)
                    .into_iter()
                    .map(|n| format!("{place}: {n}")),
            );
        }
    }
    assert!(
        silent.is_empty(),
        "without a word of what they are: {silent:#?}"
    );
}

#[test]
fn a_number_without_a_word_is_seen() {
    let text = "/// Length of a frame, s.\nconst FRAME: f64 = 0.1;\nconst BARE: usize = 3;\n\
                /// Two.\npub const SHORT: [f64; 2] = [1.0, 2.0];\nconst NAME: &str = \"x\";";
    assert_eq!(unexplained(text), ["BARE", "SHORT"]);
}
