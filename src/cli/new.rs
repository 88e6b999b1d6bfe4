//! `asid new`: a folder with everything that a new plugin needs to be built.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Result;
use asid_core::Error;
use asid_core::registry::{self, BackendEntry, Entry, ExplorerEntry, Origin, TaskEntry};
use asid_effects::EffectEntry;
use clap::builder::{PossibleValue, PossibleValuesParser};

use super::output::{OutFolder, staging};

/// Arguments of `new`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Start a plugin of this kind
    #[arg(value_parser = PossibleValuesParser::new(KINDS.iter().map(Kind::value)))]
    kind: String,
    /// Write this folder; it must be empty or not exist. Its name becomes the plugin's
    dir: PathBuf,
    /// Depend on the crates in this checkout of ASID; it must be of the revision that `asid doctor`
    /// shows [default: the one that this program was built from]. The paths that are written lead
    /// there from the new folder
    #[arg(long, value_name = "CHECKOUT")]
    sources: Option<PathBuf>,
}

/// A kind of plugin to start from.
struct Kind {
    name: &'static str,
    about: &'static str,
    /// Text in the files that holds the plugin's name, and its replacement, with `{}` for the new
    /// name.
    rename: (&'static str, &'static str),
    /// The example's folder below `plugins`.
    example: &'static str,
    /// Whether a name belongs to something built in, so that a plugin would be listed under another
    /// name.
    taken: fn(&str) -> bool,
    /// Whether it is a Cargo package, which refers to crates of this repository by their folders.
    cargo: bool,
    /// Names and contents of the files.
    files: &'static [(&'static str, &'static str)],
}

/// The interface of engines.
const HEADER: (&str, &str) = (
    "asid_backend.h",
    include_str!("../../backends/abi/include/asid_backend.h"),
);

/// The guide to writing an engine.
const ENGINE_GUIDE: (&str, &str) = ("GUIDE.md", include_str!("../../docs/add-a-backend.md"));

/// The versions of dependencies that this program was built with; a plugin in Rust needs the same.
const CARGO_LOCK: (&str, &str) = ("Cargo.lock", include_str!("../../Cargo.lock"));

/// The end of a plugin's manifest. Cargo takes a package below a workspace for a part of it, and
/// refuses it where the workspace does not name it; a checkout of ASID is a workspace.
const OWN_WORKSPACE: &str =
    "\n# A workspace of its own, so that it builds in any folder.\n[workspace]\n";

/// Folder of the sources that this program was built from, at build time.
const BUILT_FROM: &str = env!("CARGO_MANIFEST_DIR");

/// A file that identifies a folder as the sources.
const OF_SOURCES: &str = "asid-core/Cargo.toml";

/// All kinds of plugins. Their files are the examples themselves, which tests build and run.
const KINDS: &[Kind] = &[
    Kind {
        name: "engine-c",
        about: "a physics engine in one C file: rigid bodies in free flight",
        rename: ("\"flight\"", "\"{}\""),
        example: "engine-c",
        taken: is_built_in::<BackendEntry>,
        cargo: false,
        files: &[
            HEADER,
            ("engine.c", include_str!("../../plugins/engine-c/engine.c")),
            (
                "README.md",
                include_str!("../../plugins/engine-c/README.md"),
            ),
            ENGINE_GUIDE,
        ],
    },
    Kind {
        name: "mechanism-c",
        about: "a larger engine in C: trees of joints, drives and sensors, without contact",
        rename: ("\"mechanism\"", "\"{}\""),
        example: "mechanism-c",
        taken: is_built_in::<BackendEntry>,
        cargo: false,
        files: &[
            HEADER,
            (
                "engine.c",
                include_str!("../../plugins/mechanism-c/engine.c"),
            ),
            ("scene.c", include_str!("../../plugins/mechanism-c/scene.c")),
            (
                "dynamics.c",
                include_str!("../../plugins/mechanism-c/dynamics.c"),
            ),
            (
                "mechanism.h",
                include_str!("../../plugins/mechanism-c/mechanism.h"),
            ),
            (
                "README.md",
                include_str!("../../plugins/mechanism-c/README.md"),
            ),
            ENGINE_GUIDE,
        ],
    },
    Kind {
        name: "task",
        about: "a task in Rust: a payload is weighed by swinging it, then swung to an angle",
        rename: ("payload-swing", "{}"),
        example: "task-payload-swing",
        taken: is_built_in::<TaskEntry>,
        cargo: true,
        files: &[
            (
                "Cargo.toml",
                include_str!("../../plugins/task-payload-swing/Cargo.toml"),
            ),
            CARGO_LOCK,
            (
                "src/lib.rs",
                include_str!("../../plugins/task-payload-swing/src/lib.rs"),
            ),
            (
                "src/scene.xml",
                include_str!("../../plugins/task-payload-swing/src/scene.xml"),
            ),
            (
                "tests/needs_the_unknowns.rs",
                include_str!("../../plugins/task-payload-swing/tests/needs_the_unknowns.rs"),
            ),
            (
                "README.md",
                include_str!("../../plugins/task-payload-swing/README.md"),
            ),
            ("GUIDE.md", include_str!("../../docs/add-a-task.md")),
        ],
    },
    Kind {
        name: "explorer",
        about: "an explorer in Rust: sums of sines with random phases",
        rename: ("multisine", "{}"),
        example: "explorer-multisine",
        taken: is_built_in::<ExplorerEntry>,
        cargo: true,
        files: &[
            (
                "Cargo.toml",
                include_str!("../../plugins/explorer-multisine/Cargo.toml"),
            ),
            CARGO_LOCK,
            (
                "src/lib.rs",
                include_str!("../../plugins/explorer-multisine/src/lib.rs"),
            ),
            (
                "README.md",
                include_str!("../../plugins/explorer-multisine/README.md"),
            ),
            ("GUIDE.md", include_str!("../../docs/add-an-algorithm.md")),
        ],
    },
    Kind {
        name: "effect",
        about: "an effect in Rust: a magnet draws a joint to one place",
        rename: ("magnetic-catch", "{}"),
        example: "effect-magnetic-catch",
        taken: is_built_in::<EffectEntry>,
        cargo: true,
        files: &[
            (
                "Cargo.toml",
                include_str!("../../plugins/effect-magnetic-catch/Cargo.toml"),
            ),
            CARGO_LOCK,
            (
                "src/lib.rs",
                include_str!("../../plugins/effect-magnetic-catch/src/lib.rs"),
            ),
            (
                "tests/theory.rs",
                include_str!("../../plugins/effect-magnetic-catch/tests/theory.rs"),
            ),
            (
                "tests/late_command.rs",
                include_str!("../../plugins/effect-magnetic-catch/tests/late_command.rs"),
            ),
            (
                "README.md",
                include_str!("../../plugins/effect-magnetic-catch/README.md"),
            ),
            ("GUIDE.md", include_str!("../../docs/add-an-effect.md")),
        ],
    },
];

