//! `asid doctor`: which native libraries were looked for, found or missing, and how to get them.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_plugin::search;

use super::plugins::Refused;

/// Arguments of `doctor`.
#[derive(clap::Args)]
pub struct Arguments {}

struct Library {
    name: &'static str,
    what_for: &'static str,
    built_in: bool,
    variable: &'static str,
    folder: &'static str,
    file: &'static str,
}

const LIBRARIES: [Library; 2] = [
    Library {
        name: "MuJoCo 3.17.0",
        what_for: "backend `mujoco`",
        built_in: cfg!(feature = "mujoco"),
        variable: "MUJOCO_DYNAMIC_LINK_DIR",
        folder: ".native/mujoco",
        file: "libmujoco.so",
    },
    Library {
        name: "libtorch 2.13.0",
        what_for: "training (explorers fisher-ppo, maxmi, max, task-ppo; estimator), solver `ppo`",
        built_in: cfg!(feature = "torch"),
        variable: "LIBTORCH",
        folder: ".native/libtorch",
        file: "lib/libtorch_cpu.so",
    },
];

/// Prints the libraries that were looked for and found.
pub fn doctor(_arguments: &Arguments, refused: &[Refused]) -> Result<()> {
    let mut out = std::io::stdout().lock();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    writeln!(
        out,
        "asid {} ({}), {cores} cores",
        env!("CARGO_PKG_VERSION"),
        env!("ASID_GIT")
    )?;
    for entry in asid_core::registry::all::<asid_core::registry::BackendEntry>() {
        match (entry.make)() {
            Ok(backend) => writeln!(
                out,
                "ok       backend `{}`, version {}",
                entry.name,
                backend.version()
            )?,
            Err(e) => writeln!(out, "missing  backend `{}`: {e}", entry.name)?,
        }
    }
    for library in &LIBRARIES {
        let mut places: Vec<PathBuf> = Vec::new();
        if let Some(folder) = std::env::var_os(library.variable) {
            places.push(Path::new(&folder).join(library.file));
        }
        places.push(Path::new(library.folder).join(library.file));
        let found = places.iter().find(|p| p.exists());
        let built = if library.built_in {
            "built in"
        } else {
            "not in this build"
        };
        match found {
            Some(path) => writeln!(
                out,
                "ok       {} for {}: {} ({built})",
                library.name,
                library.what_for,
                path.display()
            )?,
            // A running program has found the libraries that it is linked with, wherever they are.
            None if library.built_in => writeln!(
                out,
                "ok       {} for {} ({built})",
                library.name, library.what_for
            )?,
            None => writeln!(
                out,
                "missing  {} for {} ({built}): looked for {}; get it with `cargo xtask setup`, or set {}",
                library.name,
                library.what_for,
                places
                    .iter()
                    .map(|p| p.display().to_string())
                    .collect::<Vec<_>>()
                    .join(" and "),
                library.variable
            )?,
        }
    }
    for place in search::places() {
        let (path, from) = (place.path.display(), place.from);
        let files = search::files(&place).map_or(0, |files| files.len());
        match place.path.exists() {
            true => writeln!(out, "ok       plugins of {path} ({from}): {files} found")?,
            false => writeln!(out, "absent   plugins of {path} ({from}): no such folder")?,
        }
    }
    for plugin in asid_plugin::loaded() {
        let names: Vec<String> = plugin
            .parts
            .iter()
            .map(|p| format!("{} `{}`", p.kind, p.name))
            .collect();
        let file = plugin.file.display();
        writeln!(out, "ok       plugin {file}: {}", names.join(", "))?;
    }
    for plugin in refused {
        writeln!(out, "refused  {}", plugin.why)?;
    }
    Ok(())
}
