//! `cargo xtask setup`: lays the native libraries out under `.native/`.
//!
//! A library appears completely or not at all: it is assembled in a folder beside its place, which
//! is then renamed. A stamp with the pins makes the next call quick and reveals a changed pin.

use std::fs;
use std::path::Path;
use std::process;

use anyhow::{Context, Result, bail};

use crate::library::{ALL, Library};

/// File in a library's folder that lists the pins from which it was made.
const STAMP: &str = ".pins";

/// The libraries that the arguments of `setup` name.
pub fn selection(arguments: &[String]) -> Result<Vec<&'static Library>> {
    let known = ALL.map(|l| l.name).join(", ");
    let name = match arguments {
        [] => return Ok(ALL.to_vec()),
        [option] if option == "--only" => bail!("--only needs a name; known: {known}"),
        [option, name] if option == "--only" => name.as_str(),
        [other] if other.starts_with("--only=") => &other["--only=".len()..],
        [other, ..] => bail!("unexpected argument `{other}`; usage: setup [--only mujoco|torch]"),
    };
    match ALL.into_iter().find(|l| l.name == name) {
        Some(library) => Ok(vec![library]),
        None => bail!("no native library `{name}`; known: {known}"),
    }
}

/// Sets up each of `libraries` and prints in one line what is used.
pub fn run(libraries: &[&'static Library]) -> Result<()> {
    for library in libraries {
        let place = library.path();
        let state = if let Some(chosen) = library.chosen() {
            check_chosen(library, &chosen)?;
            format!("yours, {chosen}")
        } else if lay_out(library, &place)? {
            format!("laid out in {}", place.display())
        } else {
            format!("ready in {}", place.display())
        };
        println!("{:<8}{state}", library.name);
    }
    Ok(())
}

/// Lays `library` out in `place`; false if it is already there.
///
/// # Errors
/// If the platform is not that of the pins, or if a file is not available.
pub fn lay_out(library: &Library, place: &Path) -> Result<bool> {
    if is_complete(library, place) {
        return Ok(false);
    }
    check_platform(library, std::env::consts::OS, std::env::consts::ARCH)?;
    install(library, place).with_context(|| format!("cannot set up {}", library.name))?;
    Ok(true)
}

/// Checks that a library chosen by the user has the file that the build needs.
fn check_chosen(library: &Library, chosen: &str) -> Result<()> {
    let elsewhere = chosen.starts_with('$');
    if !elsewhere && !Path::new(chosen).join(library.landmark).exists() {
        bail!(
            "{}={chosen} has no {}: correct the variable, or unset it to have the library fetched",
            library.variable,
            library.landmark
        );
    }
    Ok(())
}

/// Refuses platforms other than Linux on x86-64, to which the pinned files belong.
fn check_platform(library: &Library, os: &str, arch: &str) -> Result<()> {
    if (os, arch) != ("linux", "x86_64") {
        bail!(
            "no pinned {} for {os} on {arch} (only linux on x86_64): install it and set {}",
            library.name,
            library.variable
        );
    }
    Ok(())
}

fn is_complete(library: &Library, place: &Path) -> bool {
    place.join(library.landmark).exists()
        && fs::read_to_string(place.join(STAMP)).is_ok_and(|stamp| stamp == library.stamp())
}

/// Fetches, checks and extracts the wheels beside `place`, then moves the result there.
fn install(library: &Library, place: &Path) -> Result<()> {
    let parent = place.parent().context("a path without a parent")?;
    let prefix = format!(".{}.partial-", library.folder);
    remove_abandoned(parent, &prefix);
    let partial = parent.join(format!("{prefix}{}", process::id()));
    let downloads = partial.join("downloads");
    let tree = partial.join("tree");
    let work = || -> Result<()> {
        fs::create_dir_all(&tree).with_context(|| tree.display().to_string())?;
        for wheel in library.wheels {
            println!(
                "{:<8}fetching {} {}",
                library.name, wheel.project, wheel.version
            );
            fs::create_dir_all(&downloads)?;
            let path = wheel.fetch(&downloads)?;
            wheel.extract(&path, &tree)?;
            fs::remove_dir_all(&downloads)?;
        }
        finish(library, &tree)?;
        replace(&tree, place)
    };
    let outcome = work();
    // Remove the partial folder in any case.
    let _ = fs::remove_dir_all(&partial);
    outcome
}

/// Removes folders that interrupted set-ups left: those named after a process that no longer
/// exists.
fn remove_abandoned(parent: &Path, prefix: &str) {
    let Ok(entries) = fs::read_dir(parent) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let owner = name.to_str().and_then(|n| n.strip_prefix(prefix));
        if owner.is_some_and(|pid| !Path::new("/proc").join(pid).exists()) {
            let _ = fs::remove_dir_all(entry.path());
        }
    }
}

