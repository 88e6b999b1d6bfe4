//! Plugins of a call: those named and those found.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{Entry, Origin, find};
use asid_plugin::search;
use sha2::{Digest as _, Sha256};

use super::settings::{read_table, texts};

/// A plugin that was found in a folder but cannot be used.
#[derive(Clone, Debug)]
pub struct Refused {
    /// Its file, or the place that cannot be searched.
    pub path: PathBuf,
    /// The reason, in one line that names the file.
    pub why: String,
}

/// The result of searching the folders.
pub struct Searched {
    /// A line for each plugin that was loaded.
    pub found: Vec<String>,
    /// Plugins that cannot be used.
    pub refused: Vec<Refused>,
}

/// Files named in this call, with links resolved, in order.
static GIVEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Loads the named plugins, then those of the searched folders.
///
/// # Errors
/// When a named plugin cannot be used. Unusable plugins found in folders are returned.
pub fn load(named: &[PathBuf]) -> Result<Searched> {
    for path in named {
        let loaded = asid_plugin::load(path)?;
        let mut given = GIVEN.lock().unwrap_or_else(PoisonError::into_inner);
        if !given.iter().any(|p| p == loaded.file) {
            given.push(loaded.file.to_owned());
        }
    }
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    for place in search::places() {
        let files = search::files(&place).unwrap_or_else(|error| {
            refused.push(Refused {
                path: place.path.clone(),
                why: error.to_string(),
            });
            Vec::new()
        });
        for path in files {
            let before = asid_plugin::loaded().len();
            match asid_plugin::load(&path) {
                Ok(loaded) if asid_plugin::loaded().len() > before => {
                    found.push(said(&loaded, place.from));
                }
                Ok(_) => {}
                Err(error) => {
                    let why = error.to_string();
                    refused.push(Refused { path, why });
                }
            }
        }
    }
    Ok(Searched { found, refused })
}

/// Plugins that a configuration names. Their code would run, so the call must trust them, by
/// `--trust-plugins` or by naming the file itself.
///
/// # Errors
/// When the configuration cannot be read, its plugins are not trusted, or a file is not the one
/// that it records.
pub fn of_config(path: Option<&Path>, named: &[PathBuf], trusted: bool) -> Result<Vec<PathBuf>> {
    let Some(config) = path else {
        return Ok(Vec::new());
    };
    let recorded: Vec<Recorded> = texts(&read_table(config)?, "plugins")?
        .iter()
        .map(|text| Recorded::of(text))
        .collect();
    let is_named = |file: &Path| named.iter().any(|n| real(n) == real(file));
    let mut strange = recorded
        .iter()
        .filter(|r| !trusted && !is_named(&r.file))
        .peekable();
    if strange.peek().is_some() {
        let files: Vec<String> = strange.map(|r| r.file.display().to_string()).collect();
        return Err(Error::File {
            path: config.to_owned(),
            message: format!(
                "names plugins, whose code would run: {}; if you trust them, add --trust-plugins",
                files.join(", ")
            ),
        }
        .into());
    }
    for plugin in &recorded {
        plugin.check(config)?;
    }
    Ok(recorded.into_iter().map(|r| r.file).collect())
}

/// Separates a plugin's file from its hash in a configuration: `FILE#sha256=HEX`.
const HASH: &str = asid_comparison::settings::PLUGIN_HASH;

/// A plugin as a configuration records it.
struct Recorded {
    file: PathBuf,
    /// SHA-256 of the file, in hexadecimal; hand-written files may omit it.
    hash: Option<String>,
}

impl Recorded {
    fn of(text: &str) -> Self {
        match text.rsplit_once(HASH) {
            Some((file, hash)) => Self {
                file: file.into(),
                hash: Some(hash.to_lowercase()),
            },
            None => Self {
                file: text.into(),
                hash: None,
            },
        }
    }

