//! Mappings that follow those of a study are those of its files.

use std::fmt::Write as _;
use std::path::Path;

use asid_logs::episode::{read_mapped, remapped};

use super::*;

const SCENE: &str = r#"<mujoco><worldbody><body name="b"><joint name="j" type="slide"/><geom size="0.1" mass="1"/></body></worldbody>
    <actuator><motor name="m" joint="j"/></actuator>
    <sensor><jointpos name="q" joint="j"/><framepos name="tip" objtype="xbody" objname="b"/></sensor></mujoco>"#;

/// Columns of a log beside its time and command: those of the model, and those of another stack.
const COLUMNS: [&str; 11] = [
    "q", "tip.0", "tip.1", "tip.2", "mocap.0", "mocap.1", "mocap.2", "x", "y", "z", "laser",
];

/// A study of two logs in a folder, whose columns are mapped.
pub(crate) fn study(folder: &Path, columns: &[ColumnMapping]) -> Study {
    let mut log = format!("time,ctrl.m,{}\n", COLUMNS.join(","));
    for row in 0..40 {
        let time = 0.01 * f64::from(row);
        write!(log, "{time:.2},0").unwrap();
        for pace in 1..=COLUMNS.len() {
            write!(log, ",{}", (pace as f64 * time).sin()).unwrap();
        }
        log.push('\n');
    }
    let mut text = "model = \"m.xml\"\ntrain = [\"a.csv\"]\ntest = [\"b.csv\"]\n".to_owned();
    for mapping in columns {
        writeln!(text, "{}", mapping.lines()).unwrap();
    }
    for (name, text) in [
        ("m.xml", SCENE),
        ("a.csv", &*log),
        ("b.csv", &*log),
        ("study.toml", &*text),
    ] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    Study::read(folder).unwrap()
}

fn of(name: &str, from: Option<&str>) -> ColumnMapping {
    ColumnMapping {
        from: from.map(str::to_owned),
        ..ColumnMapping::of(name)
    }
}

/// A mapping with a unit and an offset, m.
fn in_unit(mapping: ColumnMapping, unit: &str, offset: f64) -> ColumnMapping {
    ColumnMapping {
        unit: Some(unit.into()),
        offset,
        ..mapping
    }
}

/// The study's own mappings: of nothing, of a vector, of its entries, and of both.
fn own() -> [Vec<ColumnMapping>; 4] {
    let whole = || in_unit(of("tip", Some("mocap")), "mm", 0.0);
    let entries = ["x", "y", "z"].into_iter().enumerate();
    let entries = entries.map(|(i, from)| {
        let unit = ["mm", "cm", "m"][i];
        in_unit(of(&format!("tip.{i}"), Some(from)), unit, 0.1 * i as f64)
    });
    let one = in_unit(of("tip.1", Some("laser")), "cm", 0.2);
    [
        Vec::new(),
        vec![whole()],
        entries.collect(),
        vec![whole(), one],
    ]
}

/// Further mappings of the logs as they are read: all late, in another unit, one entry the other
/// way round, and two entries exchanged.
fn further() -> [Vec<ColumnMapping>; 4] {
    let late = ColumnMapping {
        delay: 0.03,
        ..of("tip", None)
    };
    let turned = ColumnMapping {
        sign: -1.0,
        ..of("tip.1", None)
    };
    let swapped = [of("tip.1", Some("tip.2")), of("tip.2", Some("tip.1"))];
    [
        vec![late],
        vec![in_unit(of("tip", None), "mm", 0.0)],
        vec![turned],
        swapped.into(),
    ]
}

/// Symptom: with the lines of the diagnosis in the study file, an entry was read in metres in place
/// of millimetres, its column was missing, or the vector was as late as before.
///
/// Cause: only a mapping of the same name was composed. That of the vector gives an entry its
/// column and unit, and those of entries precede a line for the vector.
#[test]
fn a_further_mapping_is_composed_with_that_of_its_vector_and_of_its_entries() {
    for own in own() {
        for further in further() {
            let folder = tempfile::tempdir().unwrap();
            let study = study(folder.path(), &own);
            let layout = Plant::of(&study.scene).unwrap().layout;
            let composed: Vec<ColumnMapping> = further
                .iter()
                .flat_map(|m| study.composed(m, &layout))
                .collect();
            let replaced = |m: &ColumnMapping| composed.iter().any(|c| c.name == m.name);
            let mut columns = own.clone();
            columns.retain(|m| !replaced(m));
            columns.extend(composed);
            let log = folder.path().join("a.csv");
            let (found, _) = read_mapped(&log, &layout, &columns).unwrap();
            let wanted = remapped(&study.train[0].1, &layout, (&further, &[])).unwrap();
            assert_eq!(found.channels, wanted.channels);
            for (x, y) in found.readings.iter().zip(&wanted.readings) {
                let same = (x - y).abs() < 1e-12 || (x.is_nan() && y.is_nan());
                assert!(same, "{x} {y}: {own:?} {further:?} {columns:?}");
            }
        }
    }
}

#[test]
fn a_mapping_whose_column_no_log_has_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path(), &[]);
    let file = folder.path().join("study.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text + &of("q", Some("joint")).lines()).unwrap();
    let said = Study::read(folder.path()).unwrap_err().to_string();
    assert!(said.contains("no log has a column `joint`"), "{said}");
    assert!(said.contains("study.toml") && said.lines().count() == 1);
}

/// Symptom: an error about the mass of a body named `geom/…`, which the study does not mention; of
/// two parameters for one mass it said "is named twice".
///
/// Cause: the mass of a body with a single geom is set by that geom, and messages have the name of
/// what is set.
#[test]
fn the_mass_of_a_body_is_named_in_errors_as_the_study_names_it() {
    let folder = tempfile::tempdir().unwrap();
    study(folder.path(), &[]);
    let file = folder.path().join("study.toml");
    let scene = SCENE.replace("<geom size", "<geom name=\"ball\" size");
    std::fs::write(folder.path().join("m.xml"), scene).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let parameter = |name: &str, target: &str| {
        format!("[[parameter]]\nname = \"{name}\"\ntarget = \"{target}\"\nrange = [0.5, 2]\n")
    };
    let body = parameter("load", "body/b/mass");
    std::fs::write(&file, format!("{text}{body}")).unwrap();
    let parameters = Study::read(folder.path()).unwrap().parameters;
    let of_engine = Error::Parameter {
        parameter: parameters[0].targets[0].to_string(),
        message: "-1 must be above 0".into(),
    };
    assert!(of_engine.to_string().contains("geom/ball"), "{of_engine}");
    let said = named_as_written(&parameters, of_engine).to_string();
    assert_eq!(said, "parameter `load`: -1 must be above 0");
    let geom = parameter("ball", "geom/ball/mass");
    std::fs::write(&file, format!("{text}{body}{geom}")).unwrap();
    let said = Study::read(folder.path()).unwrap_err().to_string();
    let expected = "parameters `load` and `ball` set the same value";
    assert!(said.contains(expected), "{said}");
}
