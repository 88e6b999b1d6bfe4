//! Worker threads that take pieces of work as they become free.
//!
//! There is one queue and no barrier: a free worker takes the next piece, so a long run does not
//! hold up the others. The result of a piece must not depend on which worker did it or when.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use asid_core::{Error, Result};

/// Stack size of a worker, bytes: that of a process's main thread, which engines expect.
const STACK: usize = 8 << 20;

/// Payload of a panic in a piece of work.
pub type Panic = Box<dyn Any + Send>;

/// Processes each piece once on `threads` threads; pieces start in order and run concurrently.
///
/// No new piece starts once `drain` is set. A panic ends only its own piece; `done` receives it.
///
/// # Errors
/// When a thread cannot be started.
pub fn run<T: Sync, R>(
    pieces: &[T],
    threads: usize,
    drain: &AtomicBool,
    work: impl Fn(&T) -> R + Sync,
    done: impl Fn(&T, Result<R, Panic>) + Sync,
) -> Result<()> {
    let next = AtomicUsize::new(0);
    let worker = || {
        while !drain.load(Ordering::SeqCst) {
            let Some(piece) = pieces.get(next.fetch_add(1, Ordering::SeqCst)) else {
                break;
            };
            done(piece, catch_unwind(AssertUnwindSafe(|| work(piece))));
        }
    };
    thread::scope(|scope| {
        for i in 0..threads.clamp(1, pieces.len().max(1)) {
            thread::Builder::new()
                .name(format!("cell-{i}"))
                .stack_size(STACK)
                .spawn_scoped(scope, worker)
                .map_err(|e| Error::Failed(format!("cannot start thread {i}: {e}")))?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn each_piece_is_done_once_at_any_number_of_threads_and_a_panic_harms_no_other() {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let pieces: Vec<u32> = (0..50).collect();
        for threads in [1, 3, 80] {
            let sum = Mutex::new((0, 0));
            let work = |&n: &u32| {
                assert!(n != 7, "seven");
                n
            };
            let done = |&n: &u32, result: Result<u32, Panic>| {
                let mut sum = sum.lock().unwrap();
                match result {
                    Ok(value) => sum.0 += value,
                    Err(panic) => {
                        assert_eq!((n, *panic.downcast_ref::<&str>().unwrap()), (7, "seven"));
                        sum.1 += 1;
                    }
                }
            };
            run(&pieces, threads, &AtomicBool::new(false), work, done).unwrap();
            assert_eq!(*sum.lock().unwrap(), (50 * 49 / 2 - 7, 1));
        }
        std::panic::set_hook(before);
    }

    #[test]
    fn nothing_is_begun_after_the_word_to_stop_and_what_runs_is_finished() {
        let drain = AtomicBool::new(false);
        let finished = Mutex::new(Vec::new());
        let work = |&n: &u32| {
            if n == 3 {
                drain.store(true, Ordering::SeqCst);
            }
            n
        };
        let pieces: Vec<u32> = (0..10).collect();
        let done = |_: &u32, n: Result<u32, Panic>| finished.lock().unwrap().push(n.unwrap());
        run(&pieces, 1, &drain, work, done).unwrap();
        assert_eq!(*finished.lock().unwrap(), [0, 1, 2, 3]);
    }
}
