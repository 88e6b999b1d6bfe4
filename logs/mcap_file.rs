//! MCAP files, read record by record: memory holds a record or a part of a chunk, not the file.
//!
//! The crate `mcap` finds the records and decompresses chunks. The three relevant kinds of records
//! are parsed here, since its own parser allocates whatever length a damaged record states.

use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read as _};
use std::path::Path;

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::LinearReaderOptions;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader};

use asid_documents::guard::guarded;

use crate::ros::topics::{Described, Topics};

/// Largest record, decompressed, bytes.
///
/// Recorders write messages of some MB, and a damaged length must not allocate all memory.
const LARGEST_RECORD: u64 = 1 << 29;
/// Largest ratio of a record's length to its file's.
///
/// lz4 compresses by at most 255 (its format), zstd by less on robots' logs.
const MOST_COMPRESSED: u64 = 1 << 10;
/// Bytes that are read at a time.
///
/// A record that states more than the file holds then takes no more memory than there are bytes.
const PIECE: usize = 1 << 16;

/// A file's description of a message type.
struct Schema {
    name: String,
    encoding: String,
    text: Vec<u8>,
}

/// A file's description of a topic.
struct Channel {
    topic: String,
    encoding: String,
    /// Number of its schema; 0 for none.
    schema: u16,
}

/// Reads the messages of a file.
///
/// # Errors
/// When the file is damaged or ends early.
pub fn read(path: &Path, topics: &mut Topics) -> Result<(), String> {
    guarded("an MCAP file", || read_records(path, topics))
}

fn read_records(path: &Path, topics: &mut Topics) -> Result<(), String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    let length = file.metadata().map_err(|e| e.to_string())?.len();
    let limit = length.saturating_mul(MOST_COMPRESSED).min(LARGEST_RECORD);
    let options = LinearReaderOptions::default()
        .with_record_length_limit(usize::try_from(limit).unwrap_or(usize::MAX))
        .with_validate_chunk_crcs(true);
    let (mut file, mut reader) = (
        BufReader::new(file),
        LinearReader::new_with_options(options),
    );
    let mut recording = Recording::default();
    while let Some(event) = reader.next_event() {
        match event.map_err(told)? {
            LinearReadEvent::ReadRequest(need) => {
                let piece = reader.insert(need.min(PIECE));
                let read = file.read(piece).map_err(|e| e.to_string())?;
                reader.notify_read(read);
            }
            LinearReadEvent::Record { opcode, data } => recording.take(opcode, data, topics)?,
        }
    }
    Ok(())
}

fn told(error: McapError) -> String {
    match error {
        McapError::UnexpectedEof | McapError::BadMagic => {
            format!(
                "{error}: the recording was cut off or is no MCAP; `mcap recover` of the MCAP tools mends what was cut off"
            )
        }
        other => other.to_string(),
    }
}

/// Descriptions read from a file so far.
#[derive(Default)]
struct Recording {
    schemas: HashMap<u16, Schema>,
    channels: HashMap<u16, Channel>,
}

impl Recording {
    /// Processes a record; other kinds are skipped ([MCAP,
    /// records](https://mcap.dev/spec#records)).
    fn take(&mut self, opcode: u8, data: &[u8], topics: &mut Topics) -> Result<(), String> {
        let mut fields = Fields(data);
        match opcode {
            op::SCHEMA => {
                let id = fields.u16()?;
                let schema = Schema {
                    name: fields.text()?,
                    encoding: fields.text()?,
                    text: fields.bytes()?.to_vec(),
                };
                self.schemas.insert(id, schema);
            }
            op::CHANNEL => {
                let (id, schema) = (fields.u16()?, fields.u16()?);
                let channel = Channel {
                    topic: fields.text()?,
                    encoding: fields.text()?,
                    schema,
                };
                self.channels.insert(id, channel);
            }
            op::MESSAGE => {
                let (id, _sequence) = (fields.u16()?, fields.u32()?);
                let (logged, _published) = (fields.u64()?, fields.u64()?);
                self.message(id, logged, fields.0, topics)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn message(
        &self,
        id: u16,
        logged: u64,
        data: &[u8],
        topics: &mut Topics,
    ) -> Result<(), String> {
        let channel = self.channels.get(&id);
        let channel = channel.ok_or_else(|| {
            format!("a message is of channel {id}, which the file does not describe")
        })?;
        if !topics.wants(&channel.topic) {
            return Ok(());
        }
        let schema = self.schemas.get(&channel.schema);
        if schema.is_none() && channel.schema != 0 {
            let (topic, id) = (&channel.topic, channel.schema);
            return Err(format!(
                "{topic} is of schema {id}, which the file does not describe"
            ));
        }
        let described = Described {
            kind: schema.map_or("", |s| &*s.name),
            encoding: &channel.encoding,
            schema: schema.map_or("", |s| &*s.encoding),
            text: schema.map_or(&[], |s| &*s.text),
        };
        let recorded = i64::try_from(logged).unwrap_or(i64::MAX);
        topics.push(&channel.topic, described, recorded, data);
        Ok(())
    }
}

/// The rest of a record. Numbers are little-endian; texts and bytes follow their 4-byte length.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self
            .0
            .split_at_checked(n)
            .ok_or("a record is shorter than what it states: the file is damaged")?;
        self.0 = rest;
        Ok(taken)
    }

    fn unsigned(&mut self, n: usize) -> Result<u64, String> {
        let bytes = self.take(n)?;
        Ok(bytes
            .iter()
            .rev()
            .fold(0, |sum, b| sum << 8 | u64::from(*b)))
    }

    fn u16(&mut self) -> Result<u16, String> {
        Ok(self.unsigned(2)? as u16)
    }

    fn u32(&mut self) -> Result<u32, String> {
        Ok(self.unsigned(4)? as u32)
    }

    fn u64(&mut self) -> Result<u64, String> {
        self.unsigned(8)
    }

    fn bytes(&mut self) -> Result<&'a [u8], String> {
        let n = usize::try_from(self.u32()?).map_err(|e| e.to_string())?;
        self.take(n)
    }

    fn text(&mut self) -> Result<String, String> {
        let bytes = self.bytes()?;
        let text = std::str::from_utf8(bytes)
            .map_err(|_| "a name in it is no UTF-8: the file is damaged")?;
        Ok(text.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: a file of 9 kB ended the process, "memory allocation of 4137475880 bytes failed".
    ///
    /// Cause: a channel stated a topic of 4 GB, which the crate's parser allocated before it looked
    /// for it.
    #[test]
    fn a_topic_of_4_gb_in_a_small_file_is_refused() {
        let mut bytes = vec![0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];
        let mut channel = vec![1, 0, 0, 0];
        channel.extend(u32::MAX.to_le_bytes());
        channel.extend(b"/topic");
        bytes.push(op::CHANNEL);
        bytes.extend((channel.len() as u64).to_le_bytes());
        bytes.extend(&channel);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        std::fs::write(&path, &bytes).unwrap();
        let error = read(&path, &mut Topics::new(&[])).unwrap_err();
        assert!(error.contains("shorter than what it states"), "{error}");
    }

    /// A stated record of a quarter of a gigabyte in a file of 17 bytes must not allocate that
    /// memory.
    #[test]
    fn a_record_longer_than_its_file_is_refused() {
        let mut bytes = vec![0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n', op::SCHEMA];
        bytes.extend((1_u64 << 28).to_le_bytes());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mcap");
        std::fs::write(&path, &bytes).unwrap();
        let error = read(&path, &mut Topics::new(&[])).unwrap_err();
        assert!(!error.is_empty() && error.lines().count() == 1, "{error}");
    }
}
