//! What sources do not hold: unsafe code outside of its places, names of engines and effects outside of theirs, and functions
//! that are too long to be read.

#![allow(clippy::unwrap_used)]

mod source_support;

use std::fs;

use source_support::{root, sources, untested};

/// Where unsafe code may stand: `docs/architecture.md` says the same.
const UNSAFE: [&str; 4] = [
    "backends/",
    "plugin/",
    "withheld/engine.rs",
    "fuzz/memory.rs",
];

/// Where an engine may be named: its own crate, what makes engines known to the build, and what is measured against one.
const ENGINES: [&str; 8] = [
    "asid-core/src/scene.rs",
    "backends/",
    "bench/",
    "scorer/",
    "src/cli/list.rs",
    "withheld/",
    "xtask/",
    "algorithms/learned/testing.rs",
];

/// Where an effect may be named: its own crate, and what knows the answers.
const EFFECTS: [&str; 4] = ["bench/", "effects/", "scorer/", "withheld/"];

/// Lines of a function, from its name to its last brace.
const LONGEST: usize = 100;

/// Sources by their path from the root, without tests and comments.
fn code() -> Vec<(String, String)> {
    let root = root();
    let read = |file: &std::path::PathBuf| {
        let text = fs::read_to_string(file).unwrap();
        let lines = untested(&text).lines().map(|l| {
            if l.trim_start().starts_with("//") {
                ""
            } else {
                l
            }
        });
        let place = file.strip_prefix(&root).unwrap().display().to_string();
        (place, lines.collect::<Vec<_>>().join("\n"))
    };
    let all: Vec<_> = sources(&root, true).iter().map(read).collect();
    assert!(all.len() > 500, "only {} sources were found", all.len());
    all
}

/// Places of `code` outside of `allowed` that hold one of `texts`.
fn strangers(code: &[(String, String)], allowed: &[&str], texts: &[String]) -> Vec<String> {
    let outside = code
        .iter()
        .filter(|(place, _)| !allowed.iter().any(|a| place.starts_with(a)));
    let lines = outside.flat_map(|(place, text)| text.lines().map(move |l| (place, l)));
    lines
        // A cargo feature has a name of its own.
        .filter(|(_, line)| !line.contains("feature = "))
        .filter(|(_, line)| texts.iter().any(|t| line.contains(t.as_str())))
        .map(|(place, line)| format!("{place}: {}", line.trim()))
        .collect()
}

/// Names that are registered in a folder, in quotes.
fn names(folder: &str) -> Vec<String> {
    let files = sources(&root().join(folder), true);
    let texts = files.iter().map(|f| fs::read_to_string(f).unwrap());
    let named = |text: String| -> Vec<String> {
        let entries = text
            .split("register!(")
            .skip(1)
            .chain(text.split("register_effect!(").skip(1));
        entries
            .filter_map(|e| {
                Some(format!(
                    "\"{}\"",
                    e.split_once("name: \"")?.1.split_once('"')?.0
                ))
            })
            .collect()
    };
    texts.flat_map(named).collect()
}

#[test]
fn unsafe_code_is_in_its_places() {
    let unsafes = [
        "unsafe {",
        "unsafe fn",
        "unsafe impl",
        "unsafe extern",
        "#[unsafe(",
    ];
    let found = strangers(&code(), &UNSAFE, &unsafes.map(String::from));
    assert!(
        found.is_empty(),
        "unsafe code outside of its places: {found:#?}"
    );
}

#[test]
fn no_crate_decides_by_the_name_of_an_engine_or_an_effect() {
    let code = code();
    let engines = names("backends");
    assert_eq!(engines.len(), 2, "{engines:?}");
    let found = strangers(&code, &ENGINES, &engines);
    assert!(found.is_empty(), "engines by name: {found:#?}");
    let effects = names("effects");
    assert!(effects.len() > 30, "{effects:?}");
    // Attributes of MJCF have some of the names; those with a hyphen are of effects alone.
    let effects: Vec<String> = effects.into_iter().filter(|e| e.contains('-')).collect();
    let found = strangers(&code, &EFFECTS, &effects);
    assert!(found.is_empty(), "effects by name: {found:#?}");
}

/// Functions of a formatted text: name and lines.
fn functions(text: &str) -> Vec<(String, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let code = line.trim_start();
        let Some((before, after)) = code.split_once("fn ") else {
            continue;
        };
        let is_start = before.split_whitespace().all(|word| {
            word.starts_with("pub")
                || ["const", "unsafe", "async", "extern", "\"C\""].contains(&word)
        });
        if !is_start {
            continue;
        }
        let end = format!("{}}}", &line[..line.len() - code.len()]);
        let body = lines[i..].iter().position(|l| l.ends_with(['{', ';', '}']));
        let opens = body.filter(|&at| lines[i + at].ends_with('{'));
        let length = opens.and_then(|_| lines[i..].iter().position(|l| *l == end));
        let name = after.split(['(', '<']).next().unwrap().to_owned();
        found.push((name, length.map_or(1, |l| l + 1)));
    }
    found
}

#[test]
fn a_function_can_be_read() {
    let mut long = Vec::new();
    let mut count = 0;
    for (place, text) in code() {
        let all = functions(&text);
        count += all.len();
        let these = all.into_iter().filter(|(_, lines)| *lines > LONGEST);
        long.extend(these.map(|(name, lines)| format!("{place}: {name}, {lines} lines")));
    }
    assert!(count > 5000, "only {count} functions were found");
    assert!(long.is_empty(), "longer than {LONGEST} lines: {long:#?}");
}

#[test]
fn the_reading_of_functions_sees_what_is_there() {
    let text = "fn one() {}\n    pub(crate) const fn two<T>(\n        x: T,\n    ) -> u8 {\n        1\n    }\nfn three(&self);\n// fn four() {\nlet f = fn_of();\n";
    let expected = [("one", 1), ("two", 5), ("three", 1)];
    assert_eq!(functions(text), expected.map(|(n, l)| (n.to_owned(), l)));
    let code = [(
        "src/a.rs".to_owned(),
        "if x == \"jet\" {\n#[cfg(feature = \"jet\")]".to_owned(),
    )];
    let jet = ["\"jet\"".to_owned()];
    assert_eq!(
        strangers(&code, &["src/b.rs"], &jet),
        ["src/a.rs: if x == \"jet\" {"]
    );
    assert!(strangers(&code, &["src/"], &jet).is_empty());
}
