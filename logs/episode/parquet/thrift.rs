//! Checks structures in Thrift's compact protocol, in which Parquet states what a file holds.
//!
//! It builds nothing, and its time is bounded by the number of bytes. The crate `parquet` skips an
//! unknown field element by element, as many elements as the file states. Elements without bytes,
//! such as booleans there, would keep it busy for arbitrarily long. This walk therefore runs first.
//! It reads each field that the format knows as the crate does, and refuses one of another type, so
//! that both see the same fields.
//!
//! The protocol:
//! <https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>.

use std::io::{BufRead, Seek};

/// Type of a value. Integers of 16, 32 and 64 bits have the same encoding.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A boolean; in a field it is part of the field's type.
    Bool,
    /// One byte.
    Byte,
    /// An integer of variable length.
    Whole,
    /// A float of eight bytes.
    Double,
    /// A text or bytes, after their length.
    Binary,
    /// A list of elements of one kind.
    List(&'static Kind),
    /// A structure with numbered fields.
    Struct(&'static Layout),
}

/// Fields of a structure that the format knows, by number.
pub type Layout = [(i16, Kind)];

/// Types of the protocol: first those without bytes, then those with a value.
const STOP: u8 = 0;
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const I16: u8 = 4;
const I64: u8 = 6;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const MAP: u8 = 11;
const STRUCT: u8 = 12;
const UUID: u8 = 13;

/// Deepest nesting of values, levels: the most that the crate `parquet` skips.
///
/// The format's own structures have eight.
const DEEPEST: usize = 64;
/// Longest integer of variable length, bytes: 64 bits, 7 in each.
const LONGEST_NUMBER: u32 = 10;

impl Kind {
    fn is(self, wire: u8) -> bool {
        match self {
            Self::Bool => wire == TRUE || wire == FALSE,
            Self::Byte => wire == BYTE,
            Self::Whole => (I16..=I64).contains(&wire),
            Self::Double => wire == DOUBLE,
            Self::Binary => wire == BINARY,
            Self::List(_) => wire == LIST,
            Self::Struct(_) => wire == STRUCT,
        }
    }
}

/// A walk over bytes.
pub struct Walk<R> {
    bytes: R,
    /// Remaining bytes.
    left: u64,
    /// Integers of the outermost structure, by field.
    numbers: Vec<(i16, i64)>,
}

impl<R: BufRead + Seek> Walk<R> {
    /// Begins at the position of `bytes`, with `left` bytes from there on.
    pub fn new(bytes: R, left: u64) -> Self {
        Self {
            bytes,
            left,
            numbers: Vec::new(),
        }
    }

    /// The integer of a field of the outermost structure; the last one if there are several.
    pub fn number(&self, field: i16) -> Option<i64> {
        let found = self.numbers.iter().rev().find(|(n, _)| *n == field);
        found.map(|(_, x)| *x)
    }

    /// Walks over a structure.
    ///
    /// # Errors
    /// When it ends early, states more than there is, or has a field of another type than the
    /// format.
    pub fn structure(&mut self, layout: &Layout) -> Result<(), String> {
        self.fields(layout, DEEPEST)
    }

    fn fields(&mut self, layout: &Layout, depth: usize) -> Result<(), String> {
        let mut number: i16 = 0;
        loop {
            let head = self.byte()?;
            let wire = head & 0xf;
            if wire == STOP {
                return Ok(());
            }
            number = match i16::from(head >> 4) {
                0 => signed(self.whole()?) as i16,
                more => number
                    .checked_add(more)
                    .ok_or_else(|| format!("a field has the number {number} + {more}"))?,
            };
            match layout.iter().find(|(n, _)| *n == number) {
                Some((_, Kind::Whole)) if Kind::Whole.is(wire) => {
                    let whole = signed(self.whole()?);
                    if depth == DEEPEST {
                        self.numbers.push((number, whole));
                    }
                }
                Some((_, kind)) if kind.is(wire) => self.known(*kind, depth)?,
                Some(_) => {
                    return Err(format!(
                        "field {number} of a structure has type {wire}, which is none of the format's"
                    ));
                }
                None if wire == TRUE || wire == FALSE => {}
                None => self.unknown(wire, depth)?,
            }
        }
    }

    /// Walks over a value of the format, whose type was checked.
    fn known(&mut self, kind: Kind, depth: usize) -> Result<(), String> {
        let depth = deeper(depth)?;
        match kind {
            Kind::Bool => Ok(()),
            Kind::Byte => self.skip(1),
            Kind::Whole => self.whole().map(drop),
            Kind::Double => self.skip(8),
            Kind::Binary => self.binary(),
            Kind::Struct(layout) => self.fields(layout, depth),
            Kind::List(element) => {
                let (wire, size) = self.list()?;
                if size > 0 && !element.is(wire) {
                    return Err(format!(
                        "a list has elements of type {wire}, which is none of the format's"
                    ));
                }
                (0..size).try_for_each(|_| self.known(*element, depth))
            }
        }
    }

    /// Skips a value of a field that the format does not know.
    fn unknown(&mut self, wire: u8, depth: usize) -> Result<(), String> {
        let depth = deeper(depth)?;
        match wire {
            BYTE => self.skip(1),
            I16..=I64 => self.whole().map(drop),
            DOUBLE => self.skip(8),
            BINARY => self.binary(),
            UUID => self.skip(16),
            STRUCT => self.fields(&[], depth),
            LIST | SET => {
                let (wire, size) = self.list()?;
                (0..size).try_for_each(|_| self.unknown(wire, depth))
            }
            MAP => {
                let size = self.whole()?;
                if size == 0 {
                    return Ok(());
                }
                let kinds = self.byte()?;
                let (key, value) = (kinds >> 4, kinds & 0xf);
                self.holds(size, key)?;
                self.holds(size, value)?;
                (0..size).try_for_each(|_| {
                    self.unknown(key, depth)?;
                    self.unknown(value, depth)
                })
            }
            other => Err(format!("a value has type {other}, which there is none of")),
        }
    }

    /// Type and count of a list's elements.
    fn list(&mut self) -> Result<(u8, u64), String> {
        let head = self.byte()?;
        let wire = head & 0xf;
        let size = match head >> 4 {
            15 => self.whole()?,
            few => u64::from(few),
        };
        if size > 0 {
            self.holds(size, wire)?;
        }
        Ok((wire, size))
    }

    /// Checks that the remaining bytes can hold a list: each element takes at least one byte.
    ///
    /// Parquet has no lists of booleans here, and readers disagree on whether a boolean takes a
    /// byte.
    fn holds(&self, size: u64, wire: u8) -> Result<(), String> {
        if size > self.left {
            return Err(format!(
                "a list states {size} elements, and {} bytes are left",
                self.left
            ));
        }
        if wire == TRUE || wire == FALSE {
            return Err(format!(
                "a list of {size} booleans stands where the format has none"
            ));
        }
        Ok(())
    }

    fn binary(&mut self) -> Result<(), String> {
        let length = self.whole()?;
        self.skip(length)
    }

    /// An integer of variable length, its lowest bits first.
    fn whole(&mut self) -> Result<u64, String> {
        let mut number = 0;
        for place in 0..LONGEST_NUMBER {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f).wrapping_shl(7 * place);
            if byte & 0x80 == 0 {
                return Ok(number);
            }
        }
        Err(format!("a number is longer than {LONGEST_NUMBER} bytes"))
    }

    fn byte(&mut self) -> Result<u8, String> {
        self.take(1)?;
        let mut byte = [0];
        let read = self.bytes.read_exact(&mut byte);
        read.map_err(|e| e.to_string())?;
        Ok(byte[0])
    }

    fn skip(&mut self, length: u64) -> Result<(), String> {
        self.take(length)?;
        let offset = i64::try_from(length).map_err(|e| e.to_string())?;
        self.bytes.seek_relative(offset).map_err(|e| e.to_string())
    }

    fn take(&mut self, length: u64) -> Result<(), String> {
        let left = self.left.checked_sub(length);
        self.left = left.ok_or_else(|| {
            format!(
                "a value of {length} bytes begins where {} are left",
                self.left
            )
        })?;
        Ok(())
    }
}

