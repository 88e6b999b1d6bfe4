//! Sphere striking in free space: the ball is stopped by the floor's rolling friction alone, for there are no walls.
//!
//! Source: ASID (Memmel et al., ICLR 2024), appendix.

use crate::sphere::{STEERING, Spec, Sphere, conditions, rolling_friction};

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
        name: NAME,
        about: ABOUT,
        xml: include_str!("scene.xml"),
        parameters: vec![rolling_friction("floor")],
        optional: Vec::new(),
        conditions: conditions(),
        steering: STEERING,
        horizon: 20,
        explored_from: [[0.43, 0.65], [-0.2, 0.23]],
        struck_from: [[0.55, 0.65], [0.03, 0.05]],
        goal: [0.65, -0.40],
        line: None,
        speed: [0.3, 1.4],
        seconds: 4.5,
        fixtures: Vec::new(),
        regions: Vec::new(),
        distractors: &[],
        settings: &[],
    }
}
