//! The border to readers of other crates: a check of theirs that fails on damaged bytes is an error here.

use std::panic::AssertUnwindSafe;

/// Calls a reader of files that are `what`. Where it panics instead of returning an error, the file is damaged in a way that its
/// authors did not think of; what it had read so far is dropped with the error.
///
/// # Errors
/// What the reader says, and of a panic that the file is damaged.
pub fn guarded<T>(what: &str, read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let read = std::panic::catch_unwind(AssertUnwindSafe(read));
    read.unwrap_or_else(|_| Err(format!("is {what} that is damaged, or none")))
}

/// A message of another crate, folded to one line.
#[must_use]
pub fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_one_line() {
        let read = guarded("a table", || -> Result<(), String> {
            panic!("inner check")
        });
        assert_eq!(read.unwrap_err(), "is a table that is damaged, or none");
        assert_eq!(guarded("a table", || Ok(3)), Ok(3));
    }
}
