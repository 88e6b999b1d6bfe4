//! TOML in files that a user names.
//!
//! The parser follows nested brackets by recursion before it applies its own limit. A file of
//! nothing but `[` would end the process by a stack overflow. This module therefore counts the
//! brackets first.

use serde::de::{DeserializeOwned, Error as _};
use toml::de::Error;

use crate::guard::one_line;

/// Maximum number of open brackets: the parser's own limit, which it applies to values only after
/// it has found them.
const MAX_LEVELS: usize = 80;

/// Reads a value.
///
/// # Errors
/// If the text is no TOML, is no such value, or nests its brackets endlessly.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, Error> {
    if levels(text) > MAX_LEVELS {
        let message = format!("brackets are nested deeper than {MAX_LEVELS}: is one not closed?");
        return Err(Error::custom(message));
    }
    toml::from_str(text)
}

/// What is wrong with a text, on one line that begins with its line of the text.
#[must_use]
pub fn located(text: &str, error: &Error) -> String {
    let message = one_line(error.message());
    match error.span() {
        Some(span) => {
            let before = text.bytes().take(span.start);
            let line = before.filter(|&byte| byte == b'\n').count() + 1;
            format!("line {line}: {message}")
        }
        None => message,
    }
}

/// What is wrong with a value of a table that was read before, on one line that begins with the keys
/// that lead to it.
#[must_use]
pub fn keyed(error: &Error) -> String {
    let message = one_line(error.message());
    // The keys are only in the text that the library displays.
    let shown = error.to_string();
    let keys = shown.lines().last().and_then(|l| l.strip_prefix("in `"));
    match keys.and_then(|keys| keys.strip_suffix('`')) {
        Some(keys) => format!("`{keys}`: {message}"),
        None => message,
    }
}

/// Maximum number of simultaneously open brackets, outside of strings and comments.
///
/// For text that is no TOML it is at least the number that the parser follows.
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

/// Length of the quoted string at the start of `rest`. Without its end mark, a single-line string
/// ends with its line.
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

    /// Symptom: a refined model of 260 kB ended the process by a stack overflow. Cause: nested
    /// inline tables, which the parser follows by recursion.
    #[test]
    fn brackets_that_are_nested_without_end_are_refused() {
        for unit in ["[", "{", "a = [", "a = {b = ", "[{a="] {
            let text = format!("x = {}", unit.repeat(50_000));
            let error = read::<toml::Table>(&text).unwrap_err().to_string();
            assert!(error.contains("nested deeper than 80"), "{unit}: {error}");
        }
    }

    #[test]
    fn a_fault_names_its_line_or_its_key() {
        type Limits = std::collections::BTreeMap<String, std::collections::BTreeMap<String, f64>>;
        let text = "[limit]\nspeed = 1.0\nforce = \"a\"\n";
        let error = read::<Limits>(text).unwrap_err();
        assert!(
            located(text, &error).starts_with("line 3: invalid type"),
            "{error}"
        );
        let table: toml::Table = text.parse().unwrap();
        let error = table.try_into::<Limits>().unwrap_err();
        assert!(
            keyed(&error).starts_with("`limit.force`: invalid type"),
            "{error}"
        );
        let broken = "a = 1\nb = x\n";
        let error = read::<toml::Table>(broken).unwrap_err();
        assert!(located(broken, &error).starts_with("line 2: "), "{error}");
    }

    #[test]
    fn brackets_in_texts_and_comments_do_not_count() {
        let text = "a = [\"[[[\", '{{\\', '''[\n[''', \"\"\"\\\"[\"\"\"] # [[[[\nb = [[1], [2]]\n";
        assert_eq!(levels(text), 2);
        assert!(read::<toml::Table>(text).is_ok());
        // A string without an end mark does not hide the following lines.
        assert_eq!(levels("a = \"]]]\nb = [[["), 3);
        // Multi-byte characters after a backslash.
        assert_eq!(levels("a = \"\\é[\""), 0);
    }
}