    /// Checks that the file is the recorded one; a missing file is reported when it is loaded.
    fn check(&self, config: &Path) -> Result<()> {
        let (Some(wanted), Some(found)) = (&self.hash, sha256(&self.file)) else {
            return Ok(());
        };
        if found == *wanted {
            return Ok(());
        }
        Err(Error::Plugin {
            path: self.file.clone(),
            message: format!(
                "is not the library that {} was made with: its SHA-256 is {found}, and {wanted} is recorded; \
                 take that library, or remove `{HASH}…` there to use this one",
                config.display()
            ),
        }
        .into())
    }
}

/// A path with links resolved, where it exists.
fn real(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// SHA-256 of a file in hexadecimal; `None` where it cannot be read.
fn sha256(file: &Path) -> Option<String> {
    use std::fmt::Write as _;
    let mut hash = Sha256::new();
    std::io::copy(&mut std::fs::File::open(file).ok()?, &mut hash).ok()?;
    Some(
        hash.finalize()
            .iter()
            .fold(String::new(), |mut text, byte| {
                let _ = write!(text, "{byte:02x}");
                text
            }),
    )
}

/// Files with their hashes, in the form of a result's configuration.
pub fn recorded(files: Vec<PathBuf>) -> Vec<PathBuf> {
    let with_hash = |file: PathBuf| match sha256(&file) {
        Some(hash) => PathBuf::from(format!("{}{HASH}{hash}", file.display())),
        None => file,
    };
    files.into_iter().map(with_hash).collect()
}

/// One line on a plugin that nobody named in this call, with its parts.
fn said(loaded: &asid_plugin::Loaded, from: &str) -> String {
    let parts: Vec<String> = loaded
        .parts
        .iter()
        .map(|p| format!("{} `{}`", p.kind, p.name))
        .collect();
    format!(
        "loaded plugin {} from {from}: {}",
        loaded.file.display(),
        parts.join(", ")
    )
}

/// Files named in this call, and those that registered the parts in use.
pub fn used(parts: &[Option<&'static Path>]) -> Vec<PathBuf> {
    let mut files = GIVEN.lock().unwrap_or_else(PoisonError::into_inner).clone();
    for file in parts.iter().flatten() {
        if !files.iter().any(|f| f == file) {
            files.push(file.to_path_buf());
        }
    }
    files
}

/// File of the plugin that registered a name; `None` where no plugin did.
pub fn file_of<E: Entry>(name: &str) -> Option<&'static Path> {
    match find::<E>(name).ok()?.origin() {
        Origin::Loaded(file) => Some(file),
        Origin::Linked(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recorded_library_is_read_back_with_its_hash() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("lib#1.so");
        std::fs::write(&file, "abc").unwrap();
        let text = recorded(vec![file.clone()])[0].display().to_string();
        let read = Recorded::of(&text);
        assert_eq!(read.file, file);
        // FIPS 180-2, appendix B.1.
        let hash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(read.hash.as_deref(), Some(hash));
        assert!(read.check(Path::new("config.toml")).is_ok());
        std::fs::write(&file, "abd").unwrap();
        let error = read
            .check(Path::new("config.toml"))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("is not the library that config.toml was made with"),
            "{error}"
        );
        assert!(Recorded::of("lib#1.so").hash.is_none());
    }

    #[test]
    fn plugins_of_a_configuration_must_be_trusted_or_named() {
        let folder = tempfile::tempdir().unwrap();
        let (config, library) = (folder.path().join("c.toml"), folder.path().join("a.so"));
        std::fs::write(&library, "").unwrap();
        std::fs::write(&config, format!("plugins = ['{}']", library.display())).unwrap();
        let error = of_config(Some(&config), &[], false)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("a.so; if you trust them, add --trust-plugins"),
            "{error}"
        );
        for (named, trusted) in [(vec![], true), (vec![library.clone()], false)] {
            let files = of_config(Some(&config), &named, trusted).unwrap();
            assert_eq!(files, std::slice::from_ref(&library));
        }
    }
}
