//! HTML reports with inline SVG plots: one file that opens offline.
//!
//! Three layers, each usable on its own:
//!
//! - [`plot`] draws charts and plan views as SVG. All colours are CSS variables, so that one
//!   drawing serves a light and a dark page.
//! - [`page`] is the shell: header, tiles, sections, figures, tables, and the machine in 3-D.
//! - [`run`] holds the data of a run's report, which are stored as `trace.json` in the run's
//!   folder, and writes it as a page. [`diagnosis`] does the same for a diagnosis, from the types
//!   of `asid-results`.
//!
//! Non-finite numbers cause no failure: such a point is not drawn, and a table shows `n/a`.

pub mod diagnosis;
pub mod markup;
pub mod number;
pub mod page;
pub mod plot;
pub mod run;
mod style;
