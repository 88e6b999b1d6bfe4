//! Panics of one copy of the standard library, and how they pass to another copy.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Mutex, PoisonError};

/// A panic that was caught.
pub struct Caught {
    /// Its message, and its place if known.
    pub text: String,
    /// Whether it began on the other side and only passed through this one.
    pub passing: bool,
}

/// What a side needs of the other side's copy of the standard library.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Panics {
    /// Runs work and catches panics of that copy.
    pub catch: fn(&mut dyn FnMut()) -> Result<(), Caught>,
    /// Panics in that copy with a text of this many bytes, as a panic that passes through.
    pub raise: unsafe extern "C-unwind" fn(*const u8, usize) -> !,
    /// Silences that copy's panics; their text is kept for [`Caught`].
    pub silence: fn(),
}

/// The functions of the copy that this code is compiled with.
pub const OWN: Panics = Panics {
    catch,
    raise,
    silence,
};

/// Payload of a panic that began on the other side.
struct Passing(String);

/// Message and place of the latest panic, while panics are silenced.
static LATEST: Mutex<Option<String>> = Mutex::new(None);

/// Runs work and catches panics of this copy.
pub fn catch(work: &mut dyn FnMut()) -> Result<(), Caught> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| match payload.downcast::<Passing>() {
        Ok(passing) => Caught {
            text: passing.0,
            passing: true,
        },
        Err(payload) => Caught {
            text: text(payload),
            passing: false,
        },
    })
}

/// The text of a payload, with its place if the hook recorded one.
fn text(payload: Box<dyn Any + Send>) -> String {
    let said = match payload.downcast::<String>() {
        Ok(text) => *text,
        Err(payload) => match payload.downcast_ref::<&'static str>() {
            Some(text) => (*text).to_owned(),
            None => {
                // Dropping a payload of any kind could panic again.
                std::mem::forget(payload);
                "without a message".to_owned()
            }
        },
    };
    let mut latest = LATEST.lock().unwrap_or_else(PoisonError::into_inner);
    let seen = latest.take().filter(|l| l.starts_with(&said));
    seen.unwrap_or(said)
}

/// Panics in this copy; `text` and `len` describe a UTF-8 text.
unsafe extern "C-unwind" fn raise(text: *const u8, len: usize) -> ! {
    // SAFETY: the caller passes the parts of a slice that outlives the call.
    let text = String::from_utf8_lossy(unsafe { std::slice::from_raw_parts(text, len) });
    resume_unwind(Box::new(Passing(text.into_owned())))
}

/// Keeps the text of panics instead of printing them; `RUST_BACKTRACE` prints them too.
fn silence() {
    let usual = std::env::var_os("RUST_BACKTRACE").map(|_| std::panic::take_hook());
    std::panic::set_hook(Box::new(move |info| {
        let said = info.payload_as_str().unwrap_or("panic");
        let place = info
            .location()
            .map(|l| format!(" ({}:{})", l.file(), l.line()))
            .unwrap_or_default();
        *LATEST.lock().unwrap_or_else(PoisonError::into_inner) = Some(format!("{said}{place}"));
        if let Some(usual) = &usual {
            usual(info);
        }
    }));
}
