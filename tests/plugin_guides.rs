//! The guides to tasks, algorithms and effects. Their commands run outside of the repository, and
//! their code is that of the examples.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

#[allow(dead_code)]
mod cli_support;

use std::path::Path;
use std::process::Command;

use cli_support::{TINY, Workplace};

const GUIDES: [&str; 3] = [
    "docs/add-a-task.md",
    "docs/add-an-algorithm.md",
    "docs/add-an-effect.md",
];

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// Blocks of code in a language, each with the line before it.
fn blocks(text: &str, language: &str) -> Vec<(String, String)> {
    let mut blocks = Vec::new();
    let mut lines = text.lines();
    let mut before = "";
    while let Some(line) = lines.next() {
        if line == format!("```{language}") {
            let block: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
            blocks.push((before.to_owned(), block.join("\n")));
        }
        before = line;
    }
    blocks
}

#[test]
fn code_in_the_guides_is_that_of_the_examples() {
    for guide in GUIDES {
        let found = blocks(&read(guide), "rust");
        assert!(!found.is_empty(), "{guide}");
        for (before, block) in found {
            let file = before
                .strip_prefix("<!-- ")
                .and_then(|b| b.strip_suffix(" -->"));
            let file = file.unwrap_or_else(|| panic!("{guide}: no file before\n{block}"));
            assert!(
                read(file).contains(&block),
                "{guide}: not in {file}:\n{block}"
            );
        }
    }
}

/// Follows a guide's first commands in an empty folder; `settings` shorten the work.
fn follow(guide: &str, settings: &[&str]) {
    let place = Workplace::new();
    let program = Path::new(env!("CARGO_BIN_EXE_asid"));
    let short: String = settings.iter().map(|s| format!(" --set {s}")).collect();
    let (_, commands) = blocks(&read(guide), "sh").remove(0);
    let script: String = commands
        .lines()
        .map(|line| match line.starts_with("asid run") {
            true => format!("{line} --quiet --out result{short}\n"),
            false => format!("{line}\n"),
        })
        .collect();
    // Builds of the dependencies are kept for the next time.
    let kept = program.parent().unwrap().parent().unwrap().join("guides");
    let script = script.replace("target/release", &format!("{}/release", kept.display()));
    let path = format!(
        "{}:{}:{}",
        program.parent().unwrap().display(),
        Path::new(env!("CARGO")).parent().unwrap().display(),
        std::env::var("PATH").unwrap_or_default()
    );
    let output = Command::new("sh")
        .args(["-e", "-c", &script])
        .current_dir(place.path(""))
        .env("PATH", path)
        .env("CARGO_TARGET_DIR", &kept)
        .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "0")
        .env_remove("RUST_BACKTRACE")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{guide}:\n{script}\n{said}");
    let name = commands.split_whitespace().nth(3).unwrap();
    let listed = String::from_utf8_lossy(&output.stdout);
    assert!(listed.contains(&format!(" {name} ")), "{listed}");
    assert!(
        place
            .read(&format!("{name}/result/result.json"))
            .contains("parameters")
    );
}

/// Words in brackets or code marks of a text that look like paths of files in the repository.
fn ways(text: &str) -> Vec<&str> {
    let links = text.split("](").skip(1);
    let links = links.filter_map(|rest| rest.split(')').next());
    let code = text.split('`').skip(1).step_by(2);
    let code = code.filter(|c| c.starts_with("plugins/effect-") || c.starts_with("plugins/task-"));
    links.filter(|l| !l.contains("://")).chain(code).collect()
}

#[test]
fn guides_of_a_new_plugin_lead_nowhere_that_is_not_there() {
    let place = Workplace::new();
    for kind in ["engine-c", "mechanism-c", "task", "explorer", "effect"] {
        let dir = format!("my-{kind}");
        let output = place.run(&["new", kind, &dir]);
        assert!(output.status.success(), "{output:?}");
        for file in ["GUIDE.md", "README.md"] {
            let text = place.read(&format!("{dir}/{file}"));
            let lost: Vec<&str> = (ways(&text).into_iter())
                .filter(|way| {
                    !place
                        .path(&dir)
                        .join(way.split('#').next().unwrap())
                        .exists()
                })
                .collect();
            assert!(lost.is_empty(), "{kind} {file}: {lost:?}");
            assert!(!text.contains("plugins/effect-"), "{kind} {file}");
        }
    }
}

