//! Texts across the ABI: zero-terminated UTF-8.

use std::ffi::{CStr, CString, c_char};

use asid_core::{Error, Result};

/// Copies a text of the other side.
///
/// # Errors
/// When `what` is missing or is not UTF-8.
///
/// # Safety
/// `text` is null or points to a zero-terminated string.
pub unsafe fn read(text: *const c_char, what: &str) -> Result<String> {
    if text.is_null() {
        return Err(Error::Failed(format!("{what} is missing (NULL)")));
    }
    // SAFETY: not null, and zero-terminated as the caller promises.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str()
        .map(str::to_owned)
        .map_err(|_| Error::Failed(format!("{what} is not UTF-8")))
}

/// A text for the other side, in which characters that a C string cannot hold become spaces.
#[must_use]
pub fn owned(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).unwrap_or_default()
}

/// Reads a text from a buffer of fixed size, as one line. A buffer without a terminator is read to
/// its last byte.
#[must_use]
pub fn from_buffer(buffer: &[c_char]) -> String {
    let bytes: Vec<u8> = buffer
        .iter()
        .take_while(|&&c| c != 0)
        .map(|&c| c.cast_unsigned())
        .collect();
    let text = String::from_utf8_lossy(&bytes);
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Writes a text into a buffer of fixed size, truncated at a character boundary.
pub fn into_buffer(text: &str, buffer: &mut [c_char]) {
    let Some(room) = buffer.len().checked_sub(1) else {
        return;
    };
    let mut end = text.len().min(room);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let bytes = text.as_bytes()[..end].iter().map(|&b| b.cast_signed());
    let padding = std::iter::repeat(0);
    for (place, byte) in buffer.iter_mut().zip(bytes.chain(padding)) {
        *place = byte;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buffers_cut_at_characters_and_end_with_zero() {
        let mut buffer = [1; 6];
        into_buffer("größe", &mut buffer);
        assert_eq!(from_buffer(&buffer), "grö");
        assert_eq!(buffer[5], 0);
        into_buffer("a\n b", &mut buffer);
        assert_eq!(from_buffer(&buffer), "a b");
    }

    #[test]
    fn a_buffer_without_an_end_is_read_to_its_last_byte() {
        let buffer = [b'a'.cast_signed(); 4];
        assert_eq!(from_buffer(&buffer), "aaaa");
    }

    #[test]
    fn a_missing_text_is_named() {
        // SAFETY: null is allowed.
        let error = unsafe { read(std::ptr::null(), "the name") }.unwrap_err();
        assert_eq!(error.to_string(), "the name is missing (NULL)");
    }
}
