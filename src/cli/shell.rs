//! Commands as a shell reads them.

/// A word of a command, in quotes where a shell would split or change it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_=./,:@+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Words of a command in a row, each quoted where necessary.
pub fn line(words: impl IntoIterator<Item = impl AsRef<str>>) -> String {
    let words: Vec<String> = words.into_iter().map(|w| quoted(w.as_ref())).collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: "then: asid diagnose my study" names two arguments. Cause: a path was printed
    /// within a command as it is.
    #[test]
    fn a_path_with_spaces_is_one_word_of_a_command() {
        let command = ["asid", "diagnose", "my study", "it's", "größe/a.csv", ""];
        assert_eq!(
            line(command),
            r"asid diagnose 'my study' 'it'\''s' größe/a.csv ''"
        );
    }
}