/// Decodes an integer whose lowest bit is its sign (zigzag).
fn signed(written: u64) -> i64 {
    (written >> 1) as i64 ^ -((written & 1) as i64)
}

fn deeper(depth: usize) -> Result<usize, String> {
    depth
        .checked_sub(1)
        .ok_or_else(|| format!("values are inside of each other more than {DEEPEST} levels deep"))
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn walk(bytes: &[u8], layout: &Layout) -> Result<(), String> {
        Walk::new(Cursor::new(bytes), bytes.len() as u64).structure(layout)
    }

    /// 2^31 - 1 as an integer of variable length.
    const MANY: [u8; 5] = [0xff, 0xff, 0xff, 0xff, 0x07];

    #[test]
    fn containers_that_state_more_than_there_is_are_refused() {
        for (wire, inside) in [
            (LIST, vec![0xf0 | FALSE]),
            (SET, vec![0xf0 | TRUE]),
            (LIST, vec![0xf0 | UUID]),
            (LIST, vec![0xf0 | STRUCT]),
        ] {
            let bytes = [&[0x10 | wire][..], &inside, &MANY, &[0]].concat();
            let said = walk(&bytes, &[]).unwrap_err();
            assert!(said.contains("states 2147483647 elements"), "{said}");
        }
        let map = [&[0x10 | MAP][..], &MANY, &[0x12, 0]].concat();
        let said = walk(&map, &[]).unwrap_err();
        assert!(said.contains("states 2147483647 elements"), "{said}");
    }

    /// The crate counts booleans of a skipped list as no bytes.
    #[test]
    fn booleans_in_a_list_are_refused_and_as_fields_are_not() {
        let said = walk(&[0x10 | LIST, 0x20 | FALSE, 1, 1, 0], &[]).unwrap_err();
        assert!(said.contains("booleans"), "{said}");
        assert_eq!(
            walk(&[0x10 | FALSE, 0x10 | TRUE, 0], &[(1, Kind::Bool)]),
            Ok(())
        );
    }

    #[test]
    fn a_field_of_another_type_than_the_formats_is_refused() {
        let layout = [(1, Kind::Whole), (4, Kind::List(&Kind::Binary))];
        // Fields 1 (a number), 4 (two texts), 9 (eight bytes of an unknown field).
        let good = [
            0x15, 0x80, 0x01, 0x39, 0x28, 1, b'a', 0, 0x57, 0, 0, 0, 0, 0, 0, 0, 0, 0,
        ];
        assert_eq!(walk(&good, &layout), Ok(()));
        for (at, byte) in [(0, 0x19), (4, 0x25), (5, 0xff)] {
            let mut bad = good;
            bad[at] = byte;
            assert!(walk(&bad, &layout).is_err(), "byte {at}");
        }
        for length in 0..good.len() {
            assert!(walk(&good[..length], &layout).is_err());
        }
    }

    #[test]
    fn depth_has_an_end() {
        let nested = |levels: usize| {
            let mut bytes = vec![0x10 | STRUCT; levels];
            bytes.extend(vec![0; levels + 1]);
            walk(&bytes, &[])
        };
        assert_eq!(nested(DEEPEST), Ok(()));
        assert!(nested(DEEPEST + 1).unwrap_err().contains("levels deep"));
    }
}
