//! The style sheet of pages and of standalone plots.

/// The style sheet.
pub(crate) const STYLE: &str = include_str!("style.css");
