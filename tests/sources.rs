//! What sources must not contain: unsafe code, and names of engines and effects, outside of their
//! places, and overlong functions. Also checks that what pages name exists.

#![allow(clippy::unwrap_used)]

mod source_support;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use source_support::{root, sources, untested};

/// Where unsafe code may be; `docs/architecture.md` says the same.
const UNSAFE: [&str; 4] = [
    "backends/",
    "plugin/",
    "withheld/engine.rs",
    "fuzz/memory.rs",
];

/// Where an engine may be named: its own crate, what registers engines in the build, and
/// measurements against an engine.
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

/// Where an effect may be named: its own crate, and crates that know the answers.
const EFFECTS: [&str; 4] = ["bench/", "effects/", "scorer/", "withheld/"];

/// Largest number of lines of a function, from its name to its last brace.
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

/// Places of `code` outside of `allowed` that contain one of `texts`.
fn strangers(code: &[(String, String)], allowed: &[&str], texts: &[String]) -> Vec<String> {
    let outside = code
        .iter()
        .filter(|(place, _)| !allowed.iter().any(|a| place.starts_with(a)));
    let lines = outside.flat_map(|(place, text)| text.lines().map(move |l| (place, l)));
    lines
        // A cargo feature may share a name.
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
    // Some of the names are also attributes of MJCF. Names with a hyphen belong to effects alone.
    let effects: Vec<String> = effects.into_iter().filter(|e| e.contains('-')).collect();
    let found = strangers(&code, &EFFECTS, &effects);
    assert!(found.is_empty(), "effects by name: {found:#?}");
}

/// Functions of a formatted text: name and number of lines.
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

/// Source folder of each crate that others use, by its name in code.
fn crates() -> BTreeMap<String, PathBuf> {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let all = manifest["workspace"]["dependencies"].as_table().unwrap();
    let own = all.iter().filter_map(|(name, d)| {
        let folder = root().join(d.get("path")?.as_str()?);
        let inner = folder.join("src");
        let source = if inner.exists() { inner } else { folder };
        Some((name.replace('-', "_"), source))
    });
    own.collect()
}

/// Paths of items in code marks of a page, such as `asid_core::Error`.
fn paths(text: &str) -> Vec<&str> {
    let code = text.split('`').skip(1).step_by(2);
    code.filter(|c| c.starts_with("asid_") && c.contains("::"))
        .collect()
}

/// Whether a path leads to a module, or to a name in its last module.
fn leads(crates: &BTreeMap<String, PathBuf>, path: &str) -> bool {
    let mut names = path.split("::");
    let Some(source) = names.next().and_then(|name| crates.get(name)) else {
        return false;
    };
    if let Some(macro_name) = path.strip_suffix('!') {
        let name = macro_name.rsplit("::").next().unwrap();
        let declared = format!("macro_rules! {name} {{");
        let holds = |file: &PathBuf| fs::read_to_string(file).unwrap().contains(&declared);
        return sources(source, false).iter().any(holds);
    }
    let (mut folder, mut file) = (source.clone(), source.join("lib.rs"));
    for name in names.by_ref() {
        let module = [format!("{name}.rs"), format!("{name}/mod.rs")];
        let Some(module) = module.iter().map(|m| folder.join(m)).find(|m| m.exists()) else {
            return names.next().is_none() && speaks_of(&file, name);
        };
        (folder, file) = (folder.join(name), module);
    }
    true
}

/// Whether the code of a file contains a name.
fn speaks_of(file: &Path, name: &str) -> bool {
    let text = fs::read_to_string(file).unwrap();
    let code = text.lines().filter(|l| !l.trim_start().starts_with("//"));
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    code.flat_map(|l| l.split(|c| !is_word(c)))
        .any(|word| word == name)
}

#[test]
fn items_that_pages_name_are_there() {
    let crates = crates();
    let pages = fs::read_dir(root().join("docs")).unwrap();
    let pages = pages.map(|e| e.unwrap().path());
    let more = ["README.md", "CONTRIBUTING.md"].map(|p| root().join(p));
    let mut seen = 0;
    for page in pages
        .chain(more)
        .filter(|p| p.extension().is_some_and(|e| e == "md"))
    {
        let text = fs::read_to_string(&page).unwrap();
        let paths = paths(&text);
        seen += paths.len();
        let lost: Vec<&str> = paths.into_iter().filter(|p| !leads(&crates, p)).collect();
        assert!(lost.is_empty(), "{}: {lost:?}", page.display());
    }
    assert!(seen > 5, "only {seen} paths were found");
    for lost in [
        "asid_core::fisher::FisherBatch",
        "asid_core::guard",
        "asid_none::x",
        "asid_core::nothing!",
    ] {
        assert!(!leads(&crates, lost), "{lost}");
    }
}
