//! Each method of a trait crosses the border to a plugin, including those with a default. A default
//! that answers for the other side would hide the other side's answer.

use std::collections::BTreeSet;
use std::path::Path;

/// A file of this repository.
fn source(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Names of the methods at the first level of indentation, in the first block whose line starts
/// with `begins`.
fn methods(text: &str, begins: &str) -> BTreeSet<String> {
    let block = text.lines().skip_while(|l| !l.starts_with(begins));
    let lines = block.skip(1).take_while(|l| *l != "}");
    let names = lines.filter_map(|l| l.strip_prefix("    fn "));
    let name = |l: &str| l.split(['(', '<']).next().unwrap_or_default().to_string();
    names.map(name).collect()
}

#[test]
fn each_method_of_a_trait_is_asked_of_the_other_side() {
    let algorithm = source("plugin/across/algorithm.rs");
    let engine = source("plugin/across/engine.rs");
    let task = source("plugin/across/task.rs");
    for (name, defined, across) in [
        ("Effect", "effects/effect.rs", &algorithm),
        ("Acting", "effects/effect.rs", &algorithm),
        ("Explorer", "asid-core/src/explore.rs", &algorithm),
        ("Policy", "asid-core/src/explore.rs", &algorithm),
        ("Identifier", "asid-core/src/identify.rs", &algorithm),
        ("TaskSolver", "asid-core/src/solve.rs", &algorithm),
        ("TaskPolicy", "asid-core/src/solve.rs", &algorithm),
        ("Progress", "asid-core/src/progress.rs", &algorithm),
        ("Backend", "asid-core/src/backend.rs", &engine),
        ("Model", "asid-core/src/backend.rs", &engine),
        ("Simulator", "asid-core/src/simulator.rs", &engine),
        ("Commander", "asid-core/src/task.rs", &task),
    ] {
        let all = methods(&source(defined), &format!("pub trait {name}"));
        assert!(!all.is_empty(), "{name} in {defined}");
        let crossing = ["", "<T>", "<'_>"].map(|of| format!("impl{of} {name} for Across"));
        let asked: BTreeSet<String> = crossing.iter().flat_map(|b| methods(across, b)).collect();
        let left: Vec<&String> = all.difference(&asked).collect();
        assert!(left.is_empty(), "{name}: {left:?} never cross the border");
    }
}
