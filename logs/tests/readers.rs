//! Logs written by public Python packages (`fixtures/make.py`) equal the CSV logs of the same
//! numbers; and no bytes make a reader panic.

#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use asid_core::Scene;
use asid_logs::episode::{of_table, wanted};
use asid_logs::propose::propose;
use asid_logs::{LogFormat, LogSettings, Opener};
use asid_mjcf::Plant;
use rand::{Rng as _, SeedableRng as _};

const EPISODES: [&str; 4] = ["train_0", "train_1", "train_2", "test_3"];

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

fn scene() -> Scene {
    let xml = std::fs::read_to_string(fixtures().join("nominal.xml")).unwrap();
    Scene::from_xml("two-axis", &xml, &[]).unwrap()
}

/// The episodes at some paths, under the proposed mapping.
fn imported(paths: &[PathBuf]) -> Vec<asid_core::Episode> {
    let scene = scene();
    let plant = Plant::of(&scene).unwrap();
    let mut opener = Opener::default();
    let one = |path: &PathBuf| {
        let settings = LogSettings::default();
        let log = opener.open(path, &settings).unwrap().remove(0);
        let kind = LogFormat::of(&asid_logs::open::split(path).0);
        let proposal = propose(&scene, &plant, (&log, kind), &[]).unwrap();
        assert!(
            proposal.missing_commands().is_empty(),
            "{:#?}",
            proposal.matches
        );
        let mappings = proposal.mappings();
        let [commands, readings] = wanted(&plant.layout, &mappings);
        let (table, _) = log.table(&commands, &readings, &[]);
        of_table(path, &table, &plant.layout, (&mappings, &[]))
            .unwrap()
            .0
    };
    paths.iter().map(one).collect()
}

/// Compares with the CSV logs; `off` is the largest relative error of a stored number.
fn assert_same(paths: &[PathBuf], off: f64) {
    let plant = Plant::of(&scene()).unwrap();
    for (episode, name) in imported(paths).iter().zip(EPISODES) {
        let csv = fixtures().join("csv").join(name).with_extension("csv");
        let wanted = asid_logs::episode::read(&csv, &plant.layout).unwrap();
        assert_eq!(episode.channels, wanted.channels, "{name}");
        assert_eq!(episode.rows(), wanted.rows(), "{name}");
        for (got, want, off) in [
            (&episode.time, &wanted.time, 1e-12),
            (&episode.ctrl, &wanted.ctrl, off),
            (&episode.readings, &wanted.readings, off),
        ] {
            for (x, y) in got.iter().zip(want) {
                assert!((x - y).abs() <= off, "{name}: {x} {y}");
            }
        }
    }
}

fn in_folder(folder: &str, ending: &str) -> Vec<PathBuf> {
    let of = |name: &&str| fixtures().join(folder).join(format!("{name}{ending}"));
    EPISODES.iter().map(of).collect()
}

#[test]
fn a_bag_in_sqlite_is_the_csv_log() {
    assert_same(&in_folder("bag_sqlite", ""), 0.0);
}

#[test]
fn a_bag_in_mcap_is_the_csv_log() {
    assert_same(&in_folder("bag_mcap", ""), 0.0);
}

#[test]
fn mcap_with_messages_of_its_own_definition_is_the_csv_log() {
    assert_same(&in_folder("mcap", ".mcap"), 0.0);
}

/// Single precision has 24 bits: 100 degrees have an error of 4e-6 degrees, 7e-8 rad.
#[test]
fn a_dataset_of_lerobot_is_the_csv_log_in_single_precision() {
    let paths: Vec<PathBuf> = (0..4)
        .map(|n| fixtures().join(format!("lerobot#{n}")))
        .collect();
    assert_same(&paths, 2e-7);
}

#[test]
fn a_topic_that_is_not_there_is_named() {
    let settings = LogSettings {
        topics: vec!["/joint_state".into()],
        ..LogSettings::default()
    };
    for path in [
        &in_folder("bag_sqlite", "")[0],
        &in_folder("mcap", ".mcap")[0],
    ] {
        let error = Opener::default()
            .open(path, &settings)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("`/joint_state`") && error.lines().count() == 1,
            "{error}"
        );
    }
}

/// Files, each with the name of its damaged copy, whose extension tells the kind.
fn files() -> [(PathBuf, &'static str); 4] {
    let at = |path: &str| fixtures().join(path);
    [
        (at("bag_sqlite/train_0/train_0.db3"), "a.db3"),
        (at("bag_mcap/train_0/train_0.mcap"), "a.mcap"),
        (at("mcap/train_0.mcap"), "b.mcap"),
        (at("lerobot/data/chunk-000/file-000.parquet"), "a.parquet"),
    ]
}

#[test]
fn cut_files_are_refused_or_read_but_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    for (file, name) in files() {
        let bytes = std::fs::read(&file).unwrap();
        let path = folder.path().join(name);
        let lengths = (0..40).map(|_| rng.random_range(0..bytes.len()));
        for length in [0, 1, 7, 8, 9, bytes.len() - 1].into_iter().chain(lengths) {
            std::fs::write(&path, &bytes[..length]).unwrap();
            let opened = Opener::default().open(&path, &LogSettings::default());
            if let Err(error) = &opened {
                assert_eq!(error.to_string().lines().count(), 1, "{error}");
            }
            // Whole pages of SQLite that are not read may be missing at the end.
            assert!(
                opened.is_err() || name.ends_with("db3"),
                "{name} cut to {length} bytes was read"
            );
        }
    }
}

#[test]
fn spoilt_files_never_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(12);
    for (file, name) in files() {
        let whole = std::fs::read(&file).unwrap();
        let path = folder.path().join(name);
        for _ in 0..60 {
            let mut bytes = whole.clone();
            for _ in 0..rng.random_range(1..40) {
                let at = rng.random_range(0..bytes.len());
                bytes[at] = rng.random();
            }
            std::fs::write(&path, &bytes).unwrap();
            if let Err(error) = Opener::default().open(&path, &LogSettings::default()) {
                assert_eq!(error.to_string().lines().count(), 1, "{error}");
            }
        }
    }
}

/// A page header states a list of 150 million elements without bytes, and similar lists.
///
/// `cargo xtask fuzz` found that `parquet` skips them one by one, for longer than 10 s. Both
/// readers of Parquet refuse the file at once, by what it states.
#[test]
fn a_parquet_file_that_states_more_than_there_is_is_refused_at_once() {
    let path = fixtures().join("skips.parquet");
    let began = std::time::Instant::now();
    let plant = Plant::of(&scene()).unwrap();
    let own = asid_logs::episode::read(&path, &plant.layout).unwrap_err();
    let other = Opener::default().open(&path, &LogSettings::default());
    for error in [own.to_string(), other.unwrap_err().to_string()] {
        assert!(
            error.contains("the page at byte 911 is damaged: a list states 148713840 elements")
                && error.lines().count() == 1,
            "{error}"
        );
    }
    // It takes milliseconds; the crate takes more than ten seconds for each.
    assert!(began.elapsed().as_secs_f64() < 5.0);
}
