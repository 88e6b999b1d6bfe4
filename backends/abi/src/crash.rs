//! A last message when a plugin crashes.
//!
//! A library can fail in ways that no outside check prevents: it may write to a foreign address, or
//! the file may be truncated behind a header that promises more. The system then ends the process
//! without an explanation. While a plugin is opened or called, a note of the current action is
//! therefore ready. A handler of the fatal signals writes it before the process ends with status 1.
//!
//! The handler does only what a signal handler may do: it reads an atomic pointer, writes bytes and
//! exits.

use std::path::Path;
use std::ptr::null_mut;
use std::sync::Mutex;
use std::sync::atomic::{AtomicPtr, Ordering};

/// A complete line to write.
struct Note {
    line: String,
}

/// The current action on a plugin; the latest one if several threads call.
static NOTE: AtomicPtr<Note> = AtomicPtr::new(null_mut());

/// Notes are made once for each plugin and action, and never freed.
static NOTES: Mutex<Vec<&'static Note>> = Mutex::new(Vec::new());

/// An action on a plugin, with its prepared note.
#[derive(Clone, Copy)]
pub struct Action {
    note: &'static Note,
}

impl Action {
    /// Prepares the note of an action, such as `rollout`, on a plugin's file.
    pub fn new(path: &Path, what: &str) -> Self {
        let line = format!(
            "asid: plugin {}: {what}: crashed, and this program with it\n",
            path.display()
        );
        let mut notes = NOTES.lock().unwrap_or_else(|e| e.into_inner());
        let known = notes.iter().find(|n| n.line == line).copied();
        let note = known.unwrap_or_else(|| {
            let note: &'static Note = Box::leak(Box::new(Note { line }));
            notes.push(note);
            note
        });
        Self { note }
    }

    /// Runs the action while its note is active.
    pub fn run<R>(self, work: impl FnOnce() -> R) -> R {
        let before = NOTE.swap(std::ptr::from_ref(self.note).cast_mut(), Ordering::Relaxed);
        let _restored = Restored(before);
        work()
    }
}

/// Restores the note of an outer action, also on a panic.
struct Restored(*mut Note);

impl Drop for Restored {
    fn drop(&mut self) {
        NOTE.store(self.0, Ordering::Relaxed);
    }
}

/// Installs the handler, once per process.
#[cfg(all(unix, not(miri)))]
pub fn watch() {
    use std::sync::Once;
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        for signal in [
            libc::SIGSEGV,
            libc::SIGBUS,
            libc::SIGILL,
            libc::SIGFPE,
            libc::SIGABRT,
        ] {
            install(signal);
        }
    });
}

/// Only Unix has these signals; elsewhere a crash leaves no message.
#[cfg(not(all(unix, not(miri))))]
pub fn watch() {}

#[cfg(all(unix, not(miri)))]
fn install(signal: libc::c_int) {
    // SAFETY: a zeroed `sigaction` is a valid one, both structures live through the calls, and the
    // handler does nothing that is forbidden to one. The standard library's own handler of stack
    // overflows is kept as `before`.
    unsafe {
        let mut before: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, std::ptr::null(), &mut before);
        if let Ok(mut all) = BEFORE.lock() {
            all.push((signal, before));
        }
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = handle as *const () as libc::sighandler_t;
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        libc::sigemptyset(&mut action.sa_mask);
        libc::sigaction(signal, &action, null_mut());
    }
}

/// The previous handlers of the signals.
#[cfg(all(unix, not(miri)))]
static BEFORE: Mutex<Vec<(libc::c_int, libc::sigaction)>> = Mutex::new(Vec::new());

#[cfg(all(unix, not(miri)))]
extern "C" fn handle(signal: libc::c_int, _: *mut libc::siginfo_t, _: *mut libc::c_void) {
    let note = NOTE.load(Ordering::Relaxed);
    // SAFETY: a note is never freed.
    if let Some(note) = unsafe { note.as_ref() } {
        // SAFETY: `write` and `_exit` may be called in a signal handler.
        unsafe {
            libc::write(2, note.line.as_ptr().cast(), note.line.len());
            libc::_exit(1);
        }
    }
    // No plugin is active. The previous handler gets the signal when the instruction is retried; an
    // abort is raised again.
    let before = BEFORE.try_lock().ok();
    let before = before.and_then(|all| {
        let of_signal = all.iter().find(|(s, _)| *s == signal);
        of_signal.map(|(_, action)| *action)
    });
    // SAFETY: the structure was filled in by the system, or is zeroed: the default.
    unsafe {
        let action = before.unwrap_or_else(|| std::mem::zeroed());
        libc::sigaction(signal, &action, null_mut());
        if signal == libc::SIGABRT {
            libc::raise(signal);
        }
    }
}
