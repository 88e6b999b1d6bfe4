//! Text tables as loggers write them: comments, cell separators and number formats.
//!
//! Lines that begin with `#` are comments, above the header and below it. The first other line is
//! the header. An exception is a row of numbers below a comment with as many cells, as NumPy writes
//! names. Commas, semicolons or tabs separate cells; commas that do not separate cells, also those
//! in quotes, may be decimal. Rows are counted as an editor counts lines, from 1.

use std::collections::HashMap;
use std::path::Path;

use asid_documents::guard::one_line;
use csv::StringRecord;

/// Spellings of a missing number besides an empty cell: NumPy and pandas, R, SQL, JSON.
const MISSING: [&str; 6] = ["nan", "na", "n/a", "null", "none", "-"];

/// Beginning of a comment.
const COMMENT: char = '#';

/// The text of a file, without a byte order mark, which Excel writes. Its "Unicode Text" is UTF-16,
/// which the mark tells. A lone carriage return, as old programs end a line, ends one.
///
/// # Errors
/// When the file cannot be read, or is no text.
pub fn text(path: &Path) -> Result<String, String> {
    let bytes = std::fs::read(path).map_err(|e| e.to_string())?;
    let wide = |unit: fn([u8; 2]) -> u16| {
        let pairs = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
        String::from_utf16_lossy(&pairs.collect::<Vec<u16>>())
    };
    let text = match bytes.get(..2) {
        Some([0xff, 0xfe]) => wide(u16::from_le_bytes),
        Some([0xfe, 0xff]) => wide(u16::from_be_bytes),
        // No text of one byte a letter has a zero.
        _ if bytes.contains(&0) => {
            return Err(
                "is no text: a table is text in UTF-8, and files of other kinds have their own ending (.mcap, .db3, .parquet)"
                    .into(),
            );
        }
        _ => String::from_utf8_lossy(&bytes).into_owned(),
    };
    let text = text.trim_start_matches('\u{feff}');
    Ok(if text.contains('\n') {
        text.to_owned()
    } else {
        text.replace('\r', "\n")
    })
}

/// Separator of a table's cells, and its number format.
#[derive(Clone, Copy, Debug)]
struct Marks {
    delimiter: u8,
    decimal_comma: bool,
}

/// A table of text.
#[derive(Debug)]
pub struct TextTable<'t> {
    /// Names of its columns.
    pub header: Vec<String>,
    /// Line of the header.
    header_row: usize,
    /// The text below the header, and its first line.
    body: &'t str,
    first_row: usize,
    marks: Marks,
}

/// A row of a table.
#[derive(Debug)]
pub struct Row {
    /// Its line in the file.
    pub number: usize,
    cells: StringRecord,
    decimal_comma: bool,
}

impl Row {
    /// The text in a column.
    #[must_use]
    pub fn cell(&self, column: usize) -> &str {
        self.cells.get(column).unwrap_or_default()
    }

    /// The number in a column: NaN where it is missing, `None` where it is not a finite number.
    #[must_use]
    pub fn number_in(&self, column: usize) -> Option<f64> {
        cell_number(self.cell(column), self.decimal_comma)
    }
}

/// The number in a cell: NaN where it is missing, `None` where it is not a finite number.
fn cell_number(text: &str, decimal_comma: bool) -> Option<f64> {
    if text.is_empty() || MISSING.iter().any(|m| text.eq_ignore_ascii_case(m)) {
        return Some(f64::NAN);
    }
    let number = if decimal_comma && text.contains(',') {
        text.replacen(',', ".", 1).parse()
    } else {
        text.parse()
    };
    number.ok().filter(|x: &f64| x.is_finite())
}

/// Whether a number with a comma may be a whole one in groups of three digits, as `12,345` is.
fn is_grouped(text: &str) -> bool {
    let digits = |part: &str| part.bytes().all(|b| b.is_ascii_digit());
    let mut groups = text.trim_start_matches(['-', '+']).split(',');
    let first = groups.next().unwrap_or_default();
    let leads = (1..=3).contains(&first.len()) && digits(first) && !first.starts_with('0');
    leads && groups.all(|group| group.len() == 3 && digits(group))
}

/// The separator of a header's cells: the most frequent of comma, semicolon and tab.
fn delimiter(header: &str) -> u8 {
    let count = |mark: u8| header.bytes().filter(|b| *b == mark).count();
    // The comma wins a tie, as in the format's name.
    let marks = [b'\t', b';', b','];
    marks.into_iter().max_by_key(|m| count(*m)).unwrap_or(b',')
}

