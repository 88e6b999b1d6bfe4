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
use super::{Angle, ColumnMapping, LogNotes};

/// Reads a Parquet file.
pub(super) fn read(
    path: &Path,
    layout: &Layout,
    columns: (&[ColumnMapping], &[Angle]),
) -> Result<(Episode, LogNotes), String> {
    guarded("a Parquet file", || read_rows(path, layout, columns))
}

fn read_rows(
    path: &Path,
    layout: &Layout,
    columns: (&[ColumnMapping], &[Angle]),
) -> Result<(Episode, LogNotes), String> {
    let told = |e: parquet::errors::ParquetError| one_line(&e.to_string());
    let file = ParquetFile::open(path)?;
    let schema = file.metadata().file_metadata().schema_descr();
    let fields = schema.root_schema().get_fields().iter();
    let header = fields.map(|f| f.name().to_owned()).collect();
    let mut reader = Reader::new(layout, columns, header)?;
    for (i, row) in file.get_row_iter(None).map_err(told)?.enumerate() {
        let row = row.map_err(|e| format!("row {}: {}", i + 2, told(e)))?;
        let fields: Vec<&Field> = row.get_column_iter().map(|(_, field)| field).collect();
        reader.row(i + 2, |column| {
            let field = fields[column];
            let finite = number_in(field).filter(|x| !x.is_infinite());
            finite.ok_or_else(|| field.to_string())
        })?;
    }
    reader.finish()
}

/// The number in a cell, 0 or 1 for a truth value; NaN where it is null, `None` for anything else.
pub(crate) fn number_in(field: &Field) -> Option<f64> {
    Some(match *field {
        Field::Null => f64::NAN,
        Field::Bool(x) => f64::from(u8::from(x)),
        Field::Double(x) => x,
        Field::Float(x) => f64::from(x),
        Field::Float16(x) => f64::from(x),
        Field::Int(x) => f64::from(x),
        Field::Short(x) => f64::from(x),
        Field::Byte(x) => f64::from(x),
        Field::UInt(x) => f64::from(x),
        Field::UShort(x) => f64::from(x),
        Field::UByte(x) => f64::from(x),
        Field::Long(x) | Field::TimestampMillis(x) | Field::TimestampMicros(x) => x as f64,
        Field::ULong(x) => x as f64,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::fs::File;
    use std::sync::Arc;

    use parquet::data_type::{BoolType, DataType, DoubleType, FloatType, Int32Type, Int64Type};
    use parquet::file::properties::WriterProperties;
    use parquet::file::writer::SerializedFileWriter;
    use parquet::schema::parser::parse_message_type;

    use super::*;
    use crate::episode::tests::layout;
    use crate::format::LogFormat;

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
        // A study may state the kind of a file with another ending.
        let other = folder.path().join("log.pq");
        std::fs::rename(folder.path().join("log.parquet"), &other).unwrap();
        let (other, _) =
            crate::episode::read_as(LogFormat::Parquet, &other, &layout(), (&[], &[])).unwrap();
        assert_eq!((&other.time, &other.ctrl), (&a.time, &a.ctrl));
    }

    /// The angles of a log of two rows, in a column of some type, as both readers read them.
    fn angles<T: DataType>(column: &str, angles: [T::T; 2]) -> [Vec<f64>; 2] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.parquet");
        let schema = format!(
            "message log {{ required double time; required double ctrl.servo; required {column}; }}"
        );
        let schema = Arc::new(parse_message_type(&schema).unwrap());
        let properties = Arc::new(WriterProperties::default());
        let mut file =
            SerializedFileWriter::new(File::create(&path).unwrap(), schema, properties).unwrap();
        let mut group = file.next_row_group().unwrap();
        for values in [[0.0, 0.1], [1.0, 1.0]] {
            let mut column = group.next_column().unwrap().unwrap();
            let typed = column.typed::<DoubleType>();
            typed.write_batch(&values, None, None).unwrap();
            column.close().unwrap();
        }
        let mut column = group.next_column().unwrap().unwrap();
        let typed = column.typed::<T>();
        typed.write_batch(&angles, None, None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
        file.close().unwrap();
        let episode = crate::episode::read(&path, &layout()).unwrap();
        let columns = crate::parquet_file::columns(&path, false).unwrap();
        let column = columns.into_iter().find(|(name, _)| name == "angle");
        [episode.readings, column.unwrap().1]
    }

    /// Symptom: an import showed a column of an ADC and mapped it, and was then refused with "`512`
    /// is not a finite number".
    ///
    /// Cause: two readers had each a list of the types of numbers, one without uint8, uint16 and
    /// bool.
    #[test]
    fn numbers_of_every_type_are_the_same_to_both_readers() {
        let whole = |kind: &str| angles::<Int32Type>(&format!("int32 angle {kind}"), [0, 120]);
        let long = |kind: &str| angles::<Int64Type>(&format!("int64 angle {kind}"), [0, 120]);
        for (found, wanted) in [
            (angles::<BoolType>("boolean angle", [false, true]), 1.0),
            (angles::<FloatType>("float angle", [0.0, 0.25]), 0.25),
            (angles::<DoubleType>("double angle", [0.0, 0.1]), 0.1),
            (whole(""), 120.0),
            (whole("(INTEGER(8,true))"), 120.0),
            (whole("(INTEGER(8,false))"), 120.0),
            (whole("(INTEGER(16,true))"), 120.0),
            (whole("(INTEGER(16,false))"), 120.0),
            (whole("(INTEGER(32,false))"), 120.0),
            (long(""), 120.0),
            (long("(INTEGER(64,false))"), 120.0),
            (long("(TIMESTAMP(MICROS,true))"), 120.0),
        ] {
            assert_eq!(found, [[0.0, wanted], [0.0, wanted]]);
        }
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
