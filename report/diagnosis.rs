//! The report of a diagnosis: where simulation leaves reality, which effect is missing, and
//! how far the gap shrinks with it.
//!
//! [`Diagnosis`] holds everything that the page shows, as plain data. Gaps are in units of
//! the sensors' noise, all else in the units that stand beside it. Whatever a diagnosis
//! does not have stays empty (`None`, NaN, an empty `Vec`) and is left out, with a remark
//! where a reader would look for it.
//!
//! ```
//! use asid_report::diagnosis::{Diagnosis, page};
//! let diagnosis = Diagnosis { study: "puck".into(), sentence: "The board changes.".into(), ..Diagnosis::default() };
//! assert!(page(&diagnosis).contains("The board changes."));
//! ```

mod causes;
mod closing;
mod data;
mod head;
mod ladder;
mod lines;
mod pictures;
mod places;
mod real_world;
mod trace;
mod wiring;
mod words;

pub use data::{
    Check, Diagnosis, Effect, EffectValue, Gap, Hypothesis, Kind, Parameter, Place, SignalGap,
    Verdict, Wiring,
};
pub use real_world::{RealWorld, TaskTrial};
pub use trace::{Map, Rung, SignalTrace};

/// The report as one self-contained HTML page.
#[must_use]
pub fn page(diagnosis: &Diagnosis) -> String {
    let d = diagnosis;
    let sections = [
        wiring::section(d),
        Some(ladder::section(d)),
        real_world::section(d),
        Some(pictures::section(d)),
        Some(places::section(d)),
        Some(causes::section(d)),
        closing::parameters(d),
        closing::checks(d),
        closing::next(d),
        closing::left_out(d),
        closing::repeat(d),
    ];
    sections
        .into_iter()
        .flatten()
        .fold(head::page(d), crate::page::Page::section)
        .html()
}
