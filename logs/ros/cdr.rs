//! Messages of ROS 2 in the common data representation (CDR): OMG DDS-XTypes 1.3, section 7.4.
//!
//! Four bytes state the byte order, then each number is aligned to a multiple of its size. Only the
//! definition determines what is read. A stated length is bounded by the end of the message, so
//! that its bytes bound memory and time.

use super::definition::{Count, Definition, Field, Kind, Primitive};

/// Longest list of numbers that is kept.
///
/// Joints, poses and covariances are shorter; images, scans and clouds are longer.
pub(super) const LONGEST_LIST: usize = 512;

/// A decoded value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number; integers beyond 2^53 are rounded.
    Number(f64),
    /// A text.
    Text(String),
    /// A list of values.
    List(Vec<Value>),
    /// Named fields, in order.
    Record(Vec<(String, Value)>),
    /// A list that is too long to be a reading.
    Skipped,
}

impl Value {
    /// The field of a record.
    #[must_use]
    pub fn field(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Record(fields) => fields.iter().find(|(n, _)| n == name).map(|(_, v)| v),
            _ => None,
        }
    }

    /// The number, if it is one.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(x) => Some(*x),
            _ => None,
        }
    }
}

/// Decodes one message.
///
/// # Errors
/// When the message ends before its definition does, or is in another encoding.
pub fn decode(definition: &Definition, bytes: &[u8]) -> Result<Value, String> {
    let (head, body) = bytes
        .split_at_checked(4)
        .ok_or("a message is shorter than its header")?;
    // Representation identifiers, table 60: plain CDR of version 1, and of version 2, which aligns
    // numbers of 8 bytes to multiples of 4.
    let (little, widest) = match (head[0], head[1]) {
        (0, 0) => (false, 8),
        (0, 1) => (true, 8),
        (0, 6) => (false, 4),
        (0, 7) => (true, 4),
        (a, b) => {
            return Err(format!(
                "a message is in encoding {a:02x} {b:02x}, which is no plain CDR; is it compressed?"
            ));
        }
    };
    let mut cursor = Cursor {
        body,
        at: 0,
        little,
        widest,
    };
    let root = definition.records.first().map_or(&[][..], Vec::as_slice);
    cursor.record(definition, root)
}

struct Cursor<'a> {
    body: &'a [u8],
    at: usize,
    little: bool,
    /// Largest alignment of a number.
    widest: usize,
}

