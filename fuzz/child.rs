//! The process that reads inputs. It detects panics and memory use itself; a second thread detects
//! hangs.
//!
//! It reports by lines on standard output: `state` twice a second, `finding` for a problem, `end`.

use std::fs::File;
use std::io::Write as _;
use std::os::unix::fs::FileExt as _;
use std::panic::AssertUnwindSafe;
use std::path::PathBuf;
use std::process::exit;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use asid_core::rng::Streams;

use crate::finding::Finding;
use crate::readers::{self, Reader};
use crate::{damage, memory, work_time};

/// Most bytes that one input may hold at a time.
///
/// A log of one hour at 1 kHz with 20 columns takes 0.6 GB as numbers. Inputs have at most 0.3 MB,
/// so a thousand times their size is more than any layout of them needs.
pub const MOST_MEMORY: usize = 256 << 20;
/// CPU time after which an input counts as a hang, s: a thousand times that of the median input.
const HANG_CPU_S: f64 = 10.0;
/// Wall-clock time after which an input counts as a hang without CPU time, because it waits for
/// something.
const HANG_WAIT: Duration = Duration::from_secs(300);
/// Stack of the reading thread: Rust's default for a thread, the smallest that a caller has.
const STACK: usize = 2 << 20;
/// Time between two `state` lines.
const REPORT: Duration = Duration::from_millis(500);

/// File in the scratch folder with the number of the current input.
pub const AT: &str = "at";
/// Exit status after a hang.
pub const HUNG: i32 = 3;

/// Arguments of `child`.
#[derive(clap::Args)]
pub struct Arguments {
    #[arg(long)]
    reader: String,
    #[arg(long)]
    seed: u64,
    #[arg(long)]
    from: u64,
    #[arg(long)]
    to: u64,
    /// Stops at the next input after this many seconds.
    #[arg(long)]
    seconds: f64,
    #[arg(long)]
    scratch: PathBuf,
}

/// The random streams from which a reader's inputs are drawn.
#[must_use]
pub fn streams(seed: u64, reader: &str) -> Streams {
    Streams::new(seed).child(reader)
}

/// Number of the current input.
static CURRENT: AtomicU64 = AtomicU64::new(u64::MAX);
/// Message and place of the latest panic, until it is taken.
static PANIC: Mutex<Option<(String, String)>> = Mutex::new(None);

fn latest_panic() -> Option<(String, String)> {
    PANIC.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// Whether a source path belongs to this repository, whose paths are relative to its root; others
/// are absolute.
fn is_own(place: &str) -> bool {
    !place.starts_with(['/', '\\']) && !place.starts_with("library/")
}

/// Reads the inputs.
///
/// # Errors
/// If the corpus or the scratch folder cannot be used.
pub fn run(arguments: &Arguments) -> Result<()> {
    let reader = readers::named(&arguments.reader)?;
    std::panic::set_hook(Box::new(|info| {
        let text = info.payload_as_str().unwrap_or("panic");
        let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
        let place = info
            .location()
            .map_or_else(String::new, |l| format!("{}:{}", l.file(), l.line()));
        *PANIC.lock().unwrap_or_else(PoisonError::into_inner) = Some((text, place));
    }));
    std::thread::spawn(watch);
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(STACK);
        let running = thread.spawn_scoped(scope, || read_all(reader, arguments))?;
        running
            .join()
            .map_err(|_| anyhow::anyhow!("the harness itself failed"))?
    })
}

/// Ends the process if one input takes too long.
fn watch() {
    let (mut seen, mut since) = (u64::MAX, (Instant::now(), 0.0));
    loop {
        std::thread::sleep(Duration::from_millis(100));
        let current = CURRENT.load(Ordering::Relaxed);
        let cpu = work_time::of_process().unwrap_or(0.0);
        if current != seen || current == u64::MAX {
            (seen, since) = (current, (Instant::now(), cpu));
            continue;
        }
        let (waited, worked) = (since.0.elapsed(), cpu - since.1);
        if worked > HANG_CPU_S || waited > HANG_WAIT {
            let message = format!("{worked:.1} s of CPU time in {:.0} s", waited.as_secs_f64());
            let finding = Finding {
                kind: "hang".into(),
                index: current,
                message,
            };
            say(&finding.line());
            exit(HUNG);
        }
    }
}

