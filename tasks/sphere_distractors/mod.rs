//! Sphere striking among distractors: one ball of unknown rolling friction and three whose friction is known.
//!
//! An explorer that seeks what is new goes to any ball; one that seeks information about the unknown
//! goes to the one ball that tells it.
//!
//! Source: ASID (Memmel et al., ICLR 2024), appendix.

use crate::sphere::{STEERING, Spec, Sphere, conditions, rolling_friction, walls};

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
        name: NAME,
        about: ABOUT,
        xml: include_str!("scene.xml"),
        parameters: vec![rolling_friction("ball")],
        optional: Vec::new(),
        conditions: conditions(),
        steering: STEERING,
        horizon: 20,
        explored_from: [[0.43, 0.65], [-0.2, 0.2]],
        struck_from: [[0.55, 0.65], [0.03, 0.05]],
        goal: [0.65, -0.40],
        line: None,
        speed: [0.3, 1.4],
        seconds: 4.5,
        fixtures: walls(),
        regions: Vec::new(),
        distractors: &["distractor_1", "distractor_2", "distractor_3"],
        settings: &[],
    }
}
