//! The repository's sources, for tests that read them.

use std::fs;
use std::path::{Path, PathBuf};

/// Root of the repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Source files below a folder, except those of tests, examples and builds. `crates` says whether
/// to include crates inside of it.
pub fn sources(folder: &Path, crates: bool) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() {
            let other = ["tests", "examples", "target"].contains(&name)
                || name.starts_with('.')
                || (!crates && path.join("Cargo.toml").exists());
            if !other {
                files.extend(sources(&path, crates));
            }
        } else if name.ends_with(".rs") && !name.ends_with("tests.rs") {
            files.push(path);
        }
    }
    files
}

/// A source without its module of tests.
pub fn untested(text: &str) -> &str {
    let opens = |(at, mark): (usize, &str)| {
        let rest = &text[at + mark.len()..];
        rest.lines()
            .next()
            .is_some_and(|l| l.ends_with("mod tests {"))
            .then_some(at)
    };
    let at = text.match_indices("#[cfg(test)]\n").find_map(opens);
    &text[..at.unwrap_or(text.len())]
}