/// A reader of records.
fn reader(text: &str, delimiter: u8) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .comment(Some(COMMENT as u8))
        .delimiter(delimiter)
        .from_reader(text.as_bytes())
}

/// The cells of a line.
fn cells(line: &str, delimiter: u8) -> Vec<String> {
    let first = reader(line, delimiter).into_records().next();
    let cells = first.and_then(Result::ok).unwrap_or_default();
    cells.iter().map(str::to_owned).collect()
}

/// Whether a line is blank or a comment.
fn is_void(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with(COMMENT)
}

/// Whether the reader makes no record of a line; of spaces alone it makes one.
fn is_passed_over(line: &str) -> bool {
    line.trim_end_matches(['\r', '\n']).is_empty() || line.starts_with(COMMENT)
}

/// Refuses a header with a repeated name, which would be ambiguous.
///
/// Empty names do not count, as pandas writes one for its index.
fn refuse_twice(header: &[String]) -> Result<(), String> {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    for (i, name) in header.iter().enumerate().filter(|(_, n)| !n.is_empty()) {
        if let Some(first) = seen.insert(name, i) {
            return Err(format!(
                "column `{name}` stands twice in the header, as column {} and as column {}: rename one of them, or leave it out",
                first + 1,
                i + 1
            ));
        }
    }
    Ok(())
}

impl<'t> TextTable<'t> {
    /// Finds the header of a text, and its number format.
    ///
    /// # Errors
    /// When there is no header, it repeats a name, or no row follows it.
    pub fn of(text: &'t str) -> Result<Self, String> {
        if text.trim().is_empty() {
            return Err("is empty: record it again, or leave it out".into());
        }
        let mut table = Self::headed(text)
            .ok_or("holds comments alone: names of columns and rows are missing")?;
        table.refuse_as_header()?;
        refuse_twice(&table.header)?;
        if table.rows().next().is_none() {
            return Err(format!(
                "has no rows below its header (row {}): record it again, or leave it out",
                table.header_row
            ));
        }
        table.marks.decimal_comma = table.has_decimal_commas();
        Ok(table)
    }

    /// The table below the header of a text.
    fn headed(text: &'t str) -> Option<Self> {
        let (mut at, mut comment) = (0, None);
        for (i, line) in text.split_inclusive('\n').enumerate() {
            if is_void(line) {
                comment = Some((i + 1, line.trim_start_matches(COMMENT)));
                at += line.len();
                continue;
            }
            let delimiter = delimiter(line);
            let own = cells(line, delimiter);
            let numbers = own
                .iter()
                .all(|c| cell_number(c, delimiter != b',').is_some());
            let above = comment.map(|(row, line)| (row, cells(line, delimiter)));
            let named = above.filter(|(_, names)| numbers && names.len() == own.len());
            let marks = Marks {
                delimiter,
                decimal_comma: false,
            };
            return Some(match named {
                Some((header_row, header)) => Self {
                    header,
                    header_row,
                    body: &text[at..],
                    first_row: i + 1,
                    marks,
                },
                None => Self {
                    header: own,
                    header_row: i + 1,
                    body: &text[at + line.len()..],
                    first_row: i + 2,
                    marks,
                },
            });
        }
        None
    }

    /// Refuses a header that is a row of numbers, or that no separator divides: a log has at least
    /// its stamps and a reading.
    fn refuse_as_header(&self) -> Result<(), String> {
        let row = self.header_row;
        let number = |text: &String| cell_number(text, true);
        let is_number = |text: &String| number(text).is_some_and(f64::is_finite);
        if self.header.iter().all(|c| number(c).is_some()) && self.header.iter().any(is_number) {
            return Err(format!(
                "row {row} has numbers and no names: write a header above it, with a name for each column, such as `time`"
            ));
        }
        match &self.header[..] {
            [one] => Err(format!(
                "row {row}, the header, is one cell, `{}`: commas, semicolons or tabs separate cells",
                shortened(one)
            )),
            _ => Ok(()),
        }
    }

    /// Whether numbers have decimal commas: at least one has, which is no whole number in groups of
    /// three digits, and none has a point.
    fn has_decimal_commas(&self) -> bool {
        let mut commas = false;
        for row in self.rows().map_while(Result::ok) {
            for cell in &row.cells {
                if cell.contains('.') && cell_number(cell, false).is_some() {
                    return false;
                }
                let has_comma = cell.contains(',') && !is_grouped(cell);
                commas |= has_comma && cell_number(cell, true).is_some();
            }
        }
        commas
    }

