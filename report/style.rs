//! The style sheet of pages and of plots that stand alone.

/// The style sheet.
pub(crate) const STYLE: &str = include_str!("style.css");
