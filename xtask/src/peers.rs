//! The Python side of `cargo xtask bench --peers`: a virtual environment of its own, 2.3 GB of
//! packages.

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::environment;
use crate::library::repository;

/// The Python of an environment in `folder` with every pinned package.
///
/// # Errors
/// If there is no Python with pip, or if a package is not available.
pub fn environment(folder: &Path) -> Result<PathBuf> {
    let list = repository().join("bench/peers/requirements.txt");
    environment::of(folder, &list, "2.3 GB; 4.2 GB laid out")
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn it_has_the_peers() {
        let list = repository().join("bench/peers/requirements.txt");
        environment::tests::assert_pinned(&list, &["mujoco", "stable-baselines3", "torch"]);
    }

    /// Both sides must run the same engine.
    #[test]
    fn the_peer_has_the_version_of_mujoco_that_is_linked() {
        let list = repository().join("bench/peers/requirements.txt");
        let version = crate::library::MUJOCO.wheels[0].version;
        let text = fs::read_to_string(list).unwrap();
        assert!(text.contains(&format!("\nmujoco=={version} ")));
    }
}
