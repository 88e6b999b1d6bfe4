//! Bags of ROS 2: a folder of one or more files of SQLite or MCAP, or one file of SQLite.
//!
//! The table `topics` has name and type of each topic, and `messages` the messages with their time
//! of receipt, ns. Since Iron, `message_definitions` has the text of each type. `metadata.yaml`
//! repeats the contents of the files and is not read.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use rusqlite::{Connection, OpenFlags};

use asid_documents::guard::guarded;

use crate::mcap_file;
use crate::ros::topics::{Described, Topics};

/// Reads the messages of a bag.
///
/// # Errors
/// When there is no file of messages, or one is damaged.
pub fn read(path: &Path, topics: &mut Topics) -> Result<(), String> {
    for file in files(path)? {
        let read = if has_ending(&file, "mcap") {
            mcap_file::read(&file, topics)
        } else {
            guarded("a bag of ROS 2", || sqlite(&file, topics))
        };
        read.map_err(|e| match file.file_name() {
            Some(name) if path.is_dir() => format!("{}: {e}", name.to_string_lossy()),
            _ => e,
        })?;
    }
    Ok(())
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case(ending))
}

/// The files of a bag, in the order of writing.
fn files(path: &Path) -> Result<Vec<PathBuf>, String> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = std::fs::read_dir(path).map_err(|e| e.to_string())?;
    let all: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    let mut found: Vec<PathBuf> = all
        .iter()
        .filter(|p| has_ending(p, "db3") || has_ending(p, "mcap"))
        .cloned()
        .collect();
    // `name_2` comes before `name_10`.
    found.sort_by_key(|p| (p.as_os_str().len(), p.clone()));
    if !found.is_empty() {
        return Ok(found);
    }
    Err(if all.iter().any(|p| has_ending(p, "zstd")) {
        "its files are compressed as a whole: `zstd -d` makes .db3 or .mcap of them".into()
    } else {
        "is a folder without meta/info.json (a LeRobot dataset) and without .db3 or .mcap files (a bag of ROS 2)".into()
    })
}

/// A topic of a file: name, type, encoding of its messages.
type Row = (String, String, String);

fn sqlite(path: &Path, topics: &mut Topics) -> Result<(), String> {
    let said = |e: rusqlite::Error| format!("is no bag of ROS 2 in SQLite, or a damaged one: {e}");
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let bag = Connection::open_with_flags(path, flags).map_err(said)?;
    // Accept tables only: a view could take arbitrarily long to answer.
    let tables = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages')";
    let tables: i64 = bag.query_row(tables, [], |row| row.get(0)).map_err(said)?;
    if tables != 2 {
        return Err("is no bag of ROS 2: it has no tables `topics` and `messages`".into());
    }
    let mut query = bag
        .prepare("SELECT id, name, type, serialization_format FROM topics")
        .map_err(said)?;
    let rows = query.query_map([], |row| {
        Ok((
            row.get::<_, i64>(0)?,
            (row.get(1)?, row.get(2)?, row.get(3)?),
        ))
    });
    let known: HashMap<i64, Row> = rows
        .map_err(said)?
        .collect::<Result<_, _>>()
        .map_err(said)?;
    let definitions = definitions(&bag);
    let mut query = bag
        .prepare("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp")
        .map_err(said)?;
    let mut rows = query.query([]).map_err(said)?;
    while let Some(row) = rows.next().map_err(said)? {
        let id: i64 = row.get(0).map_err(said)?;
        let Some((name, kind, encoding)) = known.get(&id) else {
            continue;
        };
        if !topics.wants(name) {
            continue;
        }
        let (schema, text) = match definitions.get(kind) {
            Some((schema, text)) => (&**schema, text.as_bytes()),
            None => ("", &[][..]),
        };
        let described = Described {
            kind,
            encoding,
            schema,
            text,
        };
        let stamp: i64 = row.get(1).map_err(said)?;
        let data = row.get_ref(2).map_err(said)?;
        let data = data.as_blob().map_err(|e| said(e.into()))?;
        topics.push(name, described, stamp, data);
    }
    Ok(())
}

/// Definitions by type: encoding and text. Bags of Humble and before have none.
fn definitions(bag: &Connection) -> HashMap<String, (String, String)> {
    let read = || -> rusqlite::Result<HashMap<String, (String, String)>> {
        let mut query = bag.prepare(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions",
        )?;
        let rows = query.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
        rows.collect()
    };
    read().unwrap_or_default()
}
