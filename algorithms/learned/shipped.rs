//! Trained networks that ship with the program.

/// An embedded file.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    /// The task that the network was trained for.
    pub task: &'static str,
    /// Name of the explorer, or `estimator-EXPLORER`.
    pub name: &'static str,
    /// The file's bytes.
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

/// Tasks for which a file of this name ships.
#[must_use]
pub fn tasks(name: &str) -> Vec<&'static str> {
    ALL.iter()
        .filter(|s| s.name == name)
        .map(|s| s.task)
        .collect()
}