    /// The rows below the header; an error of one line for a row of another length.
    pub fn rows(&self) -> impl Iterator<Item = Result<Row, String>> {
        let mut reader = reader(self.body, self.marks.delimiter);
        let (mut at, mut number) = (0, self.first_row);
        std::iter::from_fn(move || {
            loop {
                let mut cells = StringRecord::new();
                match reader.read_record(&mut cells) {
                    Ok(false) => return None,
                    Ok(true) => {}
                    Err(e) => return Some(Err(one_line(&e.to_string()))),
                }
                let start = cells.position().map_or(0, |p| p.byte() as usize).max(at);
                number += newlines(&self.body[at..start]);
                at = start;
                // A record begins where the previous one ended: before blank lines and comments.
                for line in self.body[start..]
                    .split_inclusive('\n')
                    .take_while(|l| is_passed_over(l))
                {
                    at += line.len();
                    number += 1;
                }
                // Spaces alone are not a row.
                if cells.len() > 1 || cells.iter().any(|c| !c.is_empty()) {
                    return Some(self.row(number, cells));
                }
            }
        })
    }

    /// A row of as many cells as the header has; further empty cells are ignored.
    fn row(&self, number: usize, cells: StringRecord) -> Result<Row, String> {
        let expected = self.header.len();
        if cells.len() < expected || cells.iter().skip(expected).any(|c| !c.is_empty()) {
            // A decimal comma makes two cells of a number.
            let halved = self.marks.delimiter == b',' && cells.len() > expected;
            let then = if halved {
                "where commas are decimal marks, separate cells by semicolons; else complete or delete the row that is wrong"
            } else {
                "complete or delete the row that is wrong"
            };
            return Err(format!(
                "row {number}: cells found: {}, expected by the header (row {}): {expected}; {then}; lines above the header begin with \
                 `{COMMENT}`",
                cells.len(),
                self.header_row
            ));
        }
        Ok(Row {
            number,
            cells,
            decimal_comma: self.marks.decimal_comma,
        })
    }
}

/// Largest number of characters of a cell that a message shows: a line on a terminal.
const SHOWN: usize = 60;

/// The beginning of a text, if it is long.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

