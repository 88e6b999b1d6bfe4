//! Tells the crate which compiler and sources it is built from. A plugin that is loaded at run time
//! must have the same compiler and the same sources of the crates whose types cross the border.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// Folders of the crates whose types cross the border, including this one.
const CROSSING: [&str; 4] = [".", "../asid-core", "../effects", "../mjcf"];

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=build.rs");
    let compiler = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(compiler).arg("--version").output()?.stdout;
    let version = String::from_utf8_lossy(&version).trim().to_owned();
    println!("cargo:rustc-env=ASID_COMPILER={version}");
    println!(
        "cargo:rustc-env=ASID_TARGET={}",
        env::var("TARGET").unwrap_or_default()
    );
    let mut files = Vec::new();
    for folder in CROSSING {
        println!("cargo:rerun-if-changed={folder}");
        sources(Path::new(folder), &mut files)?;
    }
    files.sort();
    let mut hash = Fnv::default();
    for file in &files {
        println!("cargo:rerun-if-changed={}", file.display());
        hash.add(file.to_string_lossy().as_bytes());
        hash.add(&fs::read(file)?);
    }
    println!("cargo:rustc-env=ASID_SOURCES={:016x}", hash.0);
    Ok(())
}

/// All files below a folder.
fn sources(folder: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            sources(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

/// The 64-bit hash FNV-1a of Fowler, Noll and Vo.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        let length = (bytes.len() as u64).to_le_bytes();
        for byte in length.iter().chain(bytes) {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}
