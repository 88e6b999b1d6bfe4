//! Embeds the trained networks that ship: every file of `algorithms/trained/TASK/NAME.safetensors`.

// A build script speaks to cargo through its standard output.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    let root = Path::new(&env::var("CARGO_MANIFEST_DIR")?).join("../trained");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed={}", root.display());
    let mut list = String::from("&[\n");
    for folder in sorted(&root)? {
        if !folder.is_dir() {
            continue;
        }
        println!("cargo:rerun-if-changed={}", folder.display());
        for file in sorted(&folder)? {
            if file.extension().is_some_and(|e| e == "safetensors") {
                let (task, name) = (folder.file_name(), file.file_stem());
                let text = |part: Option<&std::ffi::OsStr>| {
                    part.map(|p| p.to_string_lossy().into_owned())
                        .unwrap_or_default()
                };
                let path = fs::canonicalize(&file)?;
                let (task, name) = (text(task), text(name));
                writeln!(
                    list,
                    "Shipped {{ task: {task:?}, name: {name:?}, bytes: include_bytes!({path:?}) }},"
                )?;
            }
        }
    }
    list.push(']');
    fs::write(Path::new(&env::var("OUT_DIR")?).join("shipped.rs"), list)?;
    Ok(())
}

/// The entries of a folder by name, so that the list does not depend on the file system.
fn sorted(folder: &Path) -> Result<Vec<PathBuf>, Box<dyn Error>> {
    let mut entries = Vec::new();
    for entry in fs::read_dir(folder)? {
        entries.push(entry?.path());
    }
    entries.sort();
    Ok(entries)
}