fn say(line: &str) {
    let mut out = std::io::stdout().lock();
    let _ = writeln!(out, "{line}");
    let _ = out.flush();
}

/// Figures of the inputs read so far.
#[derive(Clone, Copy, Default)]
struct State {
    inputs: u64,
    accepted: u64,
    most_memory: usize,
    slowest: Duration,
    slowest_index: u64,
    cpu: Duration,
}

impl State {
    fn say(&self) {
        say(&format!(
            "state {} {} {} {} {} {}",
            self.inputs,
            self.accepted,
            self.most_memory,
            self.slowest.as_micros(),
            self.slowest_index,
            self.cpu.as_micros()
        ));
    }
}

fn read_all(reader: &'static Reader, arguments: &Arguments) -> Result<()> {
    let corpus = (reader.corpus)()?;
    (reader.prepare)(&arguments.scratch)?;
    let input = arguments.scratch.join(reader.file);
    if let Some(folder) = input.parent() {
        std::fs::create_dir_all(folder)?;
    }
    // Memory that a reader allocates only once must not count for an input.
    let _ = std::panic::catch_unwind(|| {
        std::fs::write(&input, &corpus.files[0]).map(|()| (reader.read)(&input))
    });
    latest_panic();
    let at =
        File::create(arguments.scratch.join(AT)).context("cannot write into the scratch folder")?;
    let streams = streams(arguments.seed, reader.name);
    let (start, mut told) = (Instant::now(), Instant::now());
    let mut state = State::default();
    for index in arguments.from..arguments.to {
        if start.elapsed().as_secs_f64() > arguments.seconds {
            break;
        }
        let bytes = damage::input(&corpus, &mut streams.indexed("input", index));
        std::fs::write(&input, &bytes)?;
        at.write_at(&index.to_le_bytes(), 0)?;
        CURRENT.store(index, Ordering::Relaxed);
        let before = (memory::reset(), work_time::of_thread(), Instant::now());
        let read = std::panic::catch_unwind(AssertUnwindSafe(|| (reader.read)(&input)));
        let most = memory::most_since(before.0);
        let took = match (before.1, work_time::of_thread()) {
            (Some(a), Some(b)) => b.saturating_sub(a),
            _ => before.2.elapsed(),
        };
        CURRENT.store(u64::MAX, Ordering::Relaxed);
        state.inputs += 1;
        state.cpu += took;
        state.most_memory = state.most_memory.max(most);
        if took > state.slowest {
            (state.slowest, state.slowest_index) = (took, index);
        }
        state.accepted += u64::from(matches!(read, Ok(Ok(()))));
        for (kind, message) in wrong(&read, most) {
            let kind = kind.to_owned();
            say(&Finding {
                kind,
                index,
                message,
            }
            .line());
        }
        if told.elapsed() > REPORT {
            state.say();
            told = Instant::now();
        }
    }
    state.say();
    say("end");
    Ok(())
}

/// Problems with the reading of an input.
fn wrong(
    read: &std::thread::Result<Result<(), String>>,
    most: usize,
) -> Vec<(&'static str, String)> {
    let mut found = Vec::new();
    let panic = latest_panic();
    match (read, panic) {
        (Err(_), panic) => {
            let (text, place) = panic.unwrap_or_default();
            found.push(("panic", format!("{text} at {place}")));
        }
        // A failed check of another library may be caught; a panic of our own code is a fault even
        // then.
        (Ok(_), Some((text, place))) if is_own(&place) => {
            found.push(("caught", format!("{text} at {place}")));
        }
        _ => {}
    }
    if let Ok(Err(message)) = read
        && message.trim().is_empty()
    {
        found.push(("message", "the error says nothing".into()));
    }
    if most > MOST_MEMORY {
        found.push(("memory", format!("{} MB", most >> 20)));
    }
    found
}