/// Symptom: a new plugin has absolute paths of the machine that built the program.
#[test]
fn a_new_plugin_has_no_absolute_paths() {
    let place = Workplace::new();
    for kind in ["task", "explorer", "effect"] {
        let dir = format!("my-{kind}");
        assert!(place.run(&["new", kind, &dir]).status.success());
        let manifest = place.read(&format!("{dir}/Cargo.toml"));
        let paths: Vec<&str> = (manifest.split("path = \"").skip(1))
            .filter_map(|rest| rest.split('"').next())
            .collect();
        assert!(paths.len() > 1, "{manifest}");
        for path in paths {
            assert!(path.starts_with("../"), "{path}");
            assert!(
                place.path(&dir).join(path).join("Cargo.toml").is_file(),
                "{path}"
            );
        }
    }
    let lost = place.run(&["new", "task", "other", "--sources", "my-task"]);
    let said = String::from_utf8_lossy(&lost.stderr);
    assert_eq!(lost.status.code(), Some(2), "{said}");
    assert!(said.contains("my-task: is no checkout of ASID"), "{said}");
    assert!(!place.path("other").exists());
}

/// Symptom: `cargo build` in a new plugin below a checkout: "current package believes it's in a
/// workspace when it's not". Cause: its manifest named no workspace, so that cargo took the one
/// above.
#[test]
fn a_new_plugin_is_a_package_of_its_own_below_a_workspace() {
    let place = Workplace::new();
    place.write("Cargo.toml", "[workspace]\nmembers = []\n");
    for kind in ["task", "explorer", "effect"] {
        let dir = format!("my-{kind}");
        assert!(place.run(&["new", kind, &dir]).status.success());
        let read = Command::new(env!("CARGO"))
            .args(["metadata", "--no-deps", "--offline", "--format-version=1"])
            .current_dir(place.path(&dir))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&read.stderr);
        assert!(read.status.success(), "{kind}: {said}");
    }
}

/// Symptom: a new explorer `multisine-2` was called `multisine_2-2`, and its README named the library
/// `libmultisine-2.so`, which cargo calls `libmultisine_2.so`. Cause: an example's name of one word
/// is the same in code, and was replaced twice, or by the name that is no identifier.
#[test]
fn the_name_of_a_new_plugin_may_hold_that_of_its_example() {
    let place = Workplace::new();
    for (kind, name) in [
        ("explorer", "multisine-2"),
        ("effect", "magnetic-catch-2"),
        ("task", "my-payload-swing"),
    ] {
        assert!(place.run(&["new", kind, name]).status.success());
        for file in ["Cargo.toml", "src/lib.rs"] {
            let text = place.read(&format!("{name}/{file}"));
            assert!(text.contains(&format!("\"{name}\"")), "{file}: {text}");
        }
        let readme = place.read(&format!("{name}/README.md"));
        let library = format!("--plugin target/release/lib{}.so", name.replace('-', "_"));
        assert!(readme.contains(&library), "{readme}");
    }
}

#[test]
fn the_guide_to_tasks_leads_to_a_run() {
    follow(GUIDES[0], &TINY);
}

#[test]
fn the_guide_to_algorithms_leads_to_a_run() {
    // The new explorer has other settings.
    // The guide's explorer has settings of its own.
    let rest = TINY.into_iter().filter(|s| !s.starts_with("explorer."));
    follow(GUIDES[1], &rest.collect::<Vec<_>>());
}

#[test]
fn the_guide_to_effects_leads_to_a_run() {
    follow(GUIDES[2], &TINY);
}
