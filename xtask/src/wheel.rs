//! A pinned wheel: pip fetches it, its hash is checked, and it is opened as a zip file.

use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use sha2::{Digest, Sha256};

/// One file of the Python package index.
pub struct Wheel {
    /// Project name.
    pub project: &'static str,
    /// Exact version.
    pub version: &'static str,
    /// SHA-256 of the file, in lower-case hexadecimal.
    pub sha256: &'static str,
    /// Members that are extracted.
    pub members: &'static [Member],
}

/// A file or folder inside a wheel, and its place in the library's folder.
pub struct Member {
    from: &'static str,
    to: &'static str,
}

impl Member {
    /// A single file.
    pub const fn file(from: &'static str, to: &'static str) -> Self {
        Self { from, to }
    }

    /// All files under a folder; both names end in `/`.
    pub const fn folder(from: &'static str, to: &'static str) -> Self {
        Self { from, to }
    }

    /// Destination of `name` of the archive, if it belongs to this member.
    fn destination(&self, name: &str) -> Option<String> {
        if self.from.ends_with('/') {
            let rest = name.strip_prefix(self.from)?;
            return (!rest.is_empty()).then(|| format!("{}{rest}", self.to));
        }
        (name == self.from).then(|| self.to.to_owned())
    }
}

/// Platform tags of the pinned files: pip takes a file only if one of its tags is in this list.
const PLATFORMS: [&str; 7] = [
    "manylinux_2_28_x86_64",
    "manylinux_2_27_x86_64",
    "manylinux_2_25_x86_64",
    "manylinux_2_24_x86_64",
    "manylinux_2_17_x86_64",
    "manylinux2014_x86_64",
    "manylinux1_x86_64",
];

impl Wheel {
    /// Downloads the wheel into `folder`, checks the hash and returns its path.
    ///
    /// Python version and platforms are given, so that the file and its hash do not depend on the
    /// user's Python.
    pub fn fetch(&self, folder: &Path) -> Result<PathBuf> {
        let requirement = format!("{}=={}", self.project, self.version);
        let mut command = Command::new(python()?);
        command.args(["-m", "pip", "download", &requirement]);
        command.args(["--no-deps", "--only-binary=:all:", "--python-version=3.11"]);
        command.args(PLATFORMS.map(|p| format!("--platform={p}")));
        command.arg("--dest").arg(folder);
        let output = command
            .stdout(Stdio::inherit())
            .stderr(Stdio::piped())
            .output()
            .context("cannot start Python")?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            bail!("{requirement}: {}", pip_failure(&said));
        }
        let path = only_wheel(folder)?;
        self.verify(&path)?;
        Ok(path)
    }

    /// Compares the file's hash with the pin.
    pub fn verify(&self, path: &Path) -> Result<()> {
        let found = sha256(path)?;
        if found != self.sha256 {
            bail!(
                "{}=={}: SHA-256 is {found} and should be {}: the file is damaged or not the \
                 published one; clear pip's cache (python3 -m pip cache purge) and try again",
                self.project,
                self.version,
                self.sha256
            );
        }
        Ok(())
    }

    /// Copies the members of the wheel at `path` into `folder`.
    pub fn extract(&self, path: &Path, folder: &Path) -> Result<()> {
        let file = File::open(path).with_context(|| path.display().to_string())?;
        let mut archive = zip::ZipArchive::new(BufReader::new(file))?;
        let mut found = vec![false; self.members.len()];
        for index in 0..archive.len() {
            let mut entry = archive.by_index(index)?;
            if entry.is_dir() || entry.enclosed_name().is_none() {
                continue;
            }
            let place = self.members.iter().enumerate();
            let Some((member, to)) = place
                .filter_map(|(i, m)| Some((i, m.destination(entry.name())?)))
                .next()
            else {
                continue;
            };
            found[member] = true;
            let target = folder.join(to);
            if let Some(parent) = target.parent() {
                fs::create_dir_all(parent)?;
            }
            let mut out = File::create(&target).with_context(|| target.display().to_string())?;
            io::copy(&mut entry, &mut out).with_context(|| target.display().to_string())?;
            if entry.unix_mode().is_some_and(|mode| mode & 0o111 != 0) {
                make_executable(&out).with_context(|| target.display().to_string())?;
            }
        }
        match found.iter().position(|&f| !f) {
            Some(missing) => bail!(
                "{}=={} has no `{}`",
                self.project,
                self.version,
                self.members[missing].from
            ),
            None => Ok(()),
        }
    }
}

