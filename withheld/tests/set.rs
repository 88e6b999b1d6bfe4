//! A set of cases: the same seed gives the same bytes, the set is sealed, and no label shows beside
//! the studies.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asid_withheld::causes;
use asid_withheld::label::Label;
use asid_withheld::make::{Order, make, with_threads};
use asid_withheld::plan::Wanted;
use asid_withheld::seal::{Seal, commitment, digest, verify};
use asid_withheld::{Half, Result};

/// Number of cases in the set of this test.
const COUNT: usize = 6;

fn order(seed: u64) -> Order {
    Order {
        half: Half::Training,
        seed,
        count: COUNT,
        wanted: Wanted::default(),
    }
}

fn made(folder: &Path, seed: u64, threads: usize) -> Result<()> {
    let work = || make(folder, &order(seed), &[], &|| {});
    let made = with_threads(threads, work)?;
    assert_eq!(made.cases + made.left_out.len(), COUNT);
    Ok(())
}

/// All files below a folder, by their relative path.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut left = vec![folder.to_owned()];
    while let Some(path) = left.pop() {
        for entry in std::fs::read_dir(&path).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                left.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("inside").to_owned();
                found.insert(name, std::fs::read(&path).expect("a file"));
            }
        }
    }
    found
}

fn labels(folder: &Path) -> BTreeMap<String, Label> {
    let text = std::fs::read_to_string(folder.join("sealed/labels.json")).expect("labels");
    serde_json::from_str(&text).expect("labels")
}

#[test]
fn a_set_is_the_same_bytes_from_the_same_seed_and_sealed() -> Result<()> {
    let folder = tempfile::tempdir().expect("a folder");
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    made(&a, 7, 1)?;
    made(&b, 7, 2)?;
    assert!(files(&a) == files(&b), "two runs of one seed differ");
    reveals_nothing(&a);
    for (case, label) in labels(&a) {
        // The shares of the signals add up to 1; below, each cause alone reaches its share of the
        // target.
        let sum: f64 = label.signals.values().sum();
        assert!(
            label.signals.is_empty() || (sum - 1.0).abs() < 1e-9,
            "{case}"
        );
        // Places divide the same shares further.
        let places: f64 = label.places.iter().map(|p| p.share).sum();
        assert!(places <= 1.0 + 1e-9 && label.places.is_empty() == label.signals.is_empty());
        for place in &label.places {
            assert!(place.share <= label.signals[&place.signal] + 1e-9, "{case}");
        }
        // A joint has one transmission: what the label lists is in the world.
        let transmits = |effect: &str| ["backlash", "joint-compliance"].contains(&effect);
        for dirt in label.dirt.iter().filter(|d| transmits(&d.effect)) {
            let clashes = |e: &String| {
                e.split_once('@')
                    .is_some_and(|(effect, site)| transmits(effect) && site == dirt.site)
            };
            assert!(!label.effects.iter().any(clashes), "{case}");
        }
        let share = label.target_gap / (label.own_gaps.len().max(1) as f64).sqrt();
        for (cause, gap) in &label.own_gaps {
            assert!(
                (gap / share).ln().abs() < 0.25,
                "{case}: {cause} has {gap} of {share}"
            );
        }
        assert_eq!(label.effects.is_empty(), label.kind == "none");
    }
    notices_changes(&a)?;
    // A complete set is never written to.
    assert!(made(&a, 7, 1).is_err());
    goes_on_where_it_was_interrupted(&a, &b)
}

