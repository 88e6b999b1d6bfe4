//! Top-view shapes, for pictures.

use asid_core::task::Outline;

use super::Area;

/// An axis-aligned rectangle between two corners.
#[must_use]
pub fn rectangle(label: &str, [x, y]: Area) -> Outline {
    Outline {
        label: label.into(),
        corners: vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]],
    }
}

/// The four walls of the arena.
#[must_use]
pub fn walls() -> Vec<Outline> {
    vec![
        rectangle("wall", [[0.18, 0.20], [-0.58, 0.38]]),
        rectangle("wall", [[0.80, 0.82], [-0.58, 0.38]]),
        rectangle("wall", [[0.20, 0.80], [-0.58, -0.56]]),
        rectangle("wall", [[0.20, 0.80], [0.36, 0.38]]),
    ]
}