#[cfg(unix)]
fn make_executable(file: &File) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    file.set_permissions(fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn make_executable(_: &File) -> io::Result<()> {
    Ok(())
}

/// SHA-256 of a file in lower-case hexadecimal.
fn sha256(path: &Path) -> Result<String> {
    let mut file = File::open(path).with_context(|| path.display().to_string())?;
    let mut hasher = Sha256::new();
    io::copy(&mut file, &mut hasher).with_context(|| path.display().to_string())?;
    Ok(hasher
        .finalize()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect())
}

/// The Python with pip: `python3`, else `python`.
pub fn python() -> Result<&'static str> {
    for name in ["python3", "python"] {
        let answer = Command::new(name)
            .args(["-m", "pip", "--version"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status();
        if answer.is_ok_and(|status| status.success()) {
            return Ok(name);
        }
    }
    bail!(
        "no Python with pip (python3 -m pip): install it, or set MUJOCO_DYNAMIC_LINK_DIR and \
         LIBTORCH to libraries that you have"
    )
}

/// One line from pip's output, and advice for the user.
pub fn pip_failure(said: &str) -> String {
    let network = [
        "NewConnectionError",
        "ConnectTimeout",
        "Name or service not known",
        "name resolution",
        "ProxyError",
        "SSLError",
        // pip saw no file of the project: there is no index, or the folder is empty.
        "(from versions: none)",
    ];
    if network.iter().any(|sign| said.contains(sign)) {
        return "pip finds no package index that has it: check the network or set PIP_INDEX_URL, or \
                put the wheels in a folder and set PIP_NO_INDEX=1 PIP_FIND_LINKS=<folder>"
            .to_owned();
    }
    let line = said
        .lines()
        .find(|line| line.starts_with("ERROR:"))
        .or_else(|| said.lines().rfind(|line| !line.trim().is_empty()))
        .unwrap_or("it said nothing");
    format!("pip failed: {}", line.trim_start_matches("ERROR: "))
}

/// The only `.whl` in a folder into which pip has just written.
fn only_wheel(folder: &Path) -> Result<PathBuf> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "whl") {
            return Ok(path);
        }
    }
    bail!("pip wrote no wheel into {}", folder.display())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const WHEEL: Wheel = Wheel {
        project: "demo",
        version: "1.0",
        sha256: "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
        members: &[
            Member::file("demo/libdemo.so.1", "lib/libdemo.so.1"),
            Member::folder("demo/include/", "include/"),
        ],
    };

    fn archive(folder: &Path, names: &[&str]) -> PathBuf {
        let path = folder.join("demo.whl");
        let mut writer = zip::ZipWriter::new(File::create(&path).unwrap());
        for name in names {
            writer
                .start_file(*name, zip::write::FileOptions::default())
                .unwrap();
            writer.write_all(name.as_bytes()).unwrap();
        }
        writer.finish().unwrap();
        path
    }

    /// The test vector `abc` of FIPS 180-2, appendix B.1.
    #[test]
    fn a_hash_is_that_of_the_standard_and_a_changed_file_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("demo.whl");
        fs::write(&path, "abc").unwrap();
        WHEEL.verify(&path).unwrap();
        fs::write(&path, "abd").unwrap();
        let message = WHEEL.verify(&path).unwrap_err().to_string();
        assert!(message.contains("demo==1.0"), "{message}");
        assert!(message.contains("try again"), "{message}");
    }

    #[test]
    fn only_the_members_are_taken_and_each_goes_to_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let names = [
            "demo/libdemo.so.1",
            "demo/include/demo/a.h",
            "demo/tool.py",
            "demo/libdemo.so.12",
        ];
        let path = archive(folder.path(), &names);
        let out = folder.path().join("out");
        WHEEL.extract(&path, &out).unwrap();
        assert_eq!(
            fs::read_to_string(out.join("lib/libdemo.so.1")).unwrap(),
            names[0]
        );
        assert!(out.join("include/demo/a.h").exists());
        assert_eq!(fs::read_dir(out.join("lib")).unwrap().count(), 1);
        assert_eq!(fs::read_dir(&out).unwrap().count(), 2);
    }

    /// The extracted program must be executable; other files must not.
    #[cfg(unix)]
    #[test]
    fn a_program_can_be_started() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("demo.whl");
        let mut writer = zip::ZipWriter::new(File::create(&path).unwrap());
        for (name, mode) in [("demo/libdemo.so.1", 0o755), ("demo/include/a.h", 0o644)] {
            let options = zip::write::FileOptions::default().unix_permissions(mode);
            writer.start_file(name, options).unwrap();
        }
        writer.finish().unwrap();
        WHEEL.extract(&path, folder.path()).unwrap();
        let starts = |name: &str| {
            let about = fs::metadata(folder.path().join(name)).unwrap();
            about.permissions().mode() & 0o111 != 0
        };
        assert!(starts("lib/libdemo.so.1"));
        assert!(!starts("include/a.h"));
    }

    #[test]
    fn a_missing_member_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = archive(folder.path(), &["demo/include/a.h", "../../outside.h"]);
        let message = WHEEL
            .extract(&path, &folder.path().join("out"))
            .unwrap_err()
            .to_string();
        assert_eq!(message, "demo==1.0 has no `demo/libdemo.so.1`");
    }

    #[test]
    fn what_pip_says_becomes_one_line() {
        let message = pip_failure("WARNING: x\nERROR: No matching distribution found\n");
        assert_eq!(message, "pip failed: No matching distribution found");
        let message = pip_failure("ERROR: Could not find x (from versions: none)\n");
        assert!(message.contains("PIP_INDEX_URL"), "{message}");
        let message = pip_failure("... NewConnectionError('...'): failed\nERROR: No matching\n");
        assert!(message.contains("PIP_NO_INDEX"), "{message}");
        assert!(!pip_failure("").contains('\n'));
    }
}
