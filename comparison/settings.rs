//! Hash of a run's settings.
//!
//! The hash is SHA-256 over canonical TOML with sorted keys and all defaults. It leaves out what
//! may differ among the runs of a row (seed and condition) and what the method does not use (for
//! example the explorer of a method that does not explore). A file that a setting names enters by
//! its content and not by its path, so a comparison has the same hashes in every folder. So does
//! what a model consists of.

use std::path::Path;

use crate::contents::{DIGITS, of_file, of_model};
pub use crate::contents::{PLUGIN_HASH, digest};
use crate::method::{Method, NONE, TRUTH};

/// Top-level keys in which the runs of a row differ.
const LEFT_OUT: [&str; 3] = ["seed", "condition", "command"];

/// Settings that name a file: section (empty for the top) and key.
const FILES: [(&str, &str); 4] = [
    ("", "model"),
    ("real", "model"),
    ("explorer", "policy"),
    ("identifier", "network"),
];

/// The key among [`FILES`] whose file is a model.
const MODEL: &str = "model";

/// Reduces resolved settings of a run to those that identify a row's settings.
#[must_use]
pub fn canonical(resolved: &toml::Table, method: &Method) -> toml::Table {
    let mut table = resolved.clone();
    for key in LEFT_OUT {
        table.remove(key);
    }
    if !method.explores() {
        table.insert("explorer".into(), named(NONE));
        // Without an episode there is no expectation of one.
        table.remove("expected");
    }
    if !method.identifies() {
        let stands = if method.knows_the_truth() {
            TRUTH
        } else {
            NONE
        };
        table.insert("identifier".into(), named(stands));
    }
    name_contents(&mut table);
    table
}

/// Replaces file paths in the settings by hashes of the files' contents.
pub fn name_contents(table: &mut toml::Table) {
    for (section, key) in FILES {
        let at = match section {
            "" => Some(&mut *table),
            section => table.get_mut(section).and_then(toml::Value::as_table_mut),
        };
        let Some(toml::Value::String(path)) = at.and_then(|t| t.get_mut(key)) else {
            continue;
        };
        let of = if key == MODEL { of_model } else { of_file };
        count_contents(path, of);
    }
    if let Some(plugins) = table.get_mut("plugins").and_then(toml::Value::as_array_mut) {
        for plugin in plugins {
            if let toml::Value::String(path) = plugin {
                count_contents(path, of_plugin);
            }
        }
    }
}

/// Replaces a file's path by the hash of its content; an unreadable file's path stays.
fn count_contents(path: &mut String, of: fn(&Path) -> Option<String>) {
    let contents = (!path.is_empty()).then(|| of(Path::new(path)));
    if let Some(contents) = contents.flatten() {
        *path = contents;
    }
}

fn named(name: &str) -> toml::Value {
    let mut section = toml::Table::new();
    section.insert("name".into(), name.into());
    section.into()
}

/// Hash of a plugin: the recorded one, which its path ends with, else that of its file.
fn of_plugin(path: &Path) -> Option<String> {
    let text = path.to_str()?;
    match text.rsplit_once(PLUGIN_HASH) {
        Some((_, hash)) => {
            let hash: String = hash.to_lowercase().chars().take(DIGITS).collect();
            Some(format!("sha256:{hash}"))
        }
        None => of_file(path),
    }
}

/// The hash of canonical settings (the first 16 digits of SHA-256), and their text.
#[must_use]
pub fn hash(canonical: &toml::Table) -> (String, String) {
    // A table of this crate keeps its keys sorted.
    let text = canonical.to_string();
    (digest(text.as_bytes()), text)
}

/// Entries that differ: dotted key and both values; `-` for a missing one.
#[must_use]
pub fn differences(a: &toml::Table, b: &toml::Table) -> Vec<(String, String, String)> {
    let mut found = Vec::new();
    compare("", a, b, &mut found);
    found
}

fn compare(
    prefix: &str,
    a: &toml::Table,
    b: &toml::Table,
    found: &mut Vec<(String, String, String)>,
) {
    let mut keys: Vec<&String> = a.keys().chain(b.keys()).collect();
    keys.sort();
    keys.dedup();
    let show = |v: Option<&toml::Value>| v.map_or_else(|| "-".to_owned(), ToString::to_string);
    for key in keys {
        let path = format!("{prefix}{key}");
        match (a.get(key), b.get(key)) {
            (Some(toml::Value::Table(x)), Some(toml::Value::Table(y))) => {
                compare(&format!("{path}."), x, y, found);
            }
            (x, y) if x == y => {}
            (x, y) => found.push((path, show(x), show(y))),
        }
    }
}

