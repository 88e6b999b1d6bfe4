//! The border between this program and a plugin, and the calls that cross it.

use std::panic::{panic_any, resume_unwind};
use std::path::Path;

use super::panics::{self, Caught, Panics};
use asid_core::error::{BLAMES_PLUGIN, Error, Result, blames_a_plugin};

/// A loaded plugin.
pub struct Loaded {
    /// Its file.
    pub path: &'static Path,
    /// Panics of its copy of the standard library.
    pub panics: Panics,
}

/// Direction of a call. In either direction this code runs in the host.
#[derive(Clone, Copy)]
pub enum Border {
    /// Into the plugin: the object is the plugin's.
    Inward(&'static Loaded),
    /// Out of the plugin: the object is the host's, and the plugin calls it.
    Outward(&'static Loaded),
}

impl Border {
    /// The border as seen by an argument of the call.
    pub fn back(self) -> Self {
        match self {
            Self::Inward(p) => Self::Outward(p),
            Self::Outward(p) => Self::Inward(p),
        }
    }

    /// Makes a call; a panic in it continues as a panic of the calling side.
    pub fn run<R>(self, work: impl FnOnce() -> R) -> R {
        match self.caught(work) {
            Ok(value) => value,
            Err(caught) => self.raise(caught),
        }
    }

    /// Makes a call that may fail; a panic of the plugin becomes an error.
    ///
    /// # Errors
    /// Those of the call, with the plugin's name where the message alone would not identify it, and
    /// [`Error::Failed`] when the plugin panicked.
    pub fn try_run<R>(self, work: impl FnOnce() -> Result<R>) -> Result<R> {
        match self.caught(work) {
            Ok(Ok(value)) => Ok(value),
            Ok(Err(error)) => Err(self.named(error)),
            Err(Caught {
                text,
                passing: false,
            }) if matches!(self, Self::Inward(_)) => Err(self.fault(&format!("panicked: {text}"))),
            Err(caught) => self.raise(caught),
        }
    }

    /// Drops a value on its own side; a panic during that is discarded.
    pub fn drop<T>(self, value: T) {
        let _ = self.caught(|| drop(value));
    }

    /// An error for a plugin that returned something invalid.
    fn fault(self, what: &str) -> Error {
        let (Self::Inward(plugin) | Self::Outward(plugin)) = self;
        Error::Failed(format!("{BLAMES_PLUGIN}{}: {what}", plugin.path.display()))
    }

    /// Refuses non-finite values of a plugin whose inputs were finite.
    ///
    /// # Errors
    /// [`Error::Failed`] naming the plugin, and `what` the first such value is.
    pub fn finite(self, given: &[f64], values: &[f64], what: &str) -> Result<()> {
        let Self::Inward(_) = self else { return Ok(()) };
        match values.iter().position(|x| !x.is_finite()) {
            Some(i) if given.iter().all(|x| x.is_finite()) => {
                Err(self.fault(&format!("{what} is {} (value {i})", values[i])))
            }
            _ => Ok(()),
        }
    }

    /// Refuses an invalid result of a plugin.
    ///
    /// # Errors
    /// [`Error::Failed`] naming the plugin, and what is wrong.
    pub fn require(self, checked: Result<(), String>) -> Result<()> {
        match (self, checked) {
            (Self::Inward(_), Err(what)) => Err(self.fault(&what)),
            _ => Ok(()),
        }
    }

    /// As [`Border::require`], for calls that cannot return an error.
    pub fn check(self, checked: Result<(), String>) {
        if let Err(error) = self.require(checked) {
            panic_any(error.to_string());
        }
    }

    /// As [`Border::finite`], for calls that cannot return an error.
    pub fn check_finite(self, given: &[f64], values: &[f64], what: &str) {
        if let Err(error) = self.finite(given, values, what) {
            panic_any(error.to_string());
        }
    }

    fn named(self, error: Error) -> Error {
        let Self::Inward(_) = self else { return error };
        match error {
            Error::Failed(m) | Error::Shape(m) if !blames_a_plugin(&m) => self.fault(&m),
            other => other,
        }
    }

    /// Runs work inside the `catch_unwind` of the side that owns the object.
    fn caught<R>(self, work: impl FnOnce() -> R) -> Result<R, Caught> {
        let (mut work, mut done) = (Some(work), None);
        let mut call = || done = work.take().map(|work| work());
        match self {
            Self::Inward(plugin) => (plugin.panics.catch)(&mut call)?,
            Self::Outward(_) => panics::catch(&mut call)?,
        }
        done.ok_or_else(|| Caught {
            text: "a call did not happen".into(),
            passing: false,
        })
    }

    /// Panics on the calling side.
    fn raise(self, caught: Caught) -> ! {
        match self {
            Self::Inward(_) if caught.passing => resume_unwind(Box::new(caught.text)),
            Self::Inward(_) => panic_any(
                self.fault(&format!("panicked: {}", caught.text))
                    .to_string(),
            ),
            // SAFETY: the text outlives the call, which copies it. The function unwinds through
            // this frame into the calling plugin, whose panic it is.
            Self::Outward(plugin) => unsafe {
                (plugin.panics.raise)(caught.text.as_ptr(), caught.text.len())
            },
        }
    }
}
