//! A killed command leaves no half-written result, and nothing that stops the next one.
//! `cargo xtask kill` does the same to every command at random moments.

#![cfg(unix)]
#![allow(clippy::unwrap_used)]

mod cli_support;

use std::path::Path;

use cli_support::{Workplace, names, tiny};

const FILES: [&str; 7] = [
    "attempt.csv",
    "config.toml",
    "policy.json",
    "posterior.json",
    "real.csv",
    "report.html",
    "result.json",
];

fn staged(folder: &Path) -> bool {
    folder.is_dir() && names(folder).iter().any(|n| n.starts_with(".asid-"))
}

#[test]
fn a_run_that_is_killed_as_it_writes_is_run_again() {
    let call = [
        "run",
        "rod-balancing",
        "--set",
        "condition=left",
        "--quiet",
        "--out",
        "out",
    ];
    for there_before in [false, true] {
        let place = Workplace::new();
        let (home, out) = (place.path("."), place.path("out"));
        if there_before {
            std::fs::create_dir(&out).unwrap();
        }
        let mut child = place.asid(&tiny(&call)).spawn().unwrap();
        while !staged(&home) && !staged(&out) && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        // The command may have ended before the kill.
        if !place.path("out/result.json").exists() {
            let again = place.run(&tiny(&call));
            let said = String::from_utf8_lossy(&again.stderr);
            assert!(again.status.success(), "{said}");
            assert_eq!(place.names(), ["out"]);
        }
        let found = names(&out);
        assert!(
            FILES.iter().all(|f| found.iter().any(|n| n == f)),
            "{found:?}"
        );
        assert!(!found.iter().any(|n| n.starts_with('.')), "{found:?}");
    }
}

/// Symptom: in a container, where a process has the same number each time, a run after a killed one
/// fails once its work is done. Cause: only that number names the folder that it writes into.
#[test]
fn what_a_killed_process_leaves_is_in_nobodys_way() {
    let place = Workplace::new();
    for n in 1..200 {
        let left = place.path(&format!(".asid-{n}"));
        std::fs::create_dir(&left).unwrap();
        std::fs::write(left.join("lock"), "").unwrap();
    }
    let export = place.run(&["export", "rod-balancing", "--mjcf", "scene.xml"]);
    assert!(export.status.success());
    assert_eq!(place.names(), ["scene.xml"]);
}

#[test]
fn a_plugins_folder_that_was_begun_is_begun_anew() {
    let place = Workplace::new();
    let left = place.path("swing/.asid-dead");
    std::fs::create_dir_all(left.join("content/src")).unwrap();
    std::fs::write(left.join("lock"), "").unwrap();
    std::fs::write(left.join("moves"), "Cargo.toml\nsrc").unwrap();
    place.write("swing/Cargo.toml", "half");
    let new = place.run(&["new", "task", "swing"]);
    assert!(
        new.status.success(),
        "{}",
        String::from_utf8_lossy(&new.stderr)
    );
    assert_ne!(place.read("swing/Cargo.toml"), "half");
    assert!(
        names(&place.path("swing"))
            .iter()
            .all(|n| !n.starts_with(".asid-"))
    );
}

/// Whether a process handles SIGINT.
#[cfg(target_os = "linux")]
fn watches(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigCgt:"));
    let mask = mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok());
    mask.is_some_and(|m| m & 0b10 != 0)
}

/// Symptom: Ctrl-C ends a run, an exploration or a training without a message.
#[test]
#[cfg(target_os = "linux")]
fn ctrl_c_says_what_was_stopped_and_that_nothing_was_written() {
    let mut calls = vec![
        ("run", "--out out", "the run of rod-balancing"),
        ("explore", "--out out", "the exploration of rod-balancing"),
    ];
    if cfg!(feature = "torch") {
        let train = "--explorer fisher-ppo --train policy.safetensors";
        calls.push(("explore", train, "the training of fisher-ppo"));
    }
    for (command, options, what) in calls {
        let place = Workplace::new();
        let mut arguments = vec![command, "rod-balancing", "--quiet"];
        arguments.extend(options.split(' '));
        let mut call = place.asid(&arguments);
        let mut child = call.stderr(std::process::Stdio::piped()).spawn().unwrap();
        while !watches(child.id()) && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        let process = child.id().to_string();
        let kill = std::process::Command::new("kill")
            .args(["-INT", &process])
            .status();
        assert!(kill.unwrap().success());
        let done = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(130), "{said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        let expected = format!("{what} was stopped");
        assert!(
            said.contains(&expected) && said.contains("nothing was written"),
            "{said}"
        );
        assert!(place.names().is_empty(), "{:?}", place.names());
    }
}
