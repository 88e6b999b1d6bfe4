//! MCAP files, read message by message, so that memory holds one chunk of a file and not all of it.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use mcap::sans_io::LinearReaderOptions;

use crate::ros::topics::{Described, Topics};

/// Largest record or chunk, compressed or not, bytes: recorders write chunks of some MB, and a damaged length must not ask
/// for all memory.
const LARGEST_RECORD: usize = 1 << 29;

/// Reads the messages of a file.
///
/// # Errors
/// When the file is damaged or ends early.
pub fn read(path: &Path, topics: &mut Topics) -> Result<(), String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let options = LinearReaderOptions::default()
        .with_record_length_limit(LARGEST_RECORD)
        .with_validate_chunk_crcs(true);
    for message in mcap::io::MessageReader::new_with_options(BufReader::new(file), options) {
        let message = message.map_err(|e| match e {
            mcap::McapError::UnexpectedEof | mcap::McapError::BadMagic => {
                format!("{e}: the recording was cut off or is no MCAP; `mcap recover` of the MCAP tools mends what was cut off")
            }
            other => other.to_string(),
        })?;
        let channel = &message.channel;
        if !topics.wants(&channel.topic) {
            continue;
        }
        let schema = channel.schema.as_ref();
        let described = Described {
            kind: schema.map_or("", |s| &*s.name),
            encoding: &channel.message_encoding,
            schema: schema.map_or("", |s| &*s.encoding),
            text: schema.map_or(&[], |s| &*s.data),
        };
        let recorded = i64::try_from(message.log_time).unwrap_or(i64::MAX);
        topics.push(&channel.topic, described, recorded, &message.data);
    }
    Ok(())
}
