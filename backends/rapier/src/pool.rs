//! Thread pools for batches: one pool for each number of threads, made once.
//!
//! Algorithms make and drop batches by the hundred, and starting threads takes longer than many a
//! small batch runs. A pool outlives its batches; simultaneous batches share it.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use asid_core::{Error, Result};
use rayon::ThreadPool;

static POOLS: Mutex<BTreeMap<usize, Arc<ThreadPool>>> = Mutex::new(BTreeMap::new());

/// The pool with this many threads.
///
/// # Errors
/// When they cannot be started.
pub fn of(threads: usize) -> Result<Arc<ThreadPool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(pool) = pools.get(&threads) {
        return Ok(Arc::clone(pool));
    }
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("rapier-{i}"))
        .build()
        .map_err(|e| Error::Failed(format!("cannot start {threads} threads: {e}")))?;
    let pool = Arc::new(pool);
    pools.insert(threads, Arc::clone(&pool));
    Ok(pool)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_threads_has_one_pool() {
        let two = of(2).unwrap();
        assert_eq!(two.current_num_threads(), 2);
        assert!(Arc::ptr_eq(&two, &of(2).unwrap()));
        assert!(!Arc::ptr_eq(&two, &of(3).unwrap()));
    }

    /// The times are printed because they depend on the machine: `cargo test -p asid-rapier pool --
    /// --nocapture`.
    #[test]
    fn a_pool_that_is_there_costs_less_than_a_new_one() {
        const TIMES: u32 = 50;
        let time = |work: &mut dyn FnMut()| {
            let clock = std::time::Instant::now();
            (0..TIMES).for_each(|_| work());
            clock.elapsed().as_secs_f64() / f64::from(TIMES)
        };
        let new = time(&mut || {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
            pool.unwrap().install(|| ());
        });
        let shared = time(&mut || of(2).unwrap().install(|| ()));
        println!(
            "two threads: {:.0} µs started, {:.0} µs shared, ratio {:.1}",
            1e6 * new,
            1e6 * shared,
            new / shared
        );
    }
}