/// Number of line ends in a text.
fn newlines(text: &str) -> usize {
    text.bytes().filter(|b| *b == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        let table = match TextTable::of(text) {
            Err(message) => return message,
            Ok(table) => table,
        };
        let said = table.rows().find_map(Result::err).unwrap();
        assert_eq!(said.lines().count(), 1, "{said}");
        said
    }

    /// The numbers of a table, and the lines of its rows.
    fn numbers(text: &str) -> (Vec<Vec<f64>>, Vec<usize>) {
        let table = TextTable::of(text).unwrap();
        let rows: Vec<Row> = table.rows().map(Result::unwrap).collect();
        let columns = 0..table.header.len();
        let of = |row: &Row| (columns.clone().map(|i| row.number_in(i).unwrap())).collect();
        let numbers = rows.iter().map(of).collect();
        (numbers, rows.iter().map(|row| row.number).collect())
    }

    #[test]
    fn a_byte_order_mark_tells_how_a_file_is_encoded() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("log.csv");
        let written = "\u{feff}time,Winkel µ\n0,1\n";
        let wide = |bytes: fn(u16) -> [u8; 2]| written.encode_utf16().flat_map(bytes).collect();
        for bytes in [
            written.into(),
            wide(u16::to_le_bytes),
            wide(u16::to_be_bytes),
        ] {
            let bytes: Vec<u8> = bytes;
            std::fs::write(&file, bytes).unwrap();
            assert_eq!(super::text(&file).unwrap(), "time,Winkel µ\n0,1\n");
        }
    }

    #[test]
    fn comments_are_passed_over_and_rows_are_counted_as_lines() {
        for end in ["\n", "\r\n"] {
            let text = [
                "# robot: a, b",
                "",
                "t,x",
                "0,1",
                "# stop",
                "",
                "1,2",
                "2,3",
            ]
            .join(end);
            let (found, rows) = numbers(&text);
            assert_eq!(found, [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]]);
            assert_eq!(rows, [4, 7, 8]);
        }
    }

    /// Symptom: a panic at a line of spaces above a blank line or a comment.
    ///
    /// Cause: the line of spaces counted as not part of the table, but the reader makes a record of
    /// it, and the next one then began before the place that was already counted.
    #[test]
    fn spaces_above_a_comment_are_passed_over() {
        for end in ["\n", "\r\n"] {
            let text = ["t,x", "0,1", " ", "# stop", "1,2", "  ", "", "2,3"].join(end);
            let (found, rows) = numbers(&text);
            assert_eq!(found, [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]]);
            assert_eq!(rows, [2, 5, 8]);
        }
    }

    #[test]
    fn names_in_a_comment_above_numbers_are_the_header() {
        let table = TextTable::of("# made by numpy\n# t, x\n0,1\n1,2\n").unwrap();
        assert_eq!(table.header, ["t", "x"]);
        assert_eq!(table.rows().next().unwrap().unwrap().number, 3);
    }

    #[test]
    fn decimal_commas_are_read_where_semicolons_divide_cells() {
        assert_eq!(
            numbers("t;x\n0;-5,25\n1;1,5e-3\n").0,
            [[0.0, -5.25], [1.0, 1.5e-3]]
        );
        // With decimal points present, a comma may group thousands: it is ambiguous.
        let table = TextTable::of("t;x\n0.5;1,234\n").unwrap();
        let row = table.rows().next().unwrap().unwrap();
        assert_eq!((row.number_in(0), row.number_in(1)), (Some(0.5), None));
    }

    /// Symptom: `"0,25"` in quotes was text, and the stamps held "no numbers". Cause: where commas
    /// separate cells, none was taken for a decimal mark.
    #[test]
    fn decimal_commas_in_quotes_are_read_where_commas_divide_cells() {
        let quoted = "\"t\",\"x\"\n\"0,00\",\"-5,25\"\n\"0,01\",\"1,234\"\n";
        assert_eq!(numbers(quoted).0, [[0.0, -5.25], [0.01, 1.234]]);
        // Groups of thousands alone are not taken for decimals.
        let table = TextTable::of("t,x\n1,\"12,345\"\n").unwrap();
        let row = table.rows().next().unwrap().unwrap();
        assert_eq!(row.number_in(1), None);
    }

    /// Symptom: a file without a header was refused since "column `0.0` stands twice", one with cells
    /// between spaces since it has no stamps, and one with bare decimal commas as a row of the wrong
    /// length.
    #[test]
    fn a_header_that_is_none_is_named_as_that() {
        let said = refused("0.0,0.0\n0.1,0.2\n");
        assert!(said.contains("row 1 has numbers and no names"), "{said}");
        let said = refused("# by hand\ntime angle\n0 1\n");
        assert!(said.contains("row 2, the header, is one cell, `time angle`"));
        assert!(refused("t,x\n0,1,2,5\n").contains("separate cells by semicolons"));
    }

    /// Symptom: a file whose lines end with a carriage return had "no rows below its header", and a
    /// picture was a table with rows of the wrong length.
    #[test]
    fn a_carriage_return_ends_a_line_and_a_picture_is_no_table() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("log.csv");
        std::fs::write(&file, "t,x\r0,1\r1,2\r").unwrap();
        let text = super::text(&file).unwrap();
        assert_eq!(
            numbers(&text),
            (vec![vec![0.0, 1.0], vec![1.0, 2.0]], vec![2, 3])
        );
        std::fs::write(&file, b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR").unwrap();
        assert!(super::text(&file).unwrap_err().contains("is no text"));
    }

    #[test]
    fn a_row_of_another_length_is_told_with_its_number() {
        let said = refused("# a\nt,x\n0,1\n1\n");
        assert!(
            said.contains("row 4: cells found: 1, expected by the header (row 2): 2"),
            "{said}"
        );
        assert!(refused("t,x\n0,1\n1,2,3\n").contains("row 3: cells found: 3"));
        assert_eq!(numbers("t,x\n0,1,,\n1,2\n").0.len(), 2);
    }

    #[test]
    fn a_file_without_rows_says_so() {
        assert!(refused("").contains("is empty"));
        assert!(refused(" \n").contains("is empty"));
        assert!(refused("# a\n").contains("comments alone"));
        assert!(refused("t,x\n").contains("no rows below its header (row 1)"));
        assert!(refused("t,x,t\n0,1,2\n").contains("`t` stands twice"));
    }
}
