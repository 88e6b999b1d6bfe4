//! Crates use each other as `docs/architecture.md` says, without cycles between crates or between
//! the modules of a crate.

#![allow(clippy::unwrap_used)]

mod source_support;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use source_support::{root, sources, untested};

type Names = BTreeSet<String>;

/// The crates' folders in the page's table from the top, each with the folders that it uses.
fn page() -> Vec<(String, Names)> {
    let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let quoted = |cell: &str| -> Vec<String> {
        let parts = cell.split('`').skip(1).step_by(2);
        parts.map(|p| p.trim_end_matches('/').to_owned()).collect()
    };
    let rows = text.lines().filter(|l| l.starts_with("| `"));
    rows.map(|row| {
        let cells: Vec<&str> = row.trim_matches('|').split('|').collect();
        let name = quoted(cells[0]).remove(0);
        (name, quoted(cells.last().unwrap()).into_iter().collect())
    })
    .collect()
}

/// Each crate's folder, with the folders of the workspace's crates that it depends on.
fn manifests() -> BTreeMap<String, Names> {
    let read = |folder: &str| -> toml::Table {
        let file = root().join(folder).join("Cargo.toml");
        fs::read_to_string(file).unwrap().parse().unwrap()
    };
    let workspace = read(".");
    let members = workspace["workspace"]["members"].as_array().unwrap();
    let members = members.iter().map(|m| m.as_str().unwrap());
    let folders: Vec<&str> = std::iter::once(".").chain(members).collect();
    let of_name: BTreeMap<String, &str> = folders
        .iter()
        .map(|f| (read(f)["package"]["name"].as_str().unwrap().to_owned(), *f))
        .collect();
    let uses = |folder: &&str| -> Names {
        let manifest = read(folder);
        let Some(dependencies) = manifest.get("dependencies") else {
            return Names::new();
        };
        let names = dependencies.as_table().unwrap().keys();
        names
            .filter_map(|n| of_name.get(n).map(|&f| f.to_owned()))
            .collect()
    };
    folders.iter().map(|f| ((*f).to_owned(), uses(f))).collect()
}

#[test]
fn crates_use_each_other_as_the_page_says() {
    let (page, manifests) = (page(), manifests());
    assert!(page.len() > 10, "the page's table was not found");
    let mut above = Names::new();
    for (folder, uses) in &page {
        let found = &manifests[folder];
        assert_eq!(
            found, uses,
            "`{folder}` uses the left, and docs/architecture.md says the right"
        );
        let below: Vec<_> = uses.difference(&above).collect();
        assert!(below.is_empty(), "`{folder}` uses {below:?}, below it");
        above.insert(folder.clone());
    }
    // A crate outside of the table is used only by others outside of it.
    let outside = |folder: &str| !above.contains(folder);
    for (folder, uses) in manifests.iter().filter(|(folder, _)| !outside(folder)) {
        let strange: Vec<_> = uses.iter().filter(|u| outside(u)).collect();
        assert!(strange.is_empty(), "`{folder}` uses {strange:?}");
    }
}

/// Top-level modules of a crate that `text`, a module `depth` folders down, refers to.
fn mentioned(text: &str, depth: usize) -> Names {
    let code: String = untested(text)
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n")
        .collect();
    let word = |rest: &str| -> String {
        let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        rest[..end.unwrap_or(rest.len())].to_owned()
    };
    let mut found = Names::new();
    let mut after = |path: &str| {
        for (at, _) in code.match_indices(path) {
            let deeper = code[..at].ends_with("super::") || code[..at].ends_with("asid_");
            let rest = &code[at + path.len()..];
            if deeper {
                continue;
            }
            match rest.strip_prefix('{') {
                None => {
                    found.insert(word(rest));
                }
                // The names at the outermost level of a group.
                Some(group) => {
                    let (mut level, mut first) = (0, true);
                    for (i, c) in group.char_indices() {
                        match c {
                            '{' => level += 1,
                            '}' if level == 0 => break,
                            '}' => level -= 1,
                            ',' if level == 0 => first = true,
                            c if c.is_whitespace() => {}
                            _ if first && level == 0 => {
                                found.insert(word(&group[i..]));
                                first = false;
                            }
                            _ => {}
                        }
                    }
                }
            }
        }
    };
    after("crate::");
    after(&"super::".repeat(depth));
    found
}

/// The top-level modules of a crate, each with the modules that it uses.
fn modules(folder: &str) -> BTreeMap<String, Names> {
    let folder = root().join(folder);
    let source = if folder.join("src").exists() {
        folder.join("src")
    } else {
        folder
    };
    let mut graph: BTreeMap<String, Names> = BTreeMap::new();
    for file in sources(&source, false) {
        let parts: Vec<&str> = file
            .strip_prefix(&source)
            .unwrap()
            .iter()
            .map(|p| p.to_str().unwrap())
            .collect();
        let own = parts[0].trim_end_matches(".rs").to_owned();
        let last = parts[parts.len() - 1];
        if ["lib.rs", "main.rs", "build.rs"].contains(&last) {
            continue;
        }
        let depth = parts.len() - usize::from(last == "mod.rs");
        let text = fs::read_to_string(&file).unwrap();
        graph
            .entry(own)
            .or_default()
            .extend(mentioned(&text, depth));
    }
    let all: Names = graph.keys().cloned().collect();
    for (own, uses) in &mut graph {
        uses.retain(|u| u != own && all.contains(u));
    }
    graph
}

/// Returns the cycles of a graph: what is left after everything that uses nothing is removed
/// repeatedly.
fn circles(mut graph: BTreeMap<String, Names>) -> BTreeMap<String, Names> {
    while let Some(free) = graph
        .iter()
        .find(|(_, uses)| uses.is_empty())
        .map(|(name, _)| name.clone())
    {
        graph.remove(&free);
        for uses in graph.values_mut() {
            uses.remove(&free);
        }
    }
    graph
}

#[test]
fn modules_of_a_crate_use_each_other_in_one_direction() {
    for (folder, _) in page() {
        let circles = circles(modules(&folder));
        assert!(circles.is_empty(), "circles in `{folder}`: {circles:#?}");
    }
}

#[test]
fn the_reading_of_modules_sees_what_is_there() {
    let text = "use crate::a::B;\nuse crate::{c, d::{e, f}, g};\nuse super::super::h::I;\nuse super::k;\n// crate::l\n";
    let found = mentioned(text, 2);
    assert_eq!(found, ["a", "c", "d", "g", "h"].map(String::from).into());
    let circle = [("a", "b"), ("b", "a"), ("c", "a")];
    let graph = circle.map(|(x, y)| (x.to_owned(), Names::from([y.to_owned()])));
    assert_eq!(circles(graph.into()).len(), 3);
    let rapier = modules("backends/rapier");
    assert!(rapier["compile"].contains("compiled"), "{rapier:#?}");
}
