//! Restricts a set to some kinds, causes, worlds and sizes, for one question.

use serde::{Deserialize, Serialize};

use super::{Kind, Slot};
use crate::causes;
use crate::error::{Error, Result};
use crate::faults::Fault;
use crate::label::Label;

/// Which cases of the wheels a set takes. The default takes all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wanted {
    /// Kinds; empty stands for all.
    pub kinds: Vec<Kind>,
    /// Names of causes, of which a case has at least one; empty stands for all cases.
    pub causes: Vec<String>,
    /// Clean worlds (`false`) or dirty ones (`true`); `None` stands for both.
    pub dirty: Option<bool>,
    /// Minimum size for which causes are planned.
    ///
    /// In clean worlds it is an excess gap in noise floors, in dirty ones a multiple of the gap of
    /// the dirt.
    pub size: f64,
    /// Fault of the logs of every case; `None` stands for faults as dealt.
    ///
    /// The same seed with another fault of the log makes the same worlds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<Fault>,
}

impl Wanted {
    /// Whether all cases are taken.
    #[must_use]
    pub fn is_all(&self) -> bool {
        *self == Self::default()
    }

    /// Refuses what no wheel has.
    ///
    /// # Errors
    /// If a name is not that of a cause.
    pub fn check(&self) -> Result<()> {
        let known = |name: &str| causes::ALL.iter().any(|c| c.name() == name);
        match self.causes.iter().find(|name| !known(name)) {
            Some(name) => {
                let names: Vec<&str> = causes::ALL.iter().map(|c| c.name()).collect();
                let message = format!("there is no cause `{name}`; there are {}", names.join(", "));
                Err(Error::Wanted { message })
            }
            None => Ok(()),
        }
    }

    /// Whether a cause may be drawn.
    #[must_use]
    pub fn takes_cause(&self, name: &str) -> bool {
        self.causes.is_empty() || self.causes.iter().any(|c| c == name)
    }

    /// Whether the set takes a slot.
    #[must_use]
    pub fn takes(&self, slot: &Slot) -> bool {
        let caused = slot.kind == Kind::None || slot.aim(0) >= self.size;
        caused
            && self.takes_kind(slot.kind)
            && self.dirty.is_none_or(|dirty| dirty == slot.dirty)
            && (self.causes.is_empty() || slot.causes.iter().any(|c| self.takes_cause(c.name())))
    }

    /// Gives a slot the fault of the set.
    pub(super) fn spoil(&self, slot: &mut Slot) {
        if let Some(fault) = self.fault {
            (slot.fault, slot.wiring) = match fault {
                Fault::Nothing => (None, None),
                Fault::Log(fault) => (Some(fault), None),
                Fault::Wiring(kind) => (None, Some(kind)),
            };
        }
    }

    /// Whether the set takes a finished case: if a cause could not reach its size, another one was
    /// drawn.
    #[must_use]
    pub fn takes_label(&self, label: &Label) -> bool {
        let mut names = label
            .effects
            .iter()
            .map(|e| e.split('@').next().unwrap_or(e));
        Kind::named(&label.kind).is_some_and(|kind| self.takes_kind(kind))
            && (self.causes.is_empty() || names.any(|name| self.takes_cause(name)))
    }

    fn takes_kind(&self, kind: Kind) -> bool {
        self.kinds.is_empty() || self.kinds.contains(&kind)
    }
}
