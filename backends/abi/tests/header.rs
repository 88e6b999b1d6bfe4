//! The header and the Rust table agree: the system's C compiler reports the offset of every field
//! and the value of every constant.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use asid_abi::table::{self, shapes};

const INCLUDE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/include");

fn compiler() -> String {
    std::env::var("CC").unwrap_or_else(|_| "cc".into())
}

fn compile(source: &str, name: &str, arguments: &[&str], folder: &Path) -> std::path::PathBuf {
    let file = folder.join(name);
    std::fs::write(&file, source).unwrap();
    let out = folder.join("out");
    let run = Command::new(compiler())
        .args(["-Wall", "-Wextra", "-Werror", "-pedantic", "-I", INCLUDE])
        .args(arguments)
        .arg("-o")
        .args([&out, &file])
        .output()
        .unwrap();
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    out
}

/// Runs a C program that prints `name=value` lines, and returns them.
fn printed(statements: &str) -> Vec<(String, u64)> {
    let folder = tempfile::tempdir().unwrap();
    let source = format!(
        "#include <stddef.h>\n#include <stdio.h>\n#include \"asid_backend.h\"\n\
         #define P(name, value) printf(\"%s=%llu\\n\", name, (unsigned long long)(value))\n\
         int main(void) {{\n{statements}return 0;\n}}\n"
    );
    let program = compile(&source, "print.c", &["-std=c99"], folder.path());
    let out = Command::new(program).output().unwrap();
    String::from_utf8(out.stdout)
        .unwrap()
        .lines()
        .map(|line| {
            let (name, value) = line.split_once('=').unwrap();
            (name.to_owned(), value.parse().unwrap())
        })
        .collect()
}

#[test]
fn every_structure_has_one_shape() {
    let mut statements = String::new();
    let mut ours = Vec::new();
    for shape in shapes() {
        let name = shape.name;
        writeln!(statements, "P(\"{name}\", sizeof({name}));").unwrap();
        ours.push((name.to_owned(), shape.size as u64));
        for (field, offset) in shape.fields {
            let c_field = field.trim_end_matches('_');
            writeln!(
                statements,
                "P(\"{name}.{field}\", offsetof({name}, {c_field}));"
            )
            .unwrap();
            ours.push((format!("{name}.{field}"), offset as u64));
        }
    }
    assert_eq!(printed(&statements), ours);
}

/// Checks that every field of the header is in the table: offsets alone would not reveal a field
/// missing at the end.
#[test]
fn every_structure_and_function_of_the_header_is_in_the_table() {
    let header = std::fs::read_to_string(format!("{INCLUDE}/asid_backend.h")).unwrap();
    let known: Vec<&str> = shapes().iter().map(|s| s.name).collect();
    let bodies =
        header.matches("\n} asid_").count() + header.matches("struct asid_scene {").count();
    assert_eq!(bodies, known.len(), "{known:?}");
}

#[test]
fn constants_agree() {
    let mut statements = String::new();
    let mut ours: Vec<(String, u64)> = Vec::new();
    let mut expect = |name: &str, value: u64| {
        writeln!(statements, "P(\"{name}\", {name});").unwrap();
        ours.push((name.to_owned(), value));
    };
    for (name, bit) in table::capabilities().iter_names() {
        expect(&format!("ASID_{name}"), bit.bits());
    }
    for (name, code) in [
        ("ASID_OK", table::OK),
        ("ASID_SCENE", table::SCENE),
        ("ASID_PARAMETER", table::PARAMETER),
        ("ASID_CONFIG", table::CONFIG),
        ("ASID_INCAPABLE", table::INCAPABLE),
        ("ASID_SHAPE", table::SHAPE),
        ("ASID_MISSING", table::MISSING),
        ("ASID_FAILED", table::FAILED),
        ("ASID_PANIC", table::PANIC),
        ("ASID_FREE", table::joint_kind::FREE),
        ("ASID_BALL", table::joint_kind::BALL),
        ("ASID_HINGE", table::joint_kind::HINGE),
        ("ASID_SLIDE", table::joint_kind::SLIDE),
        ("ASID_PLANE", table::geom_kind::PLANE),
        ("ASID_HEIGHT_FIELD", table::geom_kind::HEIGHT_FIELD),
        ("ASID_SPHERE", table::geom_kind::SPHERE),
        ("ASID_CAPSULE", table::geom_kind::CAPSULE),
        ("ASID_ELLIPSOID", table::geom_kind::ELLIPSOID),
        ("ASID_CYLINDER", table::geom_kind::CYLINDER),
        ("ASID_BOX", table::geom_kind::BOX),
        ("ASID_MESH", table::geom_kind::MESH),
        ("ASID_MOTOR", table::actuator_kind::MOTOR),
        ("ASID_POSITION", table::actuator_kind::POSITION),
        ("ASID_VELOCITY", table::actuator_kind::VELOCITY),
        ("ASID_OTHER", table::actuator_kind::OTHER),
        ("ASID_CHANNEL_SENSOR", table::channel_kind::SENSOR),
        ("ASID_CHANNEL_QPOS", table::channel_kind::QPOS),
        ("ASID_CHANNEL_QVEL", table::channel_kind::QVEL),
        ("ASID_CHANNEL_CONTACT", table::channel_kind::CONTACT),
    ] {
        expect(name, u64::try_from(code).unwrap());
    }
    expect("ASID_NONE", table::NONE);
    expect("ASID_ABI_MAJOR", table::ABI_MAJOR.into());
    expect("ASID_ABI_MINOR", table::ABI_MINOR.into());
    assert_eq!(printed(&statements), ours);
}

#[test]
fn the_header_is_c99_and_cpp() {
    let folder = tempfile::tempdir().unwrap();
    let source =
        "#include \"asid_backend.h\"\n#include \"asid_backend.h\"\nint main(void) { return 0; }\n";
    compile(source, "twice.c", &["-std=c99"], folder.path());
    compile(
        source,
        "twice.cpp",
        &["-x", "c++", "-std=c++17"],
        folder.path(),
    );
}
