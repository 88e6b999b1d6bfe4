//! Wiring faults: columns that are swapped, have the wrong sign, another unit, another zero, or
//! another clock.
//!
//! They are the first problem that users of such tools meet, and are no effects: a diagnosis that
//! took them for physics would explain anything. So the program looks for them before any fit. The
//! model as given makes short predictions ([`windows`]) under each view of the columns
//! ([`hypotheses`]). A view under which a nonsensical log makes sense is proposed ([`evidence`]),
//! as lines for the study file, and the diagnosis continues with it.

pub mod evidence;
pub mod hypotheses;
pub mod mend;
pub mod record;
pub mod search;
mod size;
mod some_logs;
pub mod view;
pub mod windows;

pub use evidence::Settings;
pub use mend::{Mended, mend};
pub use some_logs::OfSomeLogs;
