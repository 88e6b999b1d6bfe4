//! A Parquet file whose footer and page headers are checked before the crate `parquet` reads them.

use std::fs::File;
use std::io::{BufReader, Cursor, Read as _, Seek as _, SeekFrom};
use std::path::Path;

use asid_documents::guard::one_line;
use bytes::Bytes;
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::reader::{ChunkReader, Length, SerializedFileReader};

use super::layouts::{FILE_META_DATA, PAGE_HEADER};
use super::thrift::Walk;

/// Length after the footer: the footer's length in four bytes, and `PAR1`.
const TAIL: u64 = 8;

/// Field of a page header that states the page's uncompressed length.
const UNPACKED_SIZE: i16 = 2;
/// Length of an uncompressed page that is always accepted, bytes.
///
/// Writers begin a new page after 1 to 2 MB.
const USUAL_PAGE: u64 = 64 << 20;
/// Largest ratio of an uncompressed page's length to the file's, for longer pages.
///
/// Data that compresses better contains nothing but repetition.
const CLOSEST_PACKED: u64 = 256;

/// A Parquet file on disk.
pub struct ParquetFile(File);

impl ParquetFile {
    /// Opens a file and checks its footer.
    ///
    /// # Errors
    /// When it cannot be read, or the footer is damaged.
    pub fn open(path: &Path) -> Result<SerializedFileReader<Self>, String> {
        let mut file = File::open(path).map_err(|e| e.to_string())?;
        walk_footer(&mut file).map_err(|e| format!("has a damaged footer: {e}"))?;
        SerializedFileReader::new(Self(file)).map_err(|e| one_line(&e.to_string()))
    }
}

/// Walks over the footer, if the file has one; otherwise the crate reports the error.
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

    /// Bytes from `start` on. The crate calls this for a page header, and for the tail of the file.
    fn get_read(&self, start: u64) -> ParquetResult<Self::T> {
        let left = self.len().saturating_sub(start);
        if left != TAIL {
            let head = self.0.get_read(start)?;
            walk_page(head, left, self.len()).map_err(|e| {
                ParquetError::General(format!("the page at byte {start} is damaged: {e}"))
            })?;
        }
        self.0.get_read(start)
    }

    fn get_bytes(&self, start: u64, length: usize) -> ParquetResult<Bytes> {
        let left = self.len().saturating_sub(start);
        if length as u64 > left {
            return Err(ParquetError::General(format!(
                "{length} bytes are stated at byte {start}, where {left} are left"
            )));
        }
        self.0.get_bytes(start, length)
    }
}

/// Walks over a page header, and checks the memory that it asks for.
///
/// The crate allocates it before it decompresses.
fn walk_page(head: BufReader<File>, left: u64, file: u64) -> Result<(), String> {
    let mut walk = Walk::new(head, left);
    walk.structure(PAGE_HEADER)?;
    let unpacked = walk.number(UNPACKED_SIZE).unwrap_or(0);
    let most = USUAL_PAGE.max(file.saturating_mul(CLOSEST_PACKED));
    if u64::try_from(unpacked).is_ok_and(|x| x > most) {
        return Err(format!(
            "it states {unpacked} bytes in a file of {file}; {most} are taken at most"
        ));
    }
    Ok(())
}
