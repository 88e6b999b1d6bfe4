//! Valid files from which damaged ones are made, and the words in them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

/// Largest file of a corpus, bytes; larger files only make inputs slower.
const LARGEST_FILE: u64 = 1 << 16;
/// Range of the length of a word, bytes.
const WORD: std::ops::RangeInclusive<usize> = 2..=40;
/// Maximum number of words of a corpus.
const MOST_WORDS: usize = 2000;

/// Valid files of one format.
pub struct Corpus {
    /// The files.
    pub files: Vec<Vec<u8>>,
    /// Words of the format: names, and texts between delimiters.
    pub words: Vec<Vec<u8>>,
    /// Pieces that open a nesting level, such as `<body name="a">`.
    pub openings: Vec<Vec<u8>>,
}

impl Corpus {
    /// Reads files, and folders of files, by their paths from the repository's root.
    ///
    /// # Errors
    /// If a file cannot be read or is too large, or if there is none.
    pub fn read(ways: &[&str]) -> Result<Self> {
        let mut files = Vec::new();
        for way in ways {
            let path = root().join(way);
            let mut paths = vec![path.clone()];
            if path.is_dir() {
                let entries = std::fs::read_dir(&path)?;
                paths = entries.map(|e| Ok(e?.path())).collect::<Result<_>>()?;
                paths.retain(|p| p.is_file());
                paths.sort();
            }
            for path in paths {
                let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
                ensure!(
                    bytes.len() as u64 <= LARGEST_FILE,
                    "{} is larger than {LARGEST_FILE} bytes",
                    path.display()
                );
                files.push(bytes);
            }
        }
        ensure!(!files.is_empty(), "no files in {}", ways.join(", "));
        Ok(Self::of_files(files))
    }

    /// The corpus of some files.
    #[must_use]
    pub fn of_files(files: Vec<Vec<u8>>) -> Self {
        let (mut words, mut openings) = (BTreeSet::new(), BTreeSet::new());
        for file in &files {
            let part = |b: &u8| b.is_ascii_alphanumeric() || b"_.-/@".contains(b);
            for word in file.split(|b| !part(b)).filter(|w| WORD.contains(&w.len())) {
                words.insert(word.to_vec());
            }
            for line in file.split(|b| *b == b'\n') {
                let line = line.trim_ascii();
                let level =
                    line.starts_with(b"<") && line.ends_with(b">") || line.starts_with(b"[");
                if level && line.len() < 200 {
                    openings.insert([line, b"\n"].concat());
                }
            }
        }
        Self {
            files,
            words: words.into_iter().take(MOST_WORDS).collect(),
            openings: openings.into_iter().collect(),
        }
    }
}

/// The root of the repository.
#[must_use]
pub fn root() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.parent().unwrap_or(own).to_path_buf()
}
