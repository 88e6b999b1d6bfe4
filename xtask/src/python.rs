//! `cargo xtask wheel`: the Python package as a wheel, and `cargo xtask python`: its tests.
//!
//! The wheel holds the module `asid._native`, which maturin builds. Beside it, in `asid/bin`, are
//! the program and MuJoCo's library; module and program look for it there. The bundled library is
//! the one with which this version was tested, whatever version of the package `mujoco` a user has.
//! Its name contains its version, so both can be loaded side by side. maturin's own bundling is
//! off, since it would add the library a second time.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::library::{MUJOCO, repository, target};
use crate::stage::{SHARED, Stages};
use crate::{environment, setup};

/// Build profile.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Profile {
    /// Profile of the tests, with which it shares the dependencies.
    Dev,
    /// Profile for users.
    Release,
}

impl Profile {
    fn name(self) -> &'static str {
        match self {
            Self::Dev => "dev",
            Self::Release => "release",
        }
    }

    /// Folder of the programs, below the target folder.
    fn folder(self) -> &'static str {
        match self {
            Self::Dev => "debug",
            Self::Release => "release",
        }
    }
}

/// Builds a wheel and prints its path.
pub fn wheel(arguments: &[String]) -> Result<bool> {
    if let Some(argument) = arguments.first() {
        bail!("unexpected argument `{argument}`; this subcommand takes none");
    }
    let path = build(Profile::Release)?;
    let size = fs::metadata(&path)?.len() as f64 / 1e6;
    println!("{:<8}{} ({size:.0} MB)", "wheel", path.display());
    Ok(true)
}

/// Runs the package's tests alone.
pub fn tests(arguments: &[String]) -> Result<bool> {
    let profile = match arguments {
        [] => Profile::Dev,
        [option] if option == "--release" => Profile::Release,
        _ => bail!("usage: cargo xtask python [--release]"),
    };
    let mut stages = Stages::default();
    stage(&mut stages, profile)?;
    Ok(stages.finish())
}

/// Adds the package's tests to other stages: the wheel in a fresh environment, and pytest in it.
pub fn stage(stages: &mut Stages, profile: Profile) -> Result<()> {
    let built = match maturin().and_then(|_| fresh()) {
        Ok(python) => python,
        Err(reason) => {
            stages.leave_out("python", &format!("{reason:#}"));
            return Ok(());
        }
    };
    stages.run("python", || {
        let wheel = build(profile)?;
        let install = [
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--no-input",
            "--no-deps",
            "--force-reinstall",
        ];
        environment::call(&built, &install, &[&wheel])?;
        let status = Command::new(&built)
            .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
            .arg(repository().join("python/tests"))
            // Outside the repository's folder, so that `asid` is the installed package.
            .current_dir(target()?)
            .env_remove("ASID")
            .env("ASID_REPOSITORY", repository())
            .status()
            .context("cannot start pytest")?;
        Ok(status.success())
    })?;
    Ok(())
}

/// The Python with the packages of the tests.
fn fresh() -> Result<PathBuf> {
    let list = repository().join("python/tests/requirements.txt");
    environment::of(&target()?.join("python/tests"), &list, "58 MB")
}

/// The Python with maturin.
fn maturin() -> Result<PathBuf> {
    let list = repository().join("python/requirements-build.txt");
    environment::of(&target()?.join("python/build"), &list, "11 MB")
}

/// Builds the wheel: first the program, then the module, which includes the program's folder.
fn build(profile: Profile) -> Result<PathBuf> {
    setup::run(&[&MUJOCO])?;
    let python = maturin()?;
    program(profile)?;
    let out = target()?.join("wheels").join(profile.name());
    if out.exists() {
        fs::remove_dir_all(&out).with_context(|| out.display().to_string())?;
    }
    let status = Command::new(&python)
        .args(["-m", "maturin", "build", "--quiet", "--locked"])
        .args(["--profile", profile.name(), "--auditwheel=skip"])
        .args(["--strip=true", "--manifest-path"])
        .arg(repository().join("python/Cargo.toml"))
        .arg("--interpreter")
        .arg(&python)
        .arg("--out")
        .arg(&out)
        .status()
        .context("cannot start maturin")?;
    if !status.success() {
        bail!("maturin cannot build the wheel; what it said stands above");
    }
    let entries = fs::read_dir(&out).with_context(|| out.display().to_string())?;
    let mut wheels = entries.filter_map(|e| Some(e.ok()?.path()));
    let wheel = wheels.find(|p| p.extension().is_some_and(|e| e == "whl"));
    wheel.with_context(|| format!("maturin wrote no wheel into {}", out.display()))
}

/// Builds the program and copies it, with MuJoCo's library, into the wheel's folder.
fn program(profile: Profile) -> Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    // The features of the tests without libtorch, whose 500 MB are too large for a wheel.
    let status = Command::new(cargo)
        .args(["build", "--package=asid", "--package=asid-python", SHARED])
        .args(["--bin=asid", "--features=mujoco,logs", "--locked"])
        .args(["--profile", profile.name()])
        .env("ASID_RELOCATABLE", "1")
        .current_dir(repository())
        .status()
        .context("cannot start cargo")?;
    if !status.success() {
        bail!("the program of the wheel cannot be built");
    }
    let folder = repository().join("python/asid/bin");
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let built = target()?.join(profile.folder()).join("asid");
    let program = folder.join("asid");
    copy(&built, &program)?;
    // Debug symbols are most of the file. Without the tool `strip` the wheel is only larger.
    let _ = Command::new("strip").arg(&program).status();
    let library = format!("libmujoco.so.{}", MUJOCO.wheels[0].version);
    let from = MUJOCO
        .chosen()
        .map_or_else(|| MUJOCO.path(), PathBuf::from)
        .join(&library);
    copy(&from, &folder.join(&library))
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::copy(from, to).with_context(|| format!("{} to {}", from.display(), to.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests_of_pins {
    use super::*;

    #[test]
    fn every_package_is_pinned_with_a_hash_and_no_index_is_named() {
        let folder = repository().join("python");
        let assert_pinned = environment::tests::assert_pinned;
        assert_pinned(&folder.join("requirements-build.txt"), &["maturin"]);
        assert_pinned(
            &folder.join("tests/requirements.txt"),
            &["gymnasium", "mujoco", "numpy", "pandas", "pytest"],
        );
    }
}