impl<'a> Cursor<'a> {
    fn align(&mut self, size: usize) {
        self.at = self.at.next_multiple_of(size.min(self.widest).max(1));
    }

    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let end = self.at.checked_add(n);
        let taken = end.and_then(|end| self.body.get(self.at..end));
        let taken = taken.ok_or("a message ends before its definition does")?;
        self.at += n;
        Ok(taken)
    }

    /// An unsigned integer of `n` bytes, at most 8.
    fn unsigned(&mut self, n: usize) -> Result<u64, String> {
        self.align(n);
        let little = self.little;
        let bytes = self.take(n)?;
        let join = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
        Ok(if little {
            bytes.iter().rev().fold(0, join)
        } else {
            bytes.iter().fold(0, join)
        })
    }

    fn length(&mut self) -> Result<usize, String> {
        let n = self.unsigned(4)?;
        usize::try_from(n).map_err(|e| e.to_string())
    }

    fn primitive(&mut self, kind: Primitive) -> Result<Value, String> {
        Ok(Value::Number(match kind {
            Primitive::Bool => f64::from(u8::from(self.unsigned(1)? != 0)),
            Primitive::Unsigned(n) => self.unsigned(n)? as f64,
            Primitive::Signed(n) => {
                // Shift the sign bit to the top and back.
                let unused = 64 - 8 * n as u32;
                let bits = self.unsigned(n)?;
                ((bits << unused).cast_signed() >> unused) as f64
            }
            Primitive::Float(4) => f64::from(f32::from_bits(self.unsigned(4)? as u32)),
            Primitive::Float(_) => f64::from_bits(self.unsigned(8)?),
            Primitive::Text => {
                let n = self.length()?;
                let bytes = self.take(n)?;
                let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
                return Ok(Value::Text(String::from_utf8_lossy(text).into_owned()));
            }
            Primitive::WideText => {
                let n = self.length()?;
                let n = n.checked_mul(2).ok_or("a text is too long")?;
                self.take(n)?;
                return Ok(Value::Skipped);
            }
        }))
    }

    fn record(&mut self, definition: &Definition, fields: &[Field]) -> Result<Value, String> {
        let mut values = Vec::with_capacity(fields.len());
        for field in fields {
            let value = match field.count {
                Count::One => self.one(definition, field.kind)?,
                Count::Fixed(n) => self.many(definition, field.kind, n)?,
                Count::Counted => {
                    let n = self.length()?;
                    self.many(definition, field.kind, n)?
                }
            };
            values.push((field.name.clone(), value));
        }
        Ok(Value::Record(values))
    }

    fn one(&mut self, definition: &Definition, kind: Kind) -> Result<Value, String> {
        match kind {
            Kind::Primitive(primitive) => self.primitive(primitive),
            Kind::Record(place) => {
                let fields = definition.records.get(place);
                self.record(definition, fields.ok_or("a definition has a hole")?)
            }
        }
    }

    fn many(&mut self, definition: &Definition, kind: Kind, n: usize) -> Result<Value, String> {
        // Every entry takes at least one byte.
        if n > self.body.len().saturating_sub(self.at) {
            return Err(format!("a message states {n} entries and ends before them"));
        }
        let fixed = match kind {
            Kind::Primitive(Primitive::Text | Primitive::WideText) | Kind::Record(_) => None,
            Kind::Primitive(primitive) => Some(primitive.size()),
        };
        if let (Some(size), true) = (fixed, n > LONGEST_LIST) {
            self.align(size);
            self.take(n.checked_mul(size).ok_or("a list is too long")?)?;
            return Ok(Value::Skipped);
        }
        let mut values = Vec::new();
        for i in 0..n {
            let value = self.one(definition, kind)?;
            if i < LONGEST_LIST {
                values.push(value);
            }
        }
        Ok(if n > LONGEST_LIST {
            Value::Skipped
        } else {
            Value::List(values)
        })
    }
}

/// Writes messages that [`decode`] reads, little-endian, version 1.
#[derive(Debug)]
pub struct Encoder {
    bytes: Vec<u8>,
}

impl Default for Encoder {
    fn default() -> Self {
        Self {
            bytes: vec![0, 1, 0, 0],
        }
    }
}

impl Encoder {
    fn align(&mut self, size: usize) {
        let body = self.bytes.len() - 4;
        self.bytes.resize(4 + body.next_multiple_of(size), 0);
    }

    /// Appends an unsigned integer of 4 bytes.
    pub fn u32(&mut self, x: u32) {
        self.align(4);
        self.bytes.extend(x.to_le_bytes());
    }

    /// Appends a signed integer of 4 bytes.
    pub fn i32(&mut self, x: i32) {
        self.align(4);
        self.bytes.extend(x.to_le_bytes());
    }

    /// Appends a float of 8 bytes.
    pub fn f64(&mut self, x: f64) {
        self.align(8);
        self.bytes.extend(x.to_le_bytes());
    }

    /// Appends a text.
    pub fn text(&mut self, text: &str) {
        self.u32(u32::try_from(text.len() + 1).unwrap_or(u32::MAX));
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// Appends a list of floats with its length.
    pub fn f64s(&mut self, xs: &[f64]) {
        self.u32(u32::try_from(xs.len()).unwrap_or(u32::MAX));
        xs.iter().for_each(|x| self.f64(*x));
    }

    /// The encoded message.
    #[must_use]
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng as _, SeedableRng as _};

    fn state() -> Vec<u8> {
        let mut message = Encoder::default();
        message.i32(12);
        message.u32(345);
        message.text("");
        message.u32(2);
        message.text("pan");
        message.text("tilt");
        message.f64s(&[0.25, -1.5]);
        message.f64s(&[]);
        message.f64s(&[3.0]);
        message.finish()
    }

