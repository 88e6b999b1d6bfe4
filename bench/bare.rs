//! The contract of the engines' own bare loops: what a person would write who has only the engine.

use anyhow::Result;

/// Simulations that are stepped in plain loops, one after the other on each thread.
pub trait Bare {
    /// Puts every simulation at its start. Not part of what is measured.
    ///
    /// # Errors
    /// When the engine refuses a state.
    fn rewind(&mut self) -> Result<()>;

    /// Runs all of them once, spread evenly over `threads`.
    fn run(&mut self, threads: usize);

    /// Positions of simulation `i`, `nq`.
    #[cfg(test)]
    fn qpos(&self, i: usize) -> Vec<f64>;
}