/// Whether something of this kind and name is linked in, or is part of other builds.
fn is_built_in<E: Entry>(name: &str) -> bool {
    let linked = |e: &E| matches!(e.origin(), Origin::Linked(_));
    registry::find::<E>(name).is_ok_and(linked) || super::list::missing(E::KIND, name).is_some()
}

impl Kind {
    fn value(&self) -> PossibleValue {
        PossibleValue::new(self.name).help(self.about)
    }

    /// The text of a file of the folder, adapted to the plugin's name.
    ///
    /// `sources` is the relative path to the sources.
    fn text(&self, file: &str, text: &str, (name, sources): (&str, &str)) -> String {
        let (from, to) = self.rename;
        let text = if Path::new(file).extension().is_some_and(|e| e == "md") {
            // A guide refers to files by the example's folder, which is the new folder.
            unlinked(&text.replace(&format!("plugins/{}/", self.example), ""))
        } else {
            text.to_owned()
        };
        let text = text.replace(from, &to.replace("{}", name));
        if !self.cargo {
            return text;
        }
        let (from_in_code, in_code) = (from.replace('-', "_"), name.replace('-', "_"));
        let text = if from_in_code == from {
            // A name of one word is the same in code, where it is replaced already. The file of a
            // library has the name in code.
            text.replace(&format!("lib{name}."), &format!("lib{in_code}."))
        } else {
            text.replace(&from_in_code, &in_code)
        };
        let text = text.replace("\"../../", &format!("\"{sources}/"));
        if file == "Cargo.toml" {
            text + OWN_WORKSPACE
        } else {
            text
        }
    }
}

/// A text in which links to other files of the repository become plain file names: outside the
/// repository the links are dead.
fn unlinked(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(middle) = rest.find("](") {
        let (before, after) = (&rest[..middle], &rest[middle + 2..]);
        let begin = before.rfind('[').filter(|b| !before[*b..].contains('\n'));
        let (Some(begin), Some(end)) = (begin, after.find(')')) else {
            plain.push_str(&rest[..middle + 2]);
            rest = after;
            continue;
        };
        let (words, target) = (&before[begin + 1..], &after[..end]);
        let file = target.split('#').next().unwrap_or_default();
        if target.contains("://") || file.is_empty() || target.contains(char::is_whitespace) {
            plain.push_str(&rest[..middle + 2 + end + 1]);
        } else {
            let place = file
                .strip_prefix("../")
                .map_or_else(|| format!("docs/{file}"), str::to_owned);
            plain.push_str(&before[..begin]);
            plain.push_str(&format!("{words} (`{place}` of ASID's repository)"));
        }
        rest = &after[end + 1..];
    }
    plain + rest
}