    #[test]
    fn what_is_written_reads_back() {
        let definition = Definition::parse("sensor_msgs/msg/JointState", "").unwrap();
        let value = decode(&definition, &state()).unwrap();
        let stamp = value.field("header").unwrap().field("stamp").unwrap();
        assert_eq!(stamp.field("nanosec").unwrap().number(), Some(345.0));
        let numbers = |xs: &[f64]| Value::List(xs.iter().map(|x| Value::Number(*x)).collect());
        assert_eq!(value.field("position"), Some(&numbers(&[0.25, -1.5])));
        assert_eq!(value.field("effort"), Some(&numbers(&[3.0])));
        let names = ["pan", "tilt"].map(|n| Value::Text(n.into()));
        assert_eq!(value.field("name"), Some(&Value::List(names.into())));
    }

    /// Bytes by hand: a byte, then a float at the next multiple of 8 (of 4 in version 2), in both
    /// orders.
    #[test]
    fn numbers_lie_at_multiples_of_their_size() {
        let definition = Definition::parse("p/T", "int8 a\nfloat64 b\nint16 c").unwrap();
        let float = 1.5_f64;
        for (id, pad, little) in [(0, 7, false), (1, 7, true), (6, 3, false), (7, 3, true)] {
            let mut bytes = vec![0, id, 0, 0, 0xff];
            bytes.resize(5 + pad, 0);
            if little {
                bytes.extend(float.to_le_bytes());
                bytes.extend((-2_i16).to_le_bytes());
            } else {
                bytes.extend(float.to_be_bytes());
                bytes.extend((-2_i16).to_be_bytes());
            }
            let value = decode(&definition, &bytes).unwrap();
            let number = |name: &str| value.field(name).unwrap().number().unwrap();
            assert_eq!([number("a"), number("b"), number("c")], [-1.0, 1.5, -2.0]);
        }
    }

    #[test]
    fn truncated_messages_are_refused_at_every_length() {
        let definition = Definition::parse("sensor_msgs/msg/JointState", "").unwrap();
        let whole = state();
        for n in 0..whole.len() {
            assert!(decode(&definition, &whole[..n]).is_err(), "{n}");
        }
    }

    #[test]
    fn spoilt_and_random_messages_neither_panic_nor_grow() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let texts = [
            ("sensor_msgs/msg/JointState", ""),
            ("nav_msgs/msg/Odometry", ""),
            ("tf2_msgs/msg/TFMessage", ""),
            (
                "p/msg/T",
                "string[] a\nuint8[] b\nwstring c\nInner[] d\n====\nMSG: p/Inner\nint64[3] e\nInner2[] f\n====\nMSG: p/Inner2",
            ),
        ];
        for (name, text) in texts {
            let definition = Definition::parse(name, text).unwrap();
            for _ in 0..20_000 {
                let mut bytes = state();
                if rng.random_bool(0.5) {
                    bytes = (0..rng.random_range(0..200))
                        .map(|_| rng.random())
                        .collect();
                    if bytes.len() > 1 {
                        bytes[..2].copy_from_slice(&[0, 1]);
                    }
                }
                for _ in 0..rng.random_range(0..4) {
                    let at = rng.random_range(0..bytes.len().max(1));
                    if let Some(byte) = bytes.get_mut(at) {
                        *byte = rng.random();
                    }
                }
                let _ = decode(&definition, &bytes);
            }
        }
    }

    #[test]
    fn an_image_is_skipped_and_what_follows_is_read() {
        let definition = Definition::parse("p/T", "uint8[] data\nfloat64 x").unwrap();
        let mut message = Encoder::default();
        message.u32(6000);
        message.bytes.extend([7; 6000]);
        message.f64(2.5);
        let value = decode(&definition, &message.finish()).unwrap();
        assert_eq!(value.field("data"), Some(&Value::Skipped));
        assert_eq!(value.field("x").unwrap().number(), Some(2.5));
    }
}
