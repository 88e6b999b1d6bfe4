//! The engine of a crossed world.

use asid_core::registry::{BackendEntry, Origin, all};
use asid_core::{Capabilities, Error, Result};

/// Returns the linked engine other than `simulator` that has the capabilities a task needs.
///
/// # Errors
/// [`Error::Config`] where there is none, or more than one; the message says how to name one.
pub fn other_engine(simulator: &str, needed: Capabilities) -> Result<String> {
    let entries = all::<BackendEntry>().into_iter();
    let others = entries
        .filter(|e| e.name != simulator && matches!(e.origin, Origin::Linked(_)))
        .filter(|e| (e.make)().is_ok_and(|b| b.capabilities().contains(needed)))
        .map(|e| e.name)
        .collect();
    only(simulator, others)
}

fn only(simulator: &str, others: Vec<&str>) -> Result<String> {
    let message = match &others[..] {
        [one] => return Ok((*one).to_owned()),
        [] => format!(
            "no engine beside `{simulator}` is built in that can do what the task needs; name one with --real-backend, \
             or build with another (see `asid list`)"
        ),
        more => format!(
            "{} engines beside `{simulator}` can do what the task needs ({}): name one with --real-backend",
            more.len(),
            more.join(", ")
        ),
    };
    Err(Error::Config {
        key: "--world crossed".into(),
        message,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_other_engine_is_the_only_one_there_is() {
        assert_eq!(only("a", vec!["b"]).unwrap(), "b");
        for others in [vec![], vec!["b", "c"]] {
            let error = only("a", others.clone()).unwrap_err().to_string();
            assert!(error.contains("--real-backend"), "{error}");
            assert!(others.iter().all(|o| error.contains(o)), "{error}");
        }
    }
}
