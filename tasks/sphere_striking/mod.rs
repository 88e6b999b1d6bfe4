//! Sphere striking: find a floor's rolling friction by pushing a ball, then strike the ball so that
//! it comes to rest in a goal.
//!
//! A ball of 0.03 m radius and 0.02 kg lies in an arena with four walls. On a floor of rolling
//! friction `mu` (m) it decelerates by `5/7 mu g / r`. A strike that is right for 1e-3 m therefore
//! stops at a fifth of the distance at 5e-3 m.
//!
//! Source: ASID (Memmel et al., ICLR 2024), section 5.1 and its appendix.

use asid_core::parameter::{Parameter, Scale};

use crate::sphere::{Spec, Sphere, target};

/// Name on the command line.
const NAME: &str = "sphere-striking";
/// One line for `asid list`.
const ABOUT: &str = "find a floor's rolling friction, then strike a ball into a goal";

asid_core::register!(TaskEntry {
    name: NAME,
    about: ABOUT,
    make: || Ok(Box::new(Sphere::new(spec())?)),
});

/// The task with its published ranges.
fn spec() -> Spec {
    Spec {
        optional: vec![
            Parameter {
                name: "sliding_friction".into(),
                targets: target("geom/floor/friction/0"),
                range: [0.5, 1.5],
                scale: Scale::Linear,
                unit: String::new(),
            },
            // Time constant of the contact of ball and paddle; a smaller one is stiffer.
            Parameter {
                name: "stiffness".into(),
                targets: target("geom/ball/solref/0"),
                range: [0.01, 0.06],
                scale: Scale::Log,
                unit: "s".into(),
            },
        ],
        ..Spec::published([NAME, ABOUT], include_str!("scene.xml"))
    }
}
