//! TensorBoard event files: training curves under CleanRL's names.
//!
//! An event file is a sequence of records (TFRecord): the length as eight little-endian bytes, its
//! masked CRC-32C, the data, and the masked CRC-32C of the data. The data is a protocol-buffer
//! `Event`, of which five fields are used:
//!
//! ```text
//! Event   { double wall_time = 1; int64 step = 2; string file_version = 3; Summary summary = 5; }
//! Summary { repeated Value value = 1; }    Value { string tag = 1; float simple_value = 2; }
//! ```
//!
//! Source: tensorflow/core/util/event.proto, tensorflow/core/framework/summary.proto, and
//! tensorflow/core/lib/io/record_writer.h.

/// Values of one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Scalars {
    /// Environment steps, or another count along the curve.
    pub step: i64,
    /// Seconds since 1970.
    pub wall_time: f64,
    /// Values with their names, such as `charts/episodic_return`.
    pub values: Vec<(&'static str, f32)>,
}

/// Bytes of an event file.
#[must_use]
pub fn encode(events: &[Scalars]) -> Vec<u8> {
    let started = events.first().map_or(0.0, |e| e.wall_time);
    let mut version = double(1, started);
    version.extend(bytes(3, b"brain.Event:2"));
    let mut out = record(&version);
    for event in events {
        let mut summary = Vec::new();
        for (tag, value) in &event.values {
            let mut entry = bytes(1, tag.as_bytes());
            entry.push(key(2, FIXED32));
            entry.extend(value.to_le_bytes());
            summary.extend(bytes(1, &entry));
        }
        let mut data = double(1, event.wall_time);
        data.push(key(2, VARINT));
        data.extend(varint(event.step as u64));
        data.extend(bytes(5, &summary));
        out.extend(record(&data));
    }
    out
}

/// Wire types of protocol buffers.
const VARINT: u8 = 0;
const FIXED64: u8 = 1;
const LENGTH_DELIMITED: u8 = 2;
const FIXED32: u8 = 5;

/// Number and wire type of a field, for numbers below 16.
fn key(field: u8, wire: u8) -> u8 {
    field << 3 | wire
}

fn varint(mut value: u64) -> Vec<u8> {
    let mut out = Vec::new();
    loop {
        let low = (value & 0x7f) as u8;
        value >>= 7;
        if value == 0 {
            out.push(low);
            return out;
        }
        out.push(low | 0x80);
    }
}

fn double(field: u8, value: f64) -> Vec<u8> {
    let mut out = vec![key(field, FIXED64)];
    out.extend(value.to_le_bytes());
    out
}

fn bytes(field: u8, content: &[u8]) -> Vec<u8> {
    let mut out = vec![key(field, LENGTH_DELIMITED)];
    out.extend(varint(content.len() as u64));
    out.extend_from_slice(content);
    out
}

fn record(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let mut out = length.to_vec();
    out.extend(masked(&length).to_le_bytes());
    out.extend_from_slice(data);
    out.extend(masked(data).to_le_bytes());
    out
}

/// The checksum as TFRecord stores it: rotated and offset, so that checksums of data that contain
/// checksums stay sound.
fn masked(data: &[u8]) -> u32 {
    crc32c(data).rotate_right(15).wrapping_add(0xa282_ead8)
}

/// CRC-32C (Castagnoli; RFC 3720, appendix B.4), bit by bit, which suffices for small event files.
fn crc32c(data: &[u8]) -> u32 {
    /// The polynomial 0x1EDC6F41 with its bits reversed.
    const REVERSED_POLYNOMIAL: u32 = 0x82f6_3b78;
    let crc = data.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |c, _| {
            (c >> 1) ^ (REVERSED_POLYNOMIAL & (c & 1).wrapping_neg())
        })
    });
    !crc
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Test vectors of RFC 3720, appendix B.4.
    #[test]
    fn the_checksum_is_crc_32c() {
        assert_eq!(crc32c(b"123456789"), 0xe306_9283);
        assert_eq!(crc32c(&[0; 32]), 0x8a91_36aa);
        assert_eq!(crc32c(&[0xff; 32]), 0x62a8_ab43);
        let rising: Vec<u8> = (0..32).collect();
        assert_eq!(crc32c(&rising), 0x46dd_794e);
    }

    /// The file version at time 0, by hand: 09 and eight bytes of the time, then 1a 0d and the
    /// text. Its length is 24 = 0x18.
    #[test]
    fn the_first_record_is_the_version() {
        let file = encode(&[]);
        assert_eq!(file[..8], [0x18, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(file[8..12], masked(&file[..8]).to_le_bytes());
        assert_eq!(file[12..21], [0x09, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(file[21..23], [0x1a, 0x0d]);
        assert_eq!(&file[23..36], b"brain.Event:2");
        assert_eq!(file.len(), 40);
    }

    /// Step 300 takes two bytes, ac 02; the float 1.5 is 00 00 c0 3f.
    #[test]
    fn a_value_is_a_tag_and_a_float() {
        let event = Scalars {
            step: 300,
            wall_time: 0.0,
            values: vec![("a/b", 1.5)],
        };
        let file = encode(&[event]);
        let data = &file[40 + 12..file.len() - 4];
        let mut expected = vec![0x09, 0, 0, 0, 0, 0, 0, 0, 0, 0x10, 0xac, 0x02, 0x2a, 0x0c];
        expected.extend([
            0x0a, 0x0a, 0x0a, 0x03, b'a', b'/', b'b', 0x15, 0, 0, 0xc0, 0x3f,
        ]);
        assert_eq!(data, expected);
    }
}
