//! Text that strangers wrote, read without harm.
//!
//! A parser that follows elements or brackets by recursion ends the process where they have no end, and one that takes damaged
//! bytes for sound ones panics. Here such a document is an error of one line: [`xml`], [`toml_text`], and [`guard`] about the readers of other
//! crates.

pub mod guard;
pub mod toml_text;
pub mod xml;
