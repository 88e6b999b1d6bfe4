//! What ships trained with the program.

/// A file that is embedded.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// The task that it was trained for.
    pub task: &'static str,
    /// Name of the explorer, or `estimator-EXPLORER`.
    pub name: &'static str,
    /// The file.
    pub bytes: &'static [u8],
}

/// Every file of `algorithms/trained/TASK/NAME.safetensors`, sorted.
pub const ALL: &[Shipped] = include!(concat!(env!("OUT_DIR"), "/shipped.rs"));

/// The file of this name for a task.
#[must_use]
pub fn find(task: &str, name: &str) -> Option<Shipped> {
    ALL.iter()
        .find(|s| s.task == task && s.name == name)
        .copied()
}

/// Tasks that a file of this name ships for.
#[must_use]
pub fn tasks(name: &str) -> Vec<&'static str> {
    ALL.iter()
        .filter(|s| s.name == name)
        .map(|s| s.task)
        .collect()
}
