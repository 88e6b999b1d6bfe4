//! Logs as Parquet files: flat columns of numbers, with null or NaN for a missing reading.

mod file;
mod layouts;
mod thrift;

use std::path::Path;

use asid_core::Episode;
use asid_core::layout::Layout;
use asid_documents::guard::{guarded, one_line};
use parquet::file::reader::FileReader as _;
use parquet::record::Field;

pub use file::ParquetFile;

use super::reader::Reader;
use super::{ColumnMapping, LogNotes};

/// Reads a Parquet file.
pub(super) fn read(
    path: &Path,
    layout: &Layout,
    mappings: &[ColumnMapping],
) -> Result<(Episode, LogNotes), String> {
    guarded("a Parquet file", || read_rows(path, layout, mappings))
}

fn read_rows(
    path: &Path,
    layout: &Layout,
    mappings: &[ColumnMapping],
) -> Result<(Episode, LogNotes), String> {
    let told = |e: parquet::errors::ParquetError| one_line(&e.to_string());
    let file = ParquetFile::open(path)?;
    let schema = file.metadata().file_metadata().schema_descr();
    let fields = schema.root_schema().get_fields().iter();
    let header = fields.map(|f| f.name().to_owned()).collect();
    let mut reader = Reader::new(layout, mappings, header)?;
    for (i, row) in file.get_row_iter(None).map_err(told)?.enumerate() {
        let row = row.map_err(|e| format!("row {}: {}", i + 2, told(e)))?;
        let fields: Vec<&Field> = row.get_column_iter().map(|(_, field)| field).collect();
        reader.row(i + 2, |column| number(fields[column]))?;
    }
    reader.finish()
}

/// The number in a cell; NaN where it is null.
fn number(field: &Field) -> Result<f64, String> {
    let x = match *field {
        Field::Null => f64::NAN,
        Field::Double(x) => x,
        Field::Float(x) => f64::from(x),
        Field::Int(x) => f64::from(x),
        Field::Short(x) => f64::from(x),
        Field::Byte(x) => f64::from(x),
        Field::UInt(x) => f64::from(x),
        Field::Long(x) => x as f64,
        Field::ULong(x) => x as f64,
        Field::TimestampMillis(x) | Field::TimestampMicros(x) => x as f64,
        ref other => return Err(other.to_string()),
    };
    if x.is_infinite() {
        return Err(x.to_string());
    }
    Ok(x)
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::sync::Arc;

    use parquet::data_type::DoubleType;
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;

    use super::*;
    use crate::episode::tests::layout;

    /// Writes columns of doubles; `angle` may be null.
    fn write(path: &Path, time: &[f64], ctrl: &[f64], angle: &[Option<f64>]) {
        let schema = "message log { required double time; required double ctrl.servo; \
                      optional double angle; }";
        let schema = Arc::new(parse_message_type(schema).unwrap());
        let properties = Arc::new(WriterProperties::default());
        let mut file =
            SerializedFileWriter::new(File::create(path).unwrap(), schema, properties).unwrap();
        let mut group = file.next_row_group().unwrap();
        let levels: Vec<i16> = angle.iter().map(|a| i16::from(a.is_some())).collect();
        let present: Vec<f64> = angle.iter().flatten().copied().collect();
        for (values, levels) in [(time, None), (ctrl, None), (&present, Some(&levels[..]))] {
            let mut column = group.next_column().unwrap().unwrap();
            let typed = column.typed::<DoubleType>();
            typed.write_batch(values, levels, None).unwrap();
            column.close().unwrap();
        }
        group.close().unwrap();
        file.close().unwrap();
    }

    #[test]
    fn a_parquet_log_is_the_csv_log() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["log.parquet", "log.csv"].map(|n| folder.path().join(n));
        write(
            &a,
            &[0.0, 0.5, 1.0],
            &[1.0, 2.0, 3.0],
            &[Some(0.25), None, Some(-0.5)],
        );
        std::fs::write(&b, "time,ctrl.servo,angle\n0,1,0.25\n0.5,2,\n1,3,-0.5\n").unwrap();
        let [a, b] = [a, b].map(|path| crate::episode::read(&path, &layout()).unwrap());
        assert_eq!((&a.time, &a.ctrl), (&b.time, &b.ctrl));
        assert!(a.readings[1].is_nan() && b.readings[1].is_nan());
        assert_eq!(
            [a.readings[0], a.readings[2]],
            [b.readings[0], b.readings[2]]
        );
    }

    #[test]
    fn a_bad_parquet_log_names_row_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.parquet");
        let infinite = [Some(f64::INFINITY), None];
        write(&path, &[0.0, 1.0], &[1.0, 2.0], &infinite);
        let error = crate::episode::read(&path, &layout())
            .unwrap_err()
            .to_string();
        assert!(error.contains("row 2, column `angle`"), "{error}");
        std::fs::write(&path, "time,angle\n").unwrap();
        let error = crate::episode::read(&path, &layout())
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("log.parquet") && error.lines().count() == 1,
            "{error}"
        );
    }

    /// The error for a log whose first page has another header.
    fn told_of_page(head: &[u8]) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.parquet");
        write(&path, &[0.0, 1.0], &[1.0, 2.0], &[Some(0.1), Some(0.2)]);
        let mut bytes = std::fs::read(&path).unwrap();
        bytes[4..4 + head.len()].copy_from_slice(head);
        std::fs::write(&path, bytes).unwrap();
        let error = crate::episode::read(&path, &layout())
            .unwrap_err()
            .to_string();
        assert_eq!(error.lines().count(), 1, "{error}");
        error
    }

    /// The header of the first page states a field of 2^31 - 1 booleans.
    ///
    /// `parquet` would skip them one by one.
    #[test]
    fn a_page_that_states_more_than_there_is_is_refused_at_once() {
        // Field 9, a list; its elements, booleans; their count.
        let error = told_of_page(&[0x99, 0xf2, 0xff, 0xff, 0xff, 0xff, 0x07]);
        let want = "the page at byte 4 is damaged: a list states 2147483647 elements";
        assert!(error.contains(want), "{error}");
    }

    /// The header of the first page states 2^31 - 1 bytes.
    ///
    /// `parquet` would allocate them before it decompresses.
    #[test]
    fn a_page_that_asks_for_two_gigabytes_is_refused() {
        // Field 1, the kind of the page; field 2, its length in zigzag encoding; the end.
        let error = told_of_page(&[0x15, 0x00, 0x15, 0xfe, 0xff, 0xff, 0xff, 0x0f, 0x00]);
        let want = "the page at byte 4 is damaged: it states 2147483647 bytes";
        assert!(error.contains(want), "{error}");
    }
}
