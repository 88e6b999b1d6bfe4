//! Merges comparisons: the shares of one, or several that belong together.

use std::path::{Path, PathBuf};

use asid_core::{Error, Result};

use crate::cell::{Cell, Failure};
use crate::document::Document;
use crate::settings::first_difference;
use crate::store::{CellTime, Kind, Store};

/// A comparison read from its folder.
#[derive(Clone, Debug)]
pub struct Part {
    /// Its folder.
    pub store: Store,
    document: Document,
    cells: Vec<Cell>,
    failures: Vec<Failure>,
    times: Vec<CellTime>,
}

impl Part {
    /// Reads a comparison's folder.
    ///
    /// # Errors
    /// When it is no folder of a comparison.
    pub fn read(folder: &Path) -> Result<Self> {
        let store = Store::new(folder);
        Ok(Self {
            document: Document::read(&store.config())?,
            cells: store.all(Kind::Cells)?,
            failures: store.all(Kind::Failures)?,
            times: store.all(Kind::Times)?,
            store,
        })
    }
}

/// Several comparisons merged into one.
#[derive(Clone, Debug)]
pub struct Merged {
    /// The smallest plan that contains all of them, and their settings.
    pub document: Document,
    /// Their cells, each one once.
    pub cells: Vec<Cell>,
    /// Failures of cells that no part has.
    pub failures: Vec<Failure>,
    /// Run times of cells, s.
    pub times: Vec<CellTime>,
    /// Stores that hold the settings to which cells refer by hash.
    pub stores: Vec<Store>,
}

/// Whether rows of different commits may stand in one table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Commits {
    /// All cells must be of one commit.
    One,
    /// The cells of a row must be of one commit; rows that differ say so.
    OneARow,
}

/// Merges comparisons.
///
/// # Errors
/// Where they do not belong together: different commits or engines, different settings, one name
/// for two methods, or two outcomes of one cell.
pub fn unite(parts: &[Part], commits: Commits) -> Result<Merged> {
    let Some(first) = parts.first() else {
        return Err(Error::Config {
            key: "--merge".into(),
            message: "names no folder".into(),
        });
    };
    let mut document = first.document.clone();
    let mut cells: Vec<(Cell, &Part)> = Vec::new();
    for part in parts {
        let refuse = |message: String| Error::File {
            path: part.store.root().to_owned(),
            message,
        };
        let other = &part.document;
        if other.settings != document.settings {
            let which = first_difference(&document.settings, &other.settings);
            return Err(refuse(format!(
                "was made with other settings than {}: {which}",
                name(first)
            )));
        }
        document
            .plan
            .union(&other.plan)
            .map_err(|e| refuse(format!("does not belong to {}: {e}", name(first))))?;
        for cell in &part.cells {
            let Some((same, whose)) = add(&cells, cell, part, commits).map_err(refuse)? else {
                cells.push((cell.clone(), part));
                continue;
            };
            if !same.is_same(cell) {
                return Err(refuse(format!(
                    "has another outcome than {} for one run: {}",
                    name(whose),
                    cell.key.words()
                )));
            }
        }
    }
    let cells: Vec<Cell> = cells.into_iter().map(|(cell, _)| cell).collect();
    let mut failures: Vec<Failure> = Vec::new();
    for failure in parts.iter().flat_map(|p| &p.failures) {
        let key = &failure.key;
        if !cells.iter().any(|c| c.key == *key) && !failures.iter().any(|f| f.key == *key) {
            failures.push(failure.clone());
        }
    }
    Ok(Merged {
        document,
        cells,
        failures,
        times: parts.iter().flat_map(|p| p.times.clone()).collect(),
        stores: parts.iter().map(|p| p.store.clone()).collect(),
    })
}

