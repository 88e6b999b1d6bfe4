//! Sphere striking in free space: there are no walls, so the floor's rolling friction alone stops
//! the ball.
//!
//! Source: ASID (Memmel et al., ICLR 2024), appendix.

use crate::sphere::{Spec, Sphere};

/// Name on the command line.
const NAME: &str = "sphere-free";
/// One line for `asid list`.
const ABOUT: &str = "sphere striking in free space: no walls";

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(Sphere::new(spec())?)),
});

fn spec() -> Spec {
    Spec {
        fixtures: Vec::new(),
        ..Spec::published([NAME, ABOUT], include_str!("scene.xml"))
    }
}