/// Brings `b` into a state in which a run may be killed: two cases are complete, a third has no
/// label yet, and the rest is missing.
fn goes_on_where_it_was_interrupted(a: &Path, b: &Path) -> Result<()> {
    let remove = |path: PathBuf| std::fs::remove_file(path).expect("a file");
    for (number, (case, label)) in labels(a).iter().enumerate() {
        if number < 2 {
            let text = serde_json::to_string(label).expect("a label");
            std::fs::write(b.join("sealed").join(format!("{case}.json")), text).expect("a label");
        } else if number > 2 {
            std::fs::remove_dir_all(b.join("studies").join(case)).expect("a study");
        } else {
            std::fs::write(b.join("studies").join(case).join("train_9.part"), "tim").expect("half");
        }
    }
    remove(b.join("sealed/labels.json"));
    remove(b.join("studies/seal.json"));
    // Another seed makes another set.
    assert!(made(b, 8, 2).is_err());
    made(b, 7, 2)?;
    assert!(files(a) == files(b), "an interrupted set differs");
    Ok(())
}

/// Checks that the studies name no cause, no salt and no seed.
///
/// A diagnosis gets the studies alone. Trying labels must not reveal the label of a commitment.
fn reveals_nothing(folder: &Path) {
    let studies = folder.join("studies");
    let labels = labels(folder);
    let all = files(&studies);
    assert!(all.keys().all(|p| !p.ends_with("labels.json")));
    for (path, bytes) in &all {
        let text = String::from_utf8_lossy(bytes);
        for cause in causes::ALL {
            let name = cause.name().trim_start_matches("unknown:");
            // MJCF itself has words such as `mass` and `geometry`.
            let own = !name.contains('-');
            assert!(
                own || !text.contains(name),
                "{} says {name}",
                path.display()
            );
        }
        for label in labels.values() {
            assert!(
                !text.contains(&label.salt),
                "{} holds a salt",
                path.display()
            );
        }
    }
    let seal: Seal = serde_json::from_slice(&all[Path::new("seal.json")]).expect("a seal");
    for (case, label) in &labels {
        let study = study(&studies.join(case));
        assert_eq!(commitment(case, &digest(&study), label), seal.cases[case]);
        let guess = Label {
            salt: String::new(),
            ..label.clone()
        };
        assert_ne!(commitment(case, &digest(&study), &guess), seal.cases[case]);
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let sealed = std::fs::metadata(folder.join("sealed")).expect("a folder");
        assert_eq!(
            sealed.permissions().mode() & 0o077,
            0,
            "others can read the labels"
        );
    }
}

fn study(folder: &Path) -> BTreeMap<String, String> {
    files(folder)
        .into_iter()
        .map(|(name, bytes)| {
            let text = String::from_utf8(bytes).expect("text");
            (name.display().to_string(), text)
        })
        .collect()
}

/// Checks that a change of a label or a study after the sealing is found.
fn notices_changes(folder: &Path) -> Result<()> {
    let (studies, file) = (folder.join("studies"), folder.join("sealed/labels.json"));
    assert_eq!(verify(&studies, &file)?, Vec::<String>::new());
    let text = std::fs::read_to_string(&file).expect("labels");
    let mut changed = labels(folder);
    let (case, label) = changed.iter_mut().next().expect("a case");
    label.effects.push("magnus@nothing".into());
    let case = case.clone();
    let other = folder.join("changed.json");
    std::fs::write(&other, serde_json::to_string(&changed).expect("text")).expect("a file");
    assert!(verify(&studies, &other)?[0].starts_with(&case));
    changed.remove(&case);
    std::fs::write(&other, serde_json::to_string(&changed).expect("text")).expect("a file");
    assert!(verify(&studies, &other)?[0].contains("no label"));
    std::fs::write(&other, &text).expect("a file");
    assert!(verify(&studies, &other)?.is_empty());
    // Changes one digit of one reading.
    let log = studies.join(&case).join("test_0.csv");
    let before = std::fs::read_to_string(&log).expect("a log");
    std::fs::write(&log, before.replacen('7', "8", 1)).expect("a log");
    assert!(verify(&studies, &file)?[0].starts_with(&case));
    std::fs::write(&log, before).expect("a log");
    std::fs::remove_file(other).expect("a file");
    Ok(())
}
