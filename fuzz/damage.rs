//! Damaged files: what a disk, a broken transfer, a typo or an attacker makes of a valid file.
//!
//! A few operations that know nothing of the format change a valid file. They insert words and
//! numbers from the format's own files. Most results are close enough to a valid file to pass its
//! first checks.

use rand::Rng as _;

use crate::corpus::Corpus;

/// Longest input, bytes: four times the largest file of a corpus, so that repetition shows what
/// grows with it.
const LONGEST: usize = 1 << 18;
/// Maximum number of repetitions of a piece: more than the nesting that fills a stack of 2 MiB at
/// 100 bytes per level.
const MOST_REPEATS: usize = 20_000;
/// Share of inputs that begin as random bytes. Readers should reject these soon.
const RANDOM: f64 = 0.01;
/// Share of inputs that begin with the head of one file and the tail of another.
const SPLICED: f64 = 0.1;

/// Numbers at the limits of what types and readers can hold.
const NUMBERS: [&str; 30] = [
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "3",
    "255",
    "256",
    "65535",
    "65536",
    "1000000",
    "1e9",
    "2147483647",
    "2147483648",
    "-2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "18446744073709551616",
    "1e308",
    "-1e308",
    "1e309",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "",
];

/// Integers of binary formats at such limits.
const BINARY: [u64; 12] = [
    0,
    1,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    0xffff_ffff_ffff_ffff,
];

/// The random number generator of one input.
pub type Rng = asid_core::rng::Rng;

/// Makes one damaged file.
pub fn input(corpus: &Corpus, rng: &mut Rng) -> Vec<u8> {
    let mut bytes = start(corpus, rng);
    // Mostly one or two changes, which keep most of the format; some inputs get many.
    let mut changes = 1;
    while changes < 32 && rng.random_bool(0.5) {
        changes += 1;
    }
    for _ in 0..changes {
        change(&mut bytes, corpus, rng);
        bytes.truncate(LONGEST);
    }
    bytes
}

fn start(corpus: &Corpus, rng: &mut Rng) -> Vec<u8> {
    let one = |rng: &mut Rng| corpus.files[rng.random_range(0..corpus.files.len())].clone();
    if rng.random_bool(RANDOM) {
        let length = rng.random_range(0..300);
        return (0..length).map(|_| rng.random()).collect();
    }
    let mut bytes = one(rng);
    if rng.random_bool(SPLICED) {
        let other = one(rng);
        let at = rng.random_range(0..=bytes.len());
        let from = rng.random_range(0..=other.len());
        bytes.truncate(at);
        bytes.extend_from_slice(&other[from..]);
    }
    bytes
}

/// Start and length of a piece; short pieces are as likely as long ones.
fn piece(bytes: &[u8], rng: &mut Rng) -> std::ops::Range<usize> {
    let from = rng.random_range(0..=bytes.len());
    let longest = 1_usize << rng.random_range(0..12);
    let length = rng.random_range(0..=longest);
    from..bytes.len().min(from + length)
}

fn insert(bytes: &mut Vec<u8>, at: usize, new: &[u8]) {
    bytes.splice(at..at, new.iter().copied());
}

fn change(bytes: &mut Vec<u8>, corpus: &Corpus, rng: &mut Rng) {
    match rng.random_range(0..13) {
        0 | 1 if !bytes.is_empty() => {
            let at = rng.random_range(0..bytes.len());
            bytes[at] ^= 1 << rng.random_range(0..8);
        }
        2 if !bytes.is_empty() => {
            let at = rng.random_range(0..bytes.len());
            bytes[at] = rng.random();
        }
        3 => bytes.truncate(rng.random_range(0..=bytes.len())),
        4 => {
            let range = piece(bytes, rng);
            bytes.drain(range);
        }
        5 => {
            let range = piece(bytes, rng);
            let (at, copy) = (rng.random_range(0..=bytes.len()), bytes[range].to_vec());
            insert(bytes, at, &copy);
        }
        6 => repeat(bytes, corpus, rng),
        7 | 8 if !corpus.words.is_empty() => {
            let word = &corpus.words[rng.random_range(0..corpus.words.len())];
            let range = piece(bytes, rng);
            let range = range.start..(range.start + word.len()).min(bytes.len());
            if rng.random_bool(0.5) {
                bytes.splice(range, word.iter().copied());
            } else {
                insert(bytes, range.start, word);
            }
        }
        9 | 10 => number(bytes, rng),
        11 => binary(bytes, rng),
        _ => {
            let range = piece(bytes, rng);
            for byte in &mut bytes[range] {
                *byte = rng.random();
            }
        }
    }
}

/// Repeats a piece, or a word with its opening and closing, many times in place.
fn repeat(bytes: &mut Vec<u8>, corpus: &Corpus, rng: &mut Rng) {
    let times = 1 << rng.random_range(1..=MOST_REPEATS.ilog2());
    let at = rng.random_range(0..=bytes.len());
    let unit = match rng.random_range(0..3) {
        0 => b"[{(<\"'"[rng.random_range(0..6)..][..1].to_vec(),
        1 if !corpus.openings.is_empty() => {
            corpus.openings[rng.random_range(0..corpus.openings.len())].clone()
        }
        _ => bytes[piece(bytes, rng)].to_vec(),
    };
    if !unit.is_empty() {
        let times = times.min(LONGEST / unit.len());
        insert(bytes, at, &unit.repeat(times));
    }
}

/// Replaces a number in the text by one of [`NUMBERS`].
fn number(bytes: &mut Vec<u8>, rng: &mut Rng) {
    let from = rng.random_range(0..=bytes.len());
    let Some(first) = bytes[from..].iter().position(u8::is_ascii_digit) else {
        return;
    };
    let first = from + first;
    let digits = |b: &u8| b.is_ascii_digit() || b".eE+-".contains(b);
    let length = bytes[first..].iter().take_while(|b| digits(b)).count();
    let new = NUMBERS[rng.random_range(0..NUMBERS.len())];
    bytes.splice(first..first + length, new.bytes());
}

/// Overwrites 1, 2, 4 or 8 bytes by a number of [`BINARY`], in either byte order.
fn binary(bytes: &mut [u8], rng: &mut Rng) {
    let size = 1 << rng.random_range(0..4);
    if bytes.len() < size {
        return;
    }
    let at = rng.random_range(0..=bytes.len() - size);
    let value = BINARY[rng.random_range(0..BINARY.len())];
    if rng.random_bool(0.7) {
        bytes[at..at + size].copy_from_slice(&value.to_le_bytes()[..size]);
    } else {
        bytes[at..at + size].copy_from_slice(&value.to_be_bytes()[8 - size..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::rng::Streams;

    #[test]
    fn an_input_is_the_same_each_time_and_others_differ() {
        let corpus = Corpus::of_files(vec![b"<a b='1'><c/></a>".to_vec(), b"<a/>".to_vec()]);
        let streams = Streams::new(7);
        let of = |i: u64| input(&corpus, &mut streams.indexed("x", i));
        let distinct: std::collections::BTreeSet<Vec<u8>> = (0..200).map(of).collect();
        assert!(distinct.len() > 100 && (0..200).all(|i| of(i).len() <= LONGEST));
        assert_eq!(of(3), of(3));
    }
}
