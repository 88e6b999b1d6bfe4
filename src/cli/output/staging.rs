//! Folders in which a result is filled before it gets its name, and how leftovers of killed
//! processes are recognised.
//!
//! ```text
//! .asid-UNIQUE/lock       locked as long as the process that fills it lives
//! .asid-UNIQUE/content/   the result
//! .asid-UNIQUE/moves      names being moved from `content` into a folder that existed before
//! .asid-UNIQUE/replaced   a folder in whose place the result is put
//! ```
//!
//! The lock distinguishes leftovers from folders in use, also across containers and machines, where
//! process numbers repeat.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use asid_comparison::store::unique;

/// Prefix of such folders' names.
const PREFIX: &str = ".asid-";
const LOCK: &str = "lock";
const CONTENT: &str = "content";
const MOVES: &str = "moves";
const REPLACED: &str = "replaced";
/// Content of such a folder in the order of removal. The lock goes last, so that [`clear`]
/// recognises whatever a kill leaves.
const PARTS: [&str; 4] = [CONTENT, MOVES, REPLACED, LOCK];

/// Attempts to make a folder, which [`clear`] of another process may remove before it is locked.
/// Also attempts to rename it, since another process may take the name first.
const ATTEMPTS: usize = 10;

/// A folder that is being filled; dropping it removes it with its content.
pub struct Staging {
    root: PathBuf,
    /// Holds the lock.
    _lock: File,
}

impl Staging {
    /// Makes a staging folder beside its destination.
    pub fn new_in(folder: &Path) -> io::Result<Self> {
        let mut made = Self::try_new_in(folder);
        for _ in 1..ATTEMPTS {
            match &made {
                Err(e) if e.kind() == io::ErrorKind::NotFound => made = Self::try_new_in(folder),
                _ => break,
            }
        }
        made
    }

    fn try_new_in(folder: &Path) -> io::Result<Self> {
        let root = folder.join(format!("{PREFIX}{}", unique()));
        fs::create_dir(&root)?;
        let filled = || -> io::Result<File> {
            let lock = File::create_new(root.join(LOCK))?;
            // Without locks in the file system, leftovers there stay.
            let _ = lock.lock();
            fs::create_dir(root.join(CONTENT))?;
            Ok(lock)
        };
        match filled() {
            Ok(lock) => Ok(Self { root, _lock: lock }),
            Err(e) => {
                let _ = fs::remove_dir_all(&root);
                Err(e)
            }
        }
    }

    /// The folder to fill.
    pub fn content(&self) -> PathBuf {
        self.root.join(CONTENT)
    }

    /// Moves its content into a folder, in this order; [`clear`] undoes a move that was cut short.
    pub fn move_into(&self, folder: &Path, names: &[String]) -> io::Result<()> {
        let mut moves = File::create_new(self.root.join(MOVES))?;
        moves.write_all(names.join("\n").as_bytes())?;
        moves.sync_all()?;
        for name in names {
            fs::rename(self.content().join(name), folder.join(name))?;
        }
        Ok(())
    }

    /// Renames its content to a folder. An existing folder of that name is replaced as a whole, so
    /// that nobody sees a part of it.
    pub fn replace(&self, folder: &Path) -> io::Result<()> {
        let old = self.root.join(REPLACED);
        let mut tried = 0;
        loop {
            if let Err(e) = fs::rename(folder, &old)
                && e.kind() != io::ErrorKind::NotFound
            {
                return Err(e);
            }
            let Err(error) = fs::rename(self.content(), folder) else {
                return Ok(());
            };
            tried += 1;
            if tried == ATTEMPTS || !folder.exists() {
                let _ = fs::rename(&old, folder);
                return Err(error);
            }
            // Another process was faster: replace its folder in turn.
            let _ = fs::remove_dir_all(&old);
        }
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        remove(&self.root, &PARTS);
    }
}

/// Removes some parts of a folder, and the folder if it is then empty. What cannot be removed
/// stays.
fn remove(root: &Path, parts: &[&str]) {
    for part in parts.iter().map(|p| root.join(p)) {
        let _ = if part.is_dir() {
            fs::remove_dir_all(&part)
        } else {
            fs::remove_file(&part)
        };
    }
    let _ = fs::remove_dir(root);
}

