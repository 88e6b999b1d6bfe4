//! Wiring before physics: columns that are swapped, count the other way, are in another unit, have another zero, or another clock.
//!
//! They are the first thing that users of such tools meet, and no effect: a diagnosis that took them for physics would explain
//! anything. So they are looked for before any fit, by short predictions of the model as given ([`windows`]) under each view
//! of the columns ([`hypotheses`]); what makes sense of a log that was nonsense is proposed ([`evidence`]), as lines for
//! the study file, and the diagnosis goes on with it.

pub mod evidence;
pub mod hypotheses;
pub mod mend;
pub mod record;
pub mod search;
mod size;
pub mod view;
pub mod windows;

pub use evidence::Settings;
pub use mend::{Mended, mend};
