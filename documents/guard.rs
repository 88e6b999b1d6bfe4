//! Guards calls of other crates' readers: a panic on damaged bytes becomes an error.

use std::panic::AssertUnwindSafe;

/// Calls a reader of files of kind `what`.
///
/// A panic means that the file is damaged in a way that the reader's authors did not consider. What
/// it had read so far is dropped.
///
/// # Errors
/// Returns the reader's error; after a panic, that the file is damaged.
pub fn guarded<T>(what: &str, read: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    let read = std::panic::catch_unwind(AssertUnwindSafe(read));
    read.unwrap_or_else(|_| Err(format!("is {what} that is damaged, or none")))
}

/// A message of another crate, joined to one line.
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