/// Removes from a folder what killed processes left while they wrote into it. What cannot be
/// removed stays.
pub fn clear(folder: &Path) {
    let entries = fs::read_dir(folder).into_iter().flatten();
    for root in entries.filter_map(|e| Some(e.ok()?.path())) {
        let name = root.file_name().unwrap_or_default().to_string_lossy();
        if !name.starts_with(PREFIX) || !root.is_dir() {
            continue;
        }
        // A folder that was not locked yet is empty.
        if fs::remove_dir(&root).is_ok() {
            continue;
        }
        // Hold the lock until all is removed. Otherwise a process that is about to take it would
        // fill a folder that is being removed.
        let Some(_lock) = left(&root) else {
            continue;
        };
        undo_moves(folder, &root);
        remove(&root, &PARTS);
    }
}

/// Takes the lock if nobody holds it.
fn left(root: &Path) -> Option<File> {
    let lock = File::open(root.join(LOCK)).ok()?;
    lock.try_lock().is_ok().then_some(lock)
}

/// Removes files that were already moved, if other files were not moved.
fn undo_moves(folder: &Path, root: &Path) {
    let unmoved = fs::read_dir(root.join(CONTENT)).is_ok_and(|mut all| all.next().is_some());
    let Ok(moves) = fs::read_to_string(root.join(MOVES)) else {
        return;
    };
    for name in moves.lines().filter(|_| unmoved) {
        let (from, to) = (root.join(CONTENT).join(name), folder.join(name));
        // A file that is still here was not moved: a file of that name belongs to someone else.
        if from.exists() || Path::new(name).components().count() != 1 {
            continue;
        }
        let _ = if to.is_dir() {
            fs::remove_dir_all(&to)
        } else {
            fs::remove_file(&to)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder as left by a process that was killed after `moved` of two files.
    fn killed_after(moved: usize) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let staging = Staging::new_in(folder.path()).unwrap();
        for name in ["a.json", "result.json"] {
            fs::write(staging.content().join(name), name).unwrap();
        }
        fs::write(staging.root.join(MOVES), "a.json\nresult.json").unwrap();
        for name in &["a.json", "result.json"][..moved] {
            fs::rename(staging.content().join(name), folder.path().join(name)).unwrap();
        }
        // The lock ends with the process; the folder stays.
        let copy = folder.path().join(format!("{PREFIX}dead"));
        fs::rename(&staging.root, &copy).unwrap();
        drop(staging);
        folder
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_move_that_was_cut_short_is_undone_and_a_whole_one_stays() {
        for (moved, left) in [(0, &[][..]), (1, &[]), (2, &["a.json", "result.json"])] {
            let folder = killed_after(moved);
            clear(folder.path());
            assert_eq!(names(folder.path()), left, "killed after {moved}");
        }
    }

    /// Symptom: some runs that were killed as they began left a folder for good. Cause: the kill
    /// came while they removed a folder. Its lock was gone before its content, so nobody recognised
    /// it as left over.
    #[test]
    fn a_removal_that_was_cut_short_is_ended() {
        for removed in 0..=PARTS.len() {
            let folder = killed_after(2);
            remove(
                &folder.path().join(format!("{PREFIX}dead")),
                &PARTS[..removed],
            );
            clear(folder.path());
            let left = names(folder.path());
            assert!(
                !left.iter().any(|n| n.starts_with(PREFIX)),
                "{removed}: {left:?}"
            );
        }
    }

    /// Symptom: after a kill a case counted as answered and had no answer. Cause: the folder of the
    /// previous answer was removed file by file, and the file that marks it as done may go last.
    #[test]
    fn a_folder_is_replaced_as_a_whole_by_several_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let answer = folder.path().join("case");
        let write = |text: String| {
            for _ in 0..20 {
                clear(folder.path());
                let staging = Staging::new_in(folder.path()).unwrap();
                for name in ["result.json", "run.json"] {
                    fs::write(staging.content().join(name), &text).unwrap();
                }
                staging.replace(&answer).unwrap();
            }
        };
        std::thread::scope(|scope| {
            for n in 0..4 {
                scope.spawn(move || write(n.to_string()));
            }
        });
        assert_eq!(names(folder.path()), ["case"]);
        assert_eq!(names(&answer), ["result.json", "run.json"]);
        let read = |name: &str| fs::read_to_string(answer.join(name)).unwrap();
        assert_eq!(read("result.json"), read("run.json"));
    }

    #[test]
    fn what_is_in_use_and_what_is_not_ours_stays() {
        let folder = tempfile::tempdir().unwrap();
        let staging = Staging::new_in(folder.path()).unwrap();
        fs::write(folder.path().join("notes.txt"), "").unwrap();
        fs::create_dir(folder.path().join(".asid-empty")).unwrap();
        clear(folder.path());
        assert!(staging.content().is_dir());
        assert_eq!(names(folder.path()).len(), 2);
        drop(staging);
        assert_eq!(names(folder.path()), ["notes.txt"]);
    }
}