/// The first difference between two settings in one phrase; empty where they are equal.
#[must_use]
pub fn first_difference(a: &toml::Table, b: &toml::Table) -> String {
    let all = differences(a, b);
    all.first()
        .map(|(key, x, y)| format!("{key} = {x} there, {y} here"))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> toml::Table {
        text.parse().unwrap()
    }

    #[test]
    fn seed_condition_order_and_unused_parts_do_not_change_a_hash() {
        let asid = Method::named("asid").unwrap();
        let of = |text: &str, m: &Method| hash(&canonical(&table(text), m)).0;
        let a = "seed = 1\ncondition = 'left'\n[solver]\nname = 'cem'\niterations = 4\n[explorer]\nname = 'x'";
        let b = "seed = 2\n[explorer]\nname = 'x'\n[solver]\niterations = 4\nname = 'cem'";
        assert_eq!(of(a, &asid), of(b, &asid));
        assert_eq!(of(a, &asid).len(), DIGITS);
        let c = b.replace('4', "5");
        assert_ne!(of(a, &asid), of(&c, &asid));
        let dr = Method::named("dr").unwrap();
        assert_eq!(of(b, &dr), of(&b.replace("'x'", "'y'"), &dr));
        assert_ne!(of(b, &asid), of(&b.replace("'x'", "'y'"), &asid));
    }

    #[test]
    fn a_file_counts_by_what_it_holds() {
        let folder = tempfile::tempdir().unwrap();
        let asid = Method::named("asid").unwrap();
        let at = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            let mut policy = toml::Table::new();
            policy.insert("policy".into(), path.display().to_string().into());
            let mut all = toml::Table::new();
            all.insert("explorer".into(), policy.into());
            hash(&canonical(&all, &asid)).0
        };
        assert_eq!(at("a", "weights"), at("b", "weights"));
        assert_ne!(at("a", "weights"), at("b", "others"));
    }

    /// Symptom: after an edit of the model that a refined model names, a row pooled runs of two
    /// simulators. Cause: only the refined model's own text was hashed.
    #[test]
    fn a_refined_model_counts_by_its_whole_chain_of_files() {
        let asid = Method::named("asid").unwrap();
        let of = |folder: &Path, model: &str| {
            let file = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
            file("model.xml", model);
            file("a.toml", "model = 'model.xml'");
            let link = folder.join("a.toml").display().to_string();
            file("b.toml", &format!("model = '{link}'\n[[effect]]\n"));
            let mut table = toml::Table::new();
            let path = folder.join("b.toml").display().to_string();
            table.insert("model".into(), path.into());
            hash(&canonical(&table, &asid)).0
        };
        let [a, b] = [0, 1].map(|_| tempfile::tempdir().unwrap());
        let first = of(a.path(), "<mujoco/>");
        assert_eq!(first, of(b.path(), "<mujoco/>"));
        assert_ne!(first, of(a.path(), "<mujoco model='b'/>"));
        // A circle ends.
        std::fs::write(a.path().join("a.toml"), "model = 'b.toml'").unwrap();
        assert!(of_model(&a.path().join("a.toml")).is_some());
    }

    /// Symptom: after an edit of a file that a model includes, a row pooled runs of two simulators.
    /// Cause: only the model's own file was hashed.
    #[test]
    fn a_model_counts_by_what_it_includes_and_loads() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        let of = |name: &str| of_model(&folder.path().join(name)).unwrap();
        let include = "<include file='arm.xml'/>";
        let mesh = "<asset><mesh name='a' file='a.stl'/></asset>";
        let model = format!("<mujoco><compiler meshdir='meshes'/>{include}{mesh}</mujoco>");
        file("model.xml", &model);
        let change = |name: &str, text: &str| {
            let before = of("model.xml");
            file(name, text);
            before != of("model.xml")
        };
        file("arm.xml", "<mujoco><worldbody/></mujoco>");
        file("meshes/a.stl", "a mesh");
        assert!(!change("arm.xml", "<mujoco><worldbody/></mujoco>"));
        assert!(change(
            "arm.xml",
            "<mujoco><option timestep='0.001'/></mujoco>"
        ));
        assert!(change("meshes/a.stl", "another mesh"));
        assert!(!change("meshes/b.stl", "a mesh that is not named"));
        // A model in one file has the hash of the file.
        file("plain.xml", "<mujoco/>");
        assert_eq!(of("plain.xml"), format!("sha256:{}", digest(b"<mujoco/>")));
        // An attached model counts as well; a circle of them ends.
        file(
            "b.xml",
            "<mujoco><asset><model name='c' file='c.xml'/></asset></mujoco>",
        );
        file(
            "c.xml",
            "<mujoco><asset><model name='b' file='b.xml'/></asset></mujoco>",
        );
        let before = of("b.xml");
        file("c.xml", "<mujoco/>");
        assert_ne!(before, of("b.xml"));
    }

    /// Symptom: one plugin in two folders gave two hashes. Cause: its record, path and SHA-256, was
    /// taken for a path, which cannot be read.
    #[test]
    fn a_recorded_plugin_counts_by_its_recorded_hash_and_not_by_its_path() {
        let asid = Method::named("asid").unwrap();
        let of = |plugin: &str| {
            let all = table(&format!("plugins = ['{plugin}']"));
            hash(&canonical(&all, &asid)).0
        };
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        let one = of(&format!("/a/lib.so#sha256={abc}"));
        assert_eq!(one, of(&format!("/b/lib.so#sha256={}", abc.to_uppercase())));
        assert_ne!(
            one,
            of(&format!("/a/lib.so#sha256={}", abc.replace('b', "c")))
        );
        // As the file itself counts.
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("lib.so");
        std::fs::write(&file, "abc").unwrap();
        assert_eq!(one, of(&file.display().to_string()));
    }

    /// The test vector `abc` of FIPS 180-2, appendix B.1.
    #[test]
    fn the_hash_is_that_of_the_standard() {
        assert_eq!(digest(b"abc"), "ba7816bf8f01cfea");
    }

    #[test]
    fn a_difference_names_its_key_and_both_values() {
        let a = table("[solver]\niterations = 3\n[solver.cem]\nelite = 0.1");
        let b = table("[solver]\niterations = 10\n[solver.cem]\nelite = 0.1");
        assert_eq!(
            first_difference(&a, &b),
            "solver.iterations = 3 there, 10 here"
        );
        assert_eq!(first_difference(&a, &a), "");
    }
}
