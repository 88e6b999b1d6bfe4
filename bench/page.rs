//! Tables, and the page that holds them between two markers.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

/// The marker lines around the text of `part`.
fn markers(part: &str) -> [String; 2] {
    ["begin", "end"].map(|place| format!("<!-- {part}: {place} -->"))
}

/// A titled table in Markdown, its columns aligned for reading as text.
pub fn table(title: &str, header: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let widths: Vec<usize> = (0..header.len())
        .map(|c| {
            let cells = rows.iter().map(|r| r[c].chars().count());
            cells.chain([header[c].chars().count()]).max().unwrap_or(0)
        })
        .collect();
    // Numbers are right-aligned, words left-aligned.
    let right: Vec<bool> = (0..header.len())
        .map(|c| {
            rows.iter()
                .all(|r| r[c].is_empty() || r[c].starts_with(|x: char| x.is_ascii_digit()))
        })
        .collect();
    let line = |cells: Vec<&str>| {
        let cells: Vec<String> = cells
            .iter()
            .enumerate()
            .map(|(c, text)| {
                let pad = " ".repeat(widths[c] - text.chars().count());
                if right[c] {
                    format!("{pad}{text}")
                } else {
                    format!("{text}{pad}")
                }
            })
            .collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let rules: Vec<String> = (0..header.len())
        .map(|c| {
            if right[c] {
                "-".repeat(widths[c] - 1) + ":"
            } else {
                "-".repeat(widths[c])
            }
        })
        .collect();
    let mut out = format!("### {title}\n\n");
    out += &line(header.to_vec());
    out += &line(rules.iter().map(String::as_str).collect());
    for row in rows {
        out += &line(row.iter().map(String::as_str).collect());
    }
    out + "\n"
}

/// A page whose text between the markers can be replaced.
pub struct Page {
    markers: [String; 2],
    before: String,
    after: String,
}

impl Page {
    /// Reads a page with markers of `part`, for example `<!-- bench: begin -->`.
    ///
    /// # Errors
    /// If it cannot be read or lacks a marker.
    pub fn read(path: &Path, part: &str) -> Result<Self> {
        let markers = markers(part);
        let [begin, end] = &markers;
        let text =
            fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let Some((before, (_, after))) = text
            .split_once(begin)
            .and_then(|(b, rest)| Some((b, rest.split_once(end)?)))
        else {
            bail!("{} has no lines `{begin}` and `{end}`", path.display());
        };
        Ok(Self {
            before: before.to_owned(),
            after: after.to_owned(),
            markers,
        })
    }

    /// Writes the page with `text` between the markers.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path, text: &str) -> Result<()> {
        let [begin, end] = &self.markers;
        let whole = format!(
            "{}{begin}\n{}\n{end}{}",
            self.before,
            text.trim_end(),
            self.after
        );
        fs::write(path, whole).with_context(|| format!("cannot write {}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_text_between_the_markers_changes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page.md");
        let page = |text: &str| {
            format!("above\n<!-- bench: begin -->\n{text}\n<!-- bench: end -->\nbelow\n")
        };
        fs::write(&path, page("old")).unwrap();
        let read = Page::read(&path, "bench").unwrap();
        read.write(&path, "new\n").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), page("new"));
        assert!(Page::read(&path, "peers").is_err());
    }

    #[test]
    fn columns_of_numbers_are_flush_right() {
        let rows = [vec!["a".into(), "7".into()], vec!["bc".into(), "10".into()]];
        let text = table("T", &["x", "n"], &rows);
        assert!(text.contains("| a  |  7 |\n| bc | 10 |\n"), "{text}");
    }
}
