//! The dataclasses of the Python package agree with the layouts of `result.json`.
//!
//! `python/asid/results.py` is generated, and compared here.
//! `ASID_WRITE=1 cargo test --test python_types` writes it anew.

mod python_support;

use std::path::Path;

use python_support::Generator;

#[test]
fn the_dataclasses_of_python_are_those_of_the_results() {
    let mut generator = Generator::default();
    for schema in asid::cli::schemas::all() {
        generator.add(&schema);
    }
    let wanted = generator.text();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/asid/results.py");
    if std::env::var_os("ASID_WRITE").is_some() {
        std::fs::write(&file, &wanted).expect("the package can be written");
    }
    let found = std::fs::read_to_string(&file).unwrap_or_default();
    let differs = || {
        let lines = wanted.lines().zip(found.lines());
        let first = lines.enumerate().find(|(_, (a, b))| a != b);
        first.map_or("its length".to_owned(), |(i, (a, b))| {
            format!("line {}: it should be `{a}`, and is `{b}`", i + 1)
        })
    };
    assert!(
        found == wanted,
        "python/asid/results.py is not of these results: {}; write it anew by \
         ASID_WRITE=1 cargo test --test python_types",
        differs()
    );
}

#[test]
fn a_number_that_may_be_missing_and_one_that_may_be_infinite_differ() {
    let schema = serde_json::json!({"title": "Thing", "type": "object", "required": ["a", "b", "where"], "properties": {
        "a": {"type": "number", "description": "A number,\nin m."},
        "b": {"type": ["number", "null"]},
        "c": {"type": "array", "items": {"type": "number"}},
        "where": {"anyOf": [{"$ref": "#/$defs/Part"}, {"type": "null"}]},
        "schema": {"type": "integer"},
    }, "$defs": {"Part": {"type": "object", "required": ["n"], "properties": {"n": {"type": "string"}}}}});
    let mut generator = Generator::default();
    generator.add(&serde_json::from_value(schema).expect("a schema"));
    let text = generator.text();
    for line in [
        "    a: float\n    \"\"\"A number, in m.\"\"\"\n",
        "    b: float | None\n",
        "    c: Array | None = None\n",
        "    where: Part | None\n",
        "class Part(Record):\n",
        "class Thing(Result):\n",
    ] {
        assert!(text.contains(line), "{line:?} is not in {text}");
    }
}