/// Checks that a cell is consistent with those that are there.
///
/// Returns the same cell among them, with the part that has it, or `None` where the cell is new.
fn add<'c>(
    there: &'c [(Cell, &'c Part)],
    cell: &Cell,
    part: &Part,
    commits: Commits,
) -> Result<Option<(&'c Cell, &'c Part)>, String> {
    let mut same = None;
    for (other, whose) in there {
        let (ours, theirs) = (&cell.versions, &other.versions);
        let one = commits == Commits::One || cell.key.arm_mate(&other.key);
        if one && (&ours.git, &ours.asid) != (&theirs.git, &theirs.asid) {
            return Err(format!(
                "was made by commit {} ({}), {} by {} ({})",
                ours.git,
                ours.asid,
                name(whose),
                theirs.git,
                theirs.asid
            ));
        }
        if cell.key.backend == other.key.backend && ours.engine != theirs.engine {
            return Err(format!(
                "was made on {}, {} on {}",
                ours.engine,
                name(whose),
                theirs.engine
            ));
        }
        if cell.key.arm_mate(&other.key) && cell.settings != other.settings {
            let tables = (
                whose.store.settings(&other.settings),
                part.store.settings(&cell.settings),
            );
            let which = match &tables {
                (Some(a), Some(b)) => first_difference(a, b),
                _ => format!("{} there, {} here", other.settings, cell.settings),
            };
            return Err(format!(
                "has other settings of {} on {} than {}: {which}",
                cell.key.method,
                cell.key.task,
                name(whose)
            ));
        }
        if cell.key == other.key {
            same = Some((other, *whose));
        }
    }
    Ok(same)
}

fn name(part: &Part) -> String {
    let root: PathBuf = part.store.root().to_owned();
    root.display().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::tests::{cell, key};
    use crate::plan::tests::plan;

    /// A folder with cells of these seeds, each modified by `change`.
    fn part(folder: &Path, seeds: &[u64], change: impl Fn(&mut Cell)) -> Part {
        let store = Store::new(folder);
        let mut document = Document {
            plan: plan(),
            settings: toml::Table::new(),
        };
        document.plan.check().unwrap();
        crate::store::write(&store.config(), &document.text().unwrap()).unwrap();
        for &seed in seeds {
            // Its parameters hold NaN.
            let mut made = cell(key("a", "x", "asid", seed), seed as f64, true);
            change(&mut made);
            store.keep(&made, None).unwrap();
        }
        Part::read(folder).unwrap()
    }

    /// Symptom: a merge of two folders with one run in common, of which a number was missing, found
    /// two outcomes of that run. Cause: NaN is not equal to NaN.
    #[test]
    fn parts_make_a_whole_and_equal_cells_count_once() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let a = part(&at("a"), &[5, 6], |_| {});
        let b = part(&at("b"), &[6, 7], |_| {});
        let merged = unite(&[a.clone(), b], Commits::One).unwrap();
        assert_eq!(merged.cells.len(), 3);
        assert_eq!(merged.document, a.document);
    }

    #[test]
    fn rows_of_other_commits_are_let_in_where_that_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let a = part(&at("a"), &[5], |_| {});
        let other = |c: &mut Cell| {
            c.versions.git = "d".into();
            c.key.method = "dr".into();
        };
        let b = part(&at("b"), &[5], other);
        let merged = unite(&[a.clone(), b], Commits::OneARow).unwrap();
        assert_eq!(merged.cells.len(), 2);
        // But not within one row.
        let b = part(&at("c"), &[6], |c| c.versions.git = "d".into());
        let said = unite(&[a, b], Commits::OneARow).unwrap_err().to_string();
        assert!(said.contains("commit d"), "{said}");
    }

    #[test]
    fn what_does_not_belong_together_is_refused_with_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let a = part(&at("a"), &[5], |_| {});
        let refused = |name: &str, seeds: &[u64], change: &dyn Fn(&mut Cell)| {
            let b = part(&at(name), seeds, change);
            unite(&[a.clone(), b], Commits::One)
                .unwrap_err()
                .to_string()
        };
        let said = refused("value", &[5], &|c| c.value = 9.0);
        assert!(
            said.contains("another outcome than") && said.contains("a for one run: "),
            "{said}"
        );
        assert!(said.contains("seed 5"), "{said}");
        let said = refused("commit", &[6], &|c| c.versions.git = "d".into());
        assert!(said.contains("commit d") && said.contains("by c"), "{said}");
        let said = refused("engine", &[6], &|c| c.versions.engine = "rapier 2".into());
        assert!(
            said.contains("rapier 2") && said.contains("rapier 1"),
            "{said}"
        );
        let said = refused("settings", &[6], &|c| c.settings = "1".into());
        assert!(said.contains("other settings of asid"), "{said}");
        let mut b = part(&at("given"), &[6], |_| {});
        b.document.settings = "[solver]\niterations = 3".parse().unwrap();
        let said = unite(&[a.clone(), b], Commits::One)
            .unwrap_err()
            .to_string();
        assert!(said.contains("solver"), "{said}");
        assert!(unite(&[], Commits::One).is_err());
    }
}