/// Adds links, small files and the stamp to an extracted tree.
fn finish(library: &Library, tree: &Path) -> Result<()> {
    for (link, target) in library.links {
        symlink(target, &tree.join(link))?;
    }
    for (path, content) in library.texts {
        fs::write(tree.join(path), content)?;
    }
    fs::write(tree.join(STAMP), library.stamp())?;
    Ok(())
}

/// Moves `tree` to `place`; removes an older layout first.
fn replace(tree: &Path, place: &Path) -> Result<()> {
    if place.exists() {
        fs::remove_dir_all(place).with_context(|| place.display().to_string())?;
    }
    fs::rename(tree, place).with_context(|| place.display().to_string())
}

#[cfg(unix)]
fn symlink(target: &str, link: &Path) -> Result<()> {
    std::os::unix::fs::symlink(target, link).with_context(|| link.display().to_string())
}

#[cfg(not(unix))]
fn symlink(_: &str, link: &Path) -> Result<()> {
    bail!("{}: no symbolic links on this system", link.display())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::library::{MUJOCO, TORCH};

    fn words(line: &str) -> Vec<String> {
        line.split_whitespace().map(str::to_owned).collect()
    }

    #[test]
    fn a_selection_is_everything_or_one() {
        let names = |line: &str| -> Vec<&str> {
            selection(&words(line))
                .unwrap()
                .iter()
                .map(|l| l.name)
                .collect()
        };
        assert_eq!(names(""), ["mujoco", "torch"]);
        assert_eq!(names("--only torch"), ["torch"]);
        assert_eq!(names("--only=mujoco"), ["mujoco"]);
        for wrong in ["--only", "--only bullet", "torch", "--only torch mujoco"] {
            assert!(selection(&words(wrong)).is_err(), "{wrong}");
        }
    }

    /// A linker script completes the layout of torch, a link that of MuJoCo.
    #[test]
    fn a_finished_tree_is_complete_until_a_pin_changes() {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join("mujoco");
        fs::create_dir(&place).unwrap();
        assert!(!is_complete(&MUJOCO, &place));
        fs::write(place.join("libmujoco.so.3.17.0"), "elf").unwrap();
        finish(&MUJOCO, &place).unwrap();
        assert_eq!(
            fs::read_to_string(place.join("libmujoco.so")).unwrap(),
            "elf"
        );
        assert!(is_complete(&MUJOCO, &place));
        fs::write(place.join(STAMP), "mujoco==3.16.0\n").unwrap();
        assert!(!is_complete(&MUJOCO, &place));

        let place = folder.path().join("libtorch");
        fs::create_dir_all(place.join("lib")).unwrap();
        finish(&TORCH, &place).unwrap();
        let script = fs::read_to_string(place.join("lib/libtorch.so")).unwrap();
        assert_eq!(script, "INPUT ( libtorch_cpu.so )\n");
    }

    #[test]
    fn an_older_layout_is_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let (tree, place) = (folder.path().join("new"), folder.path().join("place"));
        for (path, name) in [(&tree, "fresh"), (&place, "stale")] {
            fs::create_dir(path).unwrap();
            fs::write(path.join(name), "").unwrap();
        }
        replace(&tree, &place).unwrap();
        assert!(place.join("fresh").exists() && !place.join("stale").exists());
        assert!(!tree.exists());
    }

    #[test]
    fn only_what_a_dead_process_left_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let alive = folder.path().join(format!(".x.partial-{}", process::id()));
        // Larger than the largest process id of Linux.
        let dead = folder.path().join(".x.partial-99999999");
        let other = folder.path().join("libtorch");
        for path in [&alive, &dead, &other] {
            fs::create_dir(path).unwrap();
        }
        remove_abandoned(folder.path(), ".x.partial-");
        assert!(alive.exists() && other.exists() && !dead.exists());
    }

    #[test]
    fn other_platforms_and_empty_folders_are_told_what_to_do() {
        check_platform(&TORCH, "linux", "x86_64").unwrap();
        let message = check_platform(&TORCH, "macos", "aarch64")
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("macos") && message.contains("set LIBTORCH"),
            "{message}"
        );
        let message = check_chosen(&MUJOCO, "/nowhere").unwrap_err().to_string();
        assert!(
            message.starts_with("MUJOCO_DYNAMIC_LINK_DIR=/nowhere"),
            "{message}"
        );
        check_chosen(&TORCH, "$LIBTORCH_USE_PYTORCH").unwrap();
    }
}
