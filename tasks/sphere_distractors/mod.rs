//! Sphere striking among distractors: one ball of unknown rolling friction, and three of known
//! friction.
//!
//! An explorer that seeks novelty goes to any ball. One that seeks information about the unknown
//! goes to the one informative ball.
//!
//! Source: ASID (Memmel et al., ICLR 2024), appendix.

use crate::sphere::{Spec, Sphere, rolling_friction};

/// Name on the command line.
const NAME: &str = "sphere-distractors";
/// One line for `asid list`.
const ABOUT: &str = "sphere striking among three balls of known friction";

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(Sphere::new(spec())?)),
});

fn spec() -> Spec {
    Spec {
        parameters: vec![rolling_friction("ball")],
        explored_from: [[0.43, 0.65], [-0.2, 0.2]],
        distractors: &["distractor_1", "distractor_2", "distractor_3"],
        ..Spec::published([NAME, ABOUT], include_str!("scene.xml"))
    }
}
