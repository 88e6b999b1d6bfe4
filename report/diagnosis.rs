//! The report of a diagnosis: where simulation and reality differ, which effect is missing, and how
//! far the gap shrinks with it.
//!
//! It is drawn from `result.json` and `trace.json` ([`asid_results`]). Gaps are in units of the
//! sensors' noise, all else in the stated units. Whatever a diagnosis does not have stays empty
//! (`None`, NaN, an empty `Vec`). It is left out, with a remark where a reader would look for it.
//!
//! ```
//! use asid_results::diagnosis::DiagnosisResult;
//! let result = DiagnosisResult { sentence: "The board changes.".into(), ..Default::default() };
//! assert!(asid_report::diagnosis::page(&result, &Default::default()).contains("The board changes."));
//! ```

mod causes;
mod closing;
mod evidence;
mod forces;
mod head;
mod ladder;
mod lines;
mod places;
mod real_world;
mod remainder;
mod signals;
mod wiring;
mod words;

pub use real_world::lines as real_world_lines;
pub use words::values as effect_values;

use asid_results::diagnosis::DiagnosisResult;
use asid_results::trace::DiagnosisTrace;

/// Caption of the 3-D view.
const MACHINE: &str = "As logged, and as simulated by the recorded commands from the same start. Drag to turn it. The slider moves \
                       the line in the plots below; a click in a plot moves the slider.";

/// The report as one self-contained HTML page.
#[must_use]
pub fn page(result: &DiagnosisResult, trace: &DiagnosisTrace) -> String {
    let (d, t) = (result, trace);
    let sections = [
        wiring::section(d),
        Some(ladder::section(d, t)),
        real_world::section(d),
        crate::page::Section::machine(t.view.as_ref(), MACHINE),
        forces::section(d, t),
        Some(signals::section(d, t)),
        Some(places::section(d, t)),
        Some(causes::section(d, t)),
        remainder::section(d),
        closing::parameters(d),
        closing::tolerances(d),
        closing::checks(d),
        closing::next(d),
        closing::not_tried(d),
        closing::left_out(t),
        closing::repeat(t),
    ];
    sections
        .into_iter()
        .flatten()
        .fold(head::page(d, t), crate::page::Page::section)
        .html()
}
