//! `docs/effects.md` agrees with the catalogue in every parameter.

use std::collections::BTreeMap;

use asid::core::registry::all;
use asid::effects::{EffectEntry, EffectParameter, Start};

/// Words in code marks; `e0` … `e15` stands for all of them.
fn names(cell: &str) -> Vec<String> {
    let quoted: Vec<&str> = cell.split('`').skip(1).step_by(2).collect();
    let numbered = |word: &str| Some(word.strip_prefix('e')?.parse::<usize>().ok());
    if let [first, last] = quoted[..]
        && cell.contains('…')
    {
        let [first, last] = [first, last].map(|w| numbered(w).unwrap().unwrap());
        return (first..=last).map(|k| format!("e{k}")).collect();
    }
    quoted.into_iter().map(str::to_owned).collect()
}

/// Numbers of a cell.
fn numbers(cell: &str) -> Vec<f64> {
    let words = cell.split([' ', ',']);
    words.filter_map(|w| w.parse().ok()).collect()
}

/// Whether a cell matches how a search for a value begins.
fn tells(cell: &str, start: Start) -> bool {
    match start {
        Start::Slope => cell == "slope",
        Start::Given => cell == "given",
        Start::Multiples(_, values) => numbers(cell) == values,
        Start::Set(_, value) => cell.starts_with("kept at ") && numbers(cell) == [value],
        // The page describes these in words: signs, and numbers in a row.
        Start::Values(_) | Start::Choice(_) | Start::Places(_) => {
            !["slope", "given"].contains(&cell)
        }
    }
}

/// Rows of the page's tables: range, null value and start of each parameter, by effect and
/// parameter.
fn page() -> BTreeMap<(String, String), [String; 3]> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/effects.md");
    let text = std::fs::read_to_string(file).unwrap();
    let mut effect = String::new();
    let mut found = BTreeMap::new();
    for line in text.lines().filter(|l| l.starts_with("| ")) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        effect = names(cells[1]).into_iter().next().unwrap_or(effect);
        for parameter in names(cells[2]) {
            let row = [cells[4], cells[5], cells[6]].map(str::to_owned);
            let twice = found.insert((effect.clone(), parameter.clone()), row);
            assert!(
                twice.is_none(),
                "{effect}: `{parameter}` stands there twice"
            );
        }
    }
    found
}

#[test]
fn the_page_has_ranges_null_values_and_starts_of_the_catalogue() {
    let mut page = page();
    for entry in all::<EffectEntry>() {
        for parameter in (entry.make)().parameters() {
            let EffectParameter {
                name,
                range,
                null,
                start,
                ..
            } = *parameter;
            let said = page.remove(&(entry.name.to_owned(), name.to_owned()));
            let Some([ends, off, begins]) = said else {
                panic!("{}: `{name}` is not in the page", entry.name);
            };
            assert_eq!(numbers(&ends), range, "{}: range of `{name}`", entry.name);
            assert_eq!(numbers(&off), [null], "{}: null of `{name}`", entry.name);
            assert!(
                tells(&begins, start),
                "{}: `{name}` starts at {start:?}, and the page says {begins}",
                entry.name
            );
        }
    }
    assert!(page.is_empty(), "not in the catalogue: {:?}", page.keys());
}
