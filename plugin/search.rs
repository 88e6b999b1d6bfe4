//! Where plugins are searched: named files, the folders of `ASID_PLUGIN_PATH`, the user's data
//! folder, in this order.

use std::env;
use std::path::{Path, PathBuf};

use asid_core::{Error, Result};

/// Folders and files, separated as in `PATH`.
pub const VARIABLE: &str = "ASID_PLUGIN_PATH";

/// A place that is searched without being named in the call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// A folder, or a file of [`VARIABLE`].
    pub path: PathBuf,
    /// The setting that names it.
    pub from: &'static str,
}

/// All places, in order, whether they exist or not.
#[must_use]
pub fn places() -> Vec<Place> {
    let listed = env::var_os(VARIABLE).unwrap_or_default();
    let mut places: Vec<Place> = env::split_paths(&listed)
        .filter(|p| !p.as_os_str().is_empty())
        .map(|path| Place {
            path,
            from: VARIABLE,
        })
        .collect();
    places.extend(data_folder().map(|path| Place {
        path,
        from: "the user's data folder",
    }));
    places
}

/// `$XDG_DATA_HOME/asid/plugins`, or else `~/.local/share/asid/plugins`.
fn data_folder() -> Option<PathBuf> {
    let set = |name| env::var_os(name).map(PathBuf::from);
    let home = set("XDG_DATA_HOME").filter(|p| p.is_absolute());
    let home = home.or_else(|| Some(set("HOME")?.join(".local/share")))?;
    Some(home.join("asid/plugins"))
}

/// Files of a place that could be plugins, sorted by name. The data folder may be absent.
///
/// # Errors
/// [`Error::File`] when a named place does not exist or cannot be read.
pub fn files(place: &Place) -> Result<Vec<PathBuf>> {
    let path = &place.path;
    if path.is_file() {
        return Ok(vec![path.clone()]);
    }
    let wrong = |message: String| Error::File {
        path: path.clone(),
        message,
    };
    let entries = match std::fs::read_dir(path) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            if place.from == VARIABLE {
                return Err(wrong(format!("named by {VARIABLE}, but is not there")));
            }
            return Ok(Vec::new());
        }
        Err(e) => return Err(wrong(e.to_string())),
    };
    let mut files: Vec<PathBuf> = entries
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| is_library(p))
        .collect();
    files.sort();
    Ok(files)
}

/// Whether a file has this platform's name of a shared library.
fn is_library(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.ends_with(env::consts::DLL_SUFFIX) && path.is_file()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_gives_its_libraries_sorted_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let suffix = env::consts::DLL_SUFFIX;
        for name in [
            format!("b{suffix}"),
            format!("a{suffix}"),
            "notes.txt".into(),
        ] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        std::fs::create_dir(folder.path().join(format!("c{suffix}"))).unwrap();
        let place = |path: &Path, from| Place {
            path: path.to_owned(),
            from,
        };
        let found = files(&place(folder.path(), VARIABLE)).unwrap();
        let names: Vec<_> = found.iter().filter_map(|p| p.file_name()).collect();
        assert_eq!(names, [&*format!("a{suffix}"), &*format!("b{suffix}")]);
        assert_eq!(
            files(&place(&found[0], VARIABLE)).unwrap(),
            [found[0].clone()]
        );
        let absent = folder.path().join("absent");
        assert!(files(&place(&absent, VARIABLE)).is_err());
        assert!(files(&place(&absent, "elsewhere")).unwrap().is_empty());
    }
}
