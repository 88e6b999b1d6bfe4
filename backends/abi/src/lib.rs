//! The C ABI of engines.
//!
//! An engine plugin is a shared library with one exported function, which gives a
//! table of functions ([`table`]; the header `include/asid_backend.h` is what its
//! author sees).

pub mod table;
