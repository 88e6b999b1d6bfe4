//! The pinned native libraries: the wheels that hold them, and the place of each file.
//!
//! Wheels of the Python package index are the only source of both libraries for every platform with
//! a published hash. The interpreter version in a pin only names the file; nothing of Python is
//! kept.

use std::env;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};

use crate::wheel::{Member, Wheel};

/// One native library: its wheels and its folder in the repository.
pub struct Library {
    /// Name for `--only`.
    pub name: &'static str,
    /// Folder under `.native/`.
    pub folder: &'static str,
    /// Environment variable through which the build finds it.
    pub variable: &'static str,
    /// Variable that, if it is set, makes the build look somewhere else.
    pub elsewhere: Option<&'static str>,
    /// A file, relative to the folder, that any installation has.
    pub landmark: &'static str,
    /// Wheels that hold its files.
    pub wheels: &'static [Wheel],
    /// Symbolic links to create: (link, its target in the same folder).
    pub links: &'static [(&'static str, &'static str)],
    /// Small files to write: (path, content).
    pub texts: &'static [(&'static str, &'static str)],
}

/// MuJoCo: the library under its own name, the name that the linker looks for, and the headers.
pub const MUJOCO: Library = Library {
    name: "mujoco",
    folder: "mujoco",
    variable: "MUJOCO_DYNAMIC_LINK_DIR",
    elsewhere: None,
    landmark: "libmujoco.so",
    wheels: &[Wheel {
        project: "mujoco",
        version: "3.17.0",
        sha256: "d66928d86a2d1b601bbaa4dc11db50214d17d5301bb8afd84721313b67ff0874",
        members: &[
            Member::file("mujoco/libmujoco.so.3.17.0", "libmujoco.so.3.17.0"),
            Member::folder("mujoco/include/", "include/"),
        ],
    }],
    links: &[("libmujoco.so", "libmujoco.so.3.17.0")],
    texts: &[],
};

/// libtorch for the CPU, from the CUDA build of PyTorch.
///
/// `libtorch_cpu.so` of that build needs two small CUDA libraries, hence the two further wheels.
/// `libtorch.so` is a linker script, so that nothing links the CUDA half. `build-version` lets
/// `torch-sys` check the version.
pub const TORCH: Library = Library {
    name: "torch",
    folder: "libtorch",
    variable: "LIBTORCH",
    elsewhere: Some("LIBTORCH_USE_PYTORCH"),
    landmark: "lib/libtorch_cpu.so",
    wheels: &[
        Wheel {
            project: "torch",
            version: "2.13.0",
            sha256: "60fcdcb2f3876e21146cb4524ef06397d727ca9ad5f020818547e25075fe3cb7",
            members: &[
                Member::file("torch/lib/libtorch_cpu.so", "lib/libtorch_cpu.so"),
                Member::file("torch/lib/libc10.so", "lib/libc10.so"),
                Member::file("torch/lib/libgomp.so.1", "lib/libgomp.so.1"),
                Member::folder("torch/include/", "include/"),
            ],
        },
        Wheel {
            project: "nvidia-cuda-cupti",
            version: "13.0.85",
            sha256: "4eb01c08e859bf924d222250d2e8f8b8ff6d3db4721288cf35d14252a4d933c8",
            members: &[Member::file(
                "nvidia/cu13/lib/libcupti.so.13",
                "lib/libcupti.so.13",
            )],
        },
        Wheel {
            project: "nvidia-cuda-runtime",
            version: "13.0.96",
            sha256: "7f82250d7782aa23b6cfe765ecc7db554bd3c2870c43f3d1821f1d18aebf0548",
            members: &[Member::file(
                "nvidia/cu13/lib/libcudart.so.13",
                "lib/libcudart.so.13",
            )],
        },
    ],
    links: &[],
    texts: &[
        ("lib/libtorch.so", "INPUT ( libtorch_cpu.so )\n"),
        ("build-version", "2.13.0\n"),
    ],
};

/// All libraries, in the order of set-up.
pub const ALL: [&Library; 2] = [&MUJOCO, &TORCH];

impl Library {
    /// Folder into which set-up lays this library out.
    pub fn path(&self) -> PathBuf {
        repository().join(".native").join(self.folder)
    }

    /// Text of the stamp file of a complete layout: every pin from which it was made.
    pub fn stamp(&self) -> String {
        self.wheels
            .iter()
            .map(|w| format!("{}=={} sha256:{}\n", w.project, w.version, w.sha256))
            .collect()
    }

    /// The installation that the user chose through the environment, if any.
    ///
    /// Cargo's own `[env]` table sets the same variable to [`Library::path`]; only another value
    /// comes from the user.
    pub fn chosen(&self) -> Option<String> {
        if let Some(variable) = self.elsewhere
            && env::var_os(variable).is_some()
        {
            return Some(format!("${variable}"));
        }
        let value = env::var_os(self.variable)?;
        let path = PathBuf::from(&value);
        (!value.is_empty() && !same(&path, &self.path())).then(|| path.display().to_string())
    }
}

/// The target folder, which holds this program.
pub fn target() -> Result<PathBuf> {
    let own = std::env::current_exe().context("cannot tell where this program lies")?;
    let folder = own.ancestors().nth(2).context("no target folder")?;
    Ok(folder.to_owned())
}

/// Root of the repository.
///
/// Cargo gives it at run time. A binary that is started by hand uses the place where it was built.
pub fn repository() -> PathBuf {
    let manifest = env::var_os("CARGO_MANIFEST_DIR")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")), PathBuf::from);
    manifest.parent().map_or(manifest.clone(), Path::to_owned)
}

/// Whether two paths name the same folder, which need not exist.
fn same(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a.components().eq(b.components()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_repository_holds_the_workspace() {
        assert!(repository().join("xtask/Cargo.toml").exists());
    }

    #[test]
    fn pins_are_complete() {
        for wheel in ALL.iter().flat_map(|l| l.wheels) {
            assert_eq!(wheel.sha256.len(), 64, "{}", wheel.project);
            assert!(wheel.sha256.bytes().all(|b| b.is_ascii_hexdigit()));
            assert!(!wheel.members.is_empty());
        }
    }

    #[test]
    fn paths_are_compared_by_what_they_name() {
        let folder = tempfile::tempdir().unwrap();
        assert!(same(folder.path(), &folder.path().join(".")));
        assert!(same(Path::new("/none/a/"), Path::new("/none/a")));
        assert!(!same(Path::new("/none/a"), Path::new("/none/b")));
    }
}