/// Writes the folder.
pub fn new(arguments: &Arguments) -> Result<()> {
    let kind = KINDS.iter().find(|k| k.name == arguments.kind);
    let kind =
        kind.ok_or_else(|| Error::unknown("kind", &arguments.kind, KINDS.iter().map(|k| k.name)))?;
    let dir = &arguments.dir;
    let name = plugin_name(dir)?;
    if (kind.taken)(&name) {
        let message = format!(
            "`{name}` is one of ASID's own, and the folder's name becomes the plugin's; choose another"
        );
        return Err(Error::File {
            path: dir.clone(),
            message,
        }
        .into());
    }
    let sources = sources(kind, arguments)?;
    prepare(dir)?;
    let to_sources = sources.map_or_else(String::new, |sources| way(dir, &sources));
    OutFolder::claim(Some(dir), "plugin")?.write(|staging| {
        for (file, text) in kind.files {
            let path = staging.join(file);
            std::fs::create_dir_all(path.parent().unwrap_or(staging))
                .and_then(|()| std::fs::write(&path, kind.text(file, text, (&name, &to_sources))))
                .map_err(|e| failed(&dir.join(file), &e))?;
        }
        Ok(())
    })?;
    let names: Vec<&str> = kind.files.iter().map(|(file, _)| *file).collect();
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}: {}", dir.display(), names.join(", "))?;
    writeln!(out, "README.md says how to build it and what to change")?;
    Ok(())
}

/// The sources that a plugin in Rust depends on; `None` for other plugins.
fn sources(kind: &Kind, arguments: &Arguments) -> Result<Option<PathBuf>> {
    if !kind.cargo {
        return Ok(None);
    }
    let refuse = |path: &Path, message: &str| Error::File {
        path: path.to_path_buf(),
        message: message.to_owned(),
    };
    let given = arguments.sources.as_deref();
    let path = given.unwrap_or(Path::new(BUILT_FROM));
    if path.join(OF_SOURCES).is_file() {
        return Ok(Some(path.to_path_buf()));
    }
    let error = match given {
        Some(path) => refuse(path, "is no checkout of ASID: it has no asid-core"),
        None => refuse(
            &arguments.dir,
            "a plugin in Rust depends on crates of ASID, and the sources that this program was built from are not on this machine: give \
             a checkout of the revision that `asid doctor` shows, --sources CHECKOUT",
        ),
    };
    Err(error.into())
}

/// The relative path from one folder to another, with `/` between its parts, such as `../..`.
fn way(from: &Path, to: &Path) -> String {
    let full = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let (from, to) = (full(from), full(to));
    let shared = from.components().zip(to.components());
    let shared = shared.take_while(|(a, b)| a == b).count();
    let up = from.components().skip(shared).map(|_| "..".to_owned());
    let down = to.components().skip(shared);
    let down = down.map(|c| c.as_os_str().to_string_lossy().into_owned());
    let parts: Vec<String> = up.chain(down).collect();
    match &*parts.join("/") {
        "" => ".".to_owned(),
        way => way.to_owned(),
    }
}

/// The plugin's name: the name of its folder.
fn plugin_name(dir: &Path) -> Result<String> {
    let refuse = |message: &str| Error::File {
        path: dir.to_path_buf(),
        message: message.to_owned(),
    };
    // Canonicalise first: `.` has a name too.
    let full = dir.canonicalize().unwrap_or_else(|_| dir.to_path_buf());
    let name = full
        .file_name()
        .and_then(|n| n.to_str())
        .unwrap_or_default();
    let fits = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if name.is_empty() || !name.chars().all(fits) || !name.starts_with(char::is_alphabetic) {
        let message = "its name becomes the plugin's: use a-z, 0-9 and -, a letter first";
        return Err(refuse(message).into());
    }
    Ok(name.to_owned())
}

/// Creates the folder, or checks that it is empty.
fn prepare(dir: &Path) -> Result<()> {
    let refuse = |message: &str| Error::File {
        path: dir.to_path_buf(),
        message: message.to_owned(),
    };
    staging::clear(dir);
    match std::fs::read_dir(dir) {
        Ok(mut entries) => match entries.next() {
            None => Ok(()),
            Some(_) => Err(refuse("holds something already; choose another folder").into()),
        },
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            Ok(std::fs::create_dir_all(dir).map_err(|e| failed(dir, &e))?)
        }
        Err(e) if e.kind() == std::io::ErrorKind::NotADirectory => {
            Err(refuse("is there already and is no folder; choose another name").into())
        }
        Err(e) => Err(failed(dir, &e).into()),
    }
}

fn failed(path: &Path, error: &std::io::Error) -> Error {
    Error::File {
        path: path.to_path_buf(),
        message: format!("cannot be written: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_to_the_sources_goes_up_and_down() {
        let root = tempfile::tempdir().unwrap();
        let [plugin, sources] = ["plugins/mine", "asid"].map(|p| root.path().join(p));
        for folder in [&plugin, &sources] {
            std::fs::create_dir_all(folder).unwrap();
        }
        assert_eq!(way(&plugin, &sources), "../../asid");
        assert_eq!(way(&sources.clone(), &sources), ".");
        assert_eq!(way(&sources, root.path()), "..");
    }
}
