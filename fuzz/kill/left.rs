//! The files that a killed command leaves.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};

/// Relative paths of the files below a path, sorted, without hidden ones.
///
/// For a file the list holds one empty path; for a missing path it is empty.
pub fn files(path: &Path) -> Result<Vec<String>> {
    let mut found = Vec::new();
    collect(path, "", &mut found)?;
    found.sort();
    Ok(found)
}

fn collect(path: &Path, way: &str, found: &mut Vec<String>) -> Result<()> {
    if path.is_file() {
        found.push(way.to_owned());
        return Ok(());
    }
    if !path.is_dir() {
        return Ok(());
    }
    for entry in fs::read_dir(path)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with('.') {
            collect(&entry.path(), &format!("{way}/{name}"), found)?;
        }
    }
    Ok(())
}

/// Hidden entries below a folder; entries inside hidden folders are not listed.
pub fn hidden(folder: &Path) -> Result<Vec<String>> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Ok(Vec::new());
    };
    let mut found = Vec::new();
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') {
            found.push(name);
        } else {
            found.extend(hidden(&entry.path())?);
        }
    }
    Ok(found)
}

/// Checks that every file below a path is complete.
pub fn check_files(path: &Path) -> Result<()> {
    for way in files(path)? {
        let file = if way.is_empty() {
            path.to_owned()
        } else {
            path.join(way.trim_start_matches('/'))
        };
        let bytes = fs::read(&file)?;
        whole(&file, &bytes)
            .with_context(|| format!("{way} is not whole ({} bytes)", bytes.len()))?;
    }
    Ok(())
}

/// Whether a file ends as its format requires.
fn whole(file: &Path, bytes: &[u8]) -> Result<()> {
    let ending = file.extension().unwrap_or_default().to_string_lossy();
    let text = || std::str::from_utf8(bytes);
    match &*ending {
        "json" => drop(serde_json::from_slice::<serde_json::Value>(bytes)?),
        "toml" => drop(toml::from_str::<toml::Table>(text()?)?),
        "html" => ensure!(
            text()?.trim_end().ends_with("</html>"),
            "no </html> at its end"
        ),
        "xml" => ensure!(
            text()?.trim_end().ends_with("</mujoco>"),
            "no </mujoco> at its end"
        ),
        "csv" => {
            let mut rows = text()?.lines().map(|l| l.split(',').count());
            let width = rows.next().context("it is empty")?;
            ensure!(
                rows.all(|w| w == width) && bytes.ends_with(b"\n"),
                "its last row is cut"
            );
        }
        "mcap" => ensure!(bytes.ends_with(b"\x89MCAP0\r\n"), "no mark at its end"),
        _ => ensure!(!bytes.is_empty(), "it is empty"),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_files_are_seen() {
        for (name, text) in [
            ("a.json", "{\"a\": [1, 2]}\n"),
            ("a.csv", "time,x\n0,1\n1,2\n"),
            ("a.html", "<html></html>\n"),
            ("a.xml", "<mujoco></mujoco>"),
        ] {
            assert!(whole(Path::new(name), text.as_bytes()).is_ok(), "{name}");
            let half = &text.as_bytes()[..text.trim_end().len() - 1];
            assert!(whole(Path::new(name), half).is_err(), "{name}");
        }
    }
}
