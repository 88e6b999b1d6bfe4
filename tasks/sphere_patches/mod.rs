//! Sphere patches: find the rolling frictions of three floor patches, then strike a ball from the
//! first over the second so that it comes to rest in the last.
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.1 and its appendix.

use asid_core::parameter::{Parameter, Scale};
use asid_core::task::{Condition, Outline};

use crate::sphere::Number::{Real, Whole};
use crate::sphere::{Area, STEERING, Setting, Spec, Sphere, rectangle, target, walls};
use crate::steering::Steering;

/// Name on the command line.
const NAME: &str = "sphere-patches";
/// One line for `asid list`.
const ABOUT: &str = "find the rolling frictions of three patches, then strike a ball into the last";

/// Prior range of each rolling friction, m. The paper's reaches down to 1e-5 m, where a ball takes
/// 9 s to stop and one part in a thousand of its energy decides whether it stops in the goal.
const RANGE: [f64; 2] = [2e-4, 1e-3];

/// Rolling friction of every patch in the out-of-range condition, m.
const OUT_OF_RANGE: f64 = 1.2e-3;

/// The patches, first to last: ranges of x and y, m.
pub const PATCHES: [Area; 3] = [
    [[0.2, 0.8], [0.056, 0.368]],
    [[0.2, 0.8], [-0.256, 0.056]],
    [[0.2, 0.8], [-0.568, -0.256]],
];

/// Settings for an episode three times as long as in the other tasks.
///
/// The planner's search is broad and not deep, since few plans carry the ball into every patch:
/// fewer segments and more plans, each tried at one value of the unknowns. The search for a strike
/// is broad too. Slow balls stop at a seam between two patches whatever their speed, and a search
/// that begins with few strikes can settle there.
const SETTINGS: [Setting; 7] = [
    ("explorer", "fisher-cem", "hold", Whole(15)),
    ("explorer", "fisher-cem", "iterations", Whole(3)),
    ("explorer", "fisher-cem", "population", Whole(24)),
    ("explorer", "fisher-cem", "prior_samples", Whole(1)),
    ("explorer", "fisher-cem", "std", Real(0.2)),
    ("solver", "cem", "population", Whole(24)),
    ("solver", "cem", "belief_samples", Whole(2)),
];

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(Sphere::new(spec())?)),
});

/// Name of the unknown of a patch.
fn unknown(patch: usize) -> String {
    format!("rolling_friction_{patch}")
}

fn spec() -> Spec {
    let regions: Vec<Outline> = PATCHES
        .iter()
        .enumerate()
        .map(|(i, area)| rectangle(&format!("patch {}", i + 1), *area))
        .collect();
    let mut fixtures = walls();
    fixtures.extend(regions.iter().cloned());
    Spec {
        parameters: (1..=3)
            .map(|patch| Parameter {
                name: unknown(patch),
                targets: target(&format!("geom/patch_{patch}/friction/2")),
                range: RANGE,
                scale: Scale::Log,
                unit: "m".into(),
            })
            .collect(),
        conditions: vec![
            Condition::drawn("in-range", &[]),
            Condition {
                name: "out-of-range".into(),
                truth: (1..=3).map(|p| (unknown(p), [OUT_OF_RANGE; 2])).collect(),
            },
        ],
        steering: Steering {
            y: [-0.46, 0.29], // start position of the hand
            ..STEERING
        },
        horizon: 60,
        explored_from: [[0.43, 0.65], [0.17, 0.23]],
        struck_from: [[0.55, 0.63], [0.21, 0.23]],
        goal: [0.60, -0.38],
        line: Some(-0.46),
        speed: [0.15, 0.7],
        seconds: 7.0,
        fixtures,
        regions,
        settings: &SETTINGS,
        ..Spec::published([NAME, ABOUT], include_str!("scene.xml"))
    }
}
