//! The contract of the engines' own bare loops: what a user would write with the engine alone.

use anyhow::Result;

/// Simulations that run in plain loops, one after the other on each thread.
pub trait Bare {
    /// Resets every simulation to its initial state; not part of the measured time.
    ///
    /// # Errors
    /// If the engine refuses a state.
    fn rewind(&mut self) -> Result<()>;

    /// Runs all simulations once, spread evenly over `threads`.
    fn run(&mut self, threads: usize);

    /// Positions of simulation `i`, `nq` values.
    #[cfg(test)]
    fn qpos(&self, i: usize) -> Vec<f64>;
}
