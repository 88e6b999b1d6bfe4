//! Parquet files: flat columns of numbers, and lists of numbers as LeRobot writes them.

use std::path::Path;
use std::sync::Arc;

use asid_documents::guard::guarded;
use parquet::basic::Type as Physical;
use parquet::errors::ParquetError;
use parquet::file::reader::FileReader as _;
use parquet::record::Field;
use parquet::schema::types::Type;

use crate::episode::{ParquetFile, number_in};
use crate::raw::RawLog;
use crate::table_file::{self, Column};

/// Longest list that is kept: states and actions of robots are shorter.
const LONGEST_LIST: usize = 512;

/// Columns of a file in its order, with their names; NaN where there is no number.
///
/// With `lists`, entries of lists are columns `name.0`, `name.1`, ….
///
/// # Errors
/// When the file is damaged.
pub fn columns(path: &Path, lists: bool) -> Result<Vec<(String, Vec<f64>)>, String> {
    guarded("a Parquet file", || read_columns(path, lists))
}

fn read_columns(path: &Path, lists: bool) -> Result<Vec<(String, Vec<f64>)>, String> {
    let told = |e: ParquetError| e.to_string().replace('\n', " ");
    let file = ParquetFile::open(path)?;
    let schema = file.metadata().file_metadata().schema_descr().root_schema();
    let chosen: Vec<Arc<Type>> = schema
        .get_fields()
        .iter()
        .filter(|f| is_numeric(f) && (lists || f.is_primitive()))
        .cloned()
        .collect();
    if chosen.is_empty() {
        return Err("has no columns of numbers".into());
    }
    let projection = Type::group_type_builder(schema.name())
        .with_fields(chosen)
        .build()
        .map_err(told)?;
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    let mut places: Vec<Vec<usize>> = vec![Vec::new(); projection.get_fields().len()];
    for (k, row) in file
        .get_row_iter(Some(projection))
        .map_err(told)?
        .enumerate()
    {
        let row = row.map_err(|e| format!("row {}: {}", k + 1, told(e)))?;
        for ((name, field), places) in row.get_column_iter().zip(&mut places) {
            let values = numbers(field);
            let single = !matches!(field, Field::ListInternal(_));
            for (i, x) in values.into_iter().take(LONGEST_LIST).enumerate() {
                if i >= places.len() {
                    places.push(columns.len());
                    let name = if single {
                        name.clone()
                    } else {
                        format!("{name}.{i}")
                    };
                    columns.push((name, vec![f64::NAN; k]));
                }
                columns[places[i]].1.push(x);
            }
        }
        for (_, values) in &mut columns {
            values.resize(k + 1, f64::NAN);
        }
    }
    Ok(columns)
}

/// Whether a column holds numbers, or lists of them.
fn is_numeric(field: &Type) -> bool {
    let number = |t: &Type| {
        t.is_primitive()
            && matches!(
                t.get_physical_type(),
                Physical::BOOLEAN
                    | Physical::INT32
                    | Physical::INT64
                    | Physical::FLOAT
                    | Physical::DOUBLE
            )
    };
    if field.is_primitive() {
        return number(field);
    }
    // list<element>: a group with one repeated group with one element.
    let [middle] = field.get_fields() else {
        return false;
    };
    if middle.is_primitive() {
        return number(middle);
    }
    matches!(middle.get_fields(), [element] if number(element))
}

fn numbers(field: &Field) -> Vec<f64> {
    match field {
        Field::ListInternal(list) => {
            let elements = list.elements().iter().take(LONGEST_LIST);
            elements.map(number).collect()
        }
        other => vec![number(other)],
    }
}

fn number(field: &Field) -> f64 {
    number_in(field).unwrap_or(f64::NAN)
}

/// Reads a table with any names, whose stamps are in the column of the name `stamps`, or in the one
/// that looks like it.
///
/// # Errors
/// When the file is damaged, or has no column of stamps.
pub fn read(path: &Path, name: &str, stamps: Option<&str>) -> Result<RawLog, String> {
    let columns: Vec<Column> = columns(path, false)?
        .into_iter()
        .map(|(name, values)| Column {
            values,
            ..Column::named(&name)
        })
        .collect();
    table_file::log(name, &columns, stamps)
}
