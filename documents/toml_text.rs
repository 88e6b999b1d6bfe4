//! TOML of files that a user names.
//!
//! The parser follows brackets inside of brackets by recursion before its own limit says no, so that a file of nothing but `[`
//! would end the process by an overflow of the stack. They are counted before.

use serde::de::{DeserializeOwned, Error as _};
use toml::de::Error;

/// Brackets that may be open at a time: the parser's own limit, which it applies to values after it has found them.
const MAX_LEVELS: usize = 80;

/// Reads a value.
///
/// # Errors
/// When the text is no TOML, is not such a value, or its brackets are nested without end.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, Error> {
    if levels(text) > MAX_LEVELS {
        let message = format!("brackets are nested deeper than {MAX_LEVELS}: is one not closed?");
        return Err(Error::custom(message));
    }
    toml::from_str(text)
}

/// The most brackets that are open at a time, outside of texts and comments; of what is no TOML at least as many as the parser follows.
fn levels(text: &str) -> usize {
    let (mut open, mut most) = (0_usize, 0);
    let mut rest = text;
    while let Some(at) = rest.find(['[', '{', ']', '}', '"', '\'', '#']) {
        rest = &rest[at..];
        let skipped = match rest.as_bytes()[0] {
            b'[' | b'{' => {
                open += 1;
                most = most.max(open);
                1
            }
            b']' | b'}' => {
                open = open.saturating_sub(1);
                1
            }
            b'#' => rest.find('\n').unwrap_or(rest.len()),
            _ => text_length(rest),
        };
        rest = &rest[skipped..];
    }
    most
}

/// Length of the quoted text that `rest` begins with. One of a single line ends with its line, where its end mark is missing.
fn text_length(rest: &str) -> usize {
    let quote = &rest[..1];
    let (mark, single) = match rest.get(..3) {
        Some(three) if three == quote.repeat(3) => (three, false),
        _ => (quote, true),
    };
    let mut i = mark.len();
    while i < rest.len() {
        let here = &rest.as_bytes()[i..];
        if here.starts_with(mark.as_bytes()) {
            return i + mark.len();
        }
        match here[0] {
            b'\n' if single => return i,
            b'\\' if quote == "\"" && here.get(1) != Some(&b'\n') => i += 2,
            _ => i += 1,
        }
    }
    rest.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a refined model of 260 kB ended the process by an overflow of the stack. Cause: inline tables inside of
    /// each other, which the parser follows by recursion.
    #[test]
    fn brackets_that_are_nested_without_end_are_refused() {
        for unit in ["[", "{", "a = [", "a = {b = ", "[{a="] {
            let text = format!("x = {}", unit.repeat(50_000));
            let error = read::<toml::Table>(&text).unwrap_err().to_string();
            assert!(error.contains("nested deeper than 80"), "{unit}: {error}");
        }
    }

    #[test]
    fn brackets_in_texts_and_comments_do_not_count() {
        let text = "a = [\"[[[\", '{{\\', '''[\n[''', \"\"\"\\\"[\"\"\"] # [[[[\nb = [[1], [2]]\n";
        assert_eq!(levels(text), 2);
        assert!(read::<toml::Table>(text).is_ok());
        // A text without an end mark hides nothing of the lines behind it.
        assert_eq!(levels("a = \"]]]\nb = [[["), 3);
        // Signs of several bytes behind a backslash.
        assert_eq!(levels("a = \"\\é[\""), 0);
    }
}
