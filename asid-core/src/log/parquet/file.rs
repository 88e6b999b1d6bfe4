//! A Parquet file whose footer and heads of pages are walked over before the crate `parquet` reads them.

use std::fs::File;
use std::io::{BufReader, Cursor, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use bytes::Bytes;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::reader::{ChunkReader, Length, SerializedFileReader};

use super::layouts::{FILE_META_DATA, PAGE_HEADER};
use super::thrift::Walk;
use crate::scene::one_line;

/// Length of what stands behind the footer: the footer's length in four bytes, and `PAR1`.
const TAIL: u64 = 8;

/// A Parquet file on disk.
pub struct ParquetFile(File);

impl ParquetFile {
    /// Opens a file and looks at its footer.
    ///
    /// # Errors
    /// When it cannot be read, or the footer is damaged.
    pub fn open(path: &Path) -> Result<SerializedFileReader<Self>, String> {
        let mut file = File::open(path).map_err(|e| e.to_string())?;
        walk_footer(&mut file).map_err(|e| format!("has a damaged footer: {e}"))?;
        SerializedFileReader::new(Self(file)).map_err(|e| one_line(&e.to_string()))
    }
}

/// Walks over the footer, where the file has one; where it has none the crate says so.
fn walk_footer(file: &mut File) -> Result<(), String> {
    let told = |e: std::io::Error| e.to_string();
    let length = file.metadata().map_err(told)?.len();
    let Some(end) = length.checked_sub(TAIL) else {
        return Ok(());
    };
    let mut tail = [0; 4];
    file.seek(SeekFrom::Start(end)).map_err(told)?;
    file.read_exact(&mut tail).map_err(told)?;
    let size = u64::from(u32::from_le_bytes(tail));
    let Some(start) = end.checked_sub(size) else {
        return Ok(());
    };
    let mut footer = Vec::new();
    file.seek(SeekFrom::Start(start)).map_err(told)?;
    file.take(size).read_to_end(&mut footer).map_err(told)?;
    Walk::new(Cursor::new(&footer), size).structure(FILE_META_DATA)
}

impl Length for ParquetFile {
    fn len(&self) -> u64 {
        self.0.len()
    }
}

impl ChunkReader for ParquetFile {
    type T = BufReader<File>;

    /// Bytes from a place on. The crate asks so for the head of a page, and for the tail of the file.
    fn get_read(&self, start: u64) -> ParquetResult<Self::T> {
        let left = self.len().saturating_sub(start);
        if left != TAIL {
            let mut head = self.0.get_read(start)?;
            Walk::new(&mut head, left)
                .structure(PAGE_HEADER)
                .map_err(|e| {
                    ParquetError::General(format!("the page at byte {start} is damaged: {e}"))
                })?;
        }
        self.0.get_read(start)
    }

    fn get_bytes(&self, start: u64, length: usize) -> ParquetResult<Bytes> {
        self.0.get_bytes(start, length)
    }
}
