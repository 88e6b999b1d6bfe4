//! `asid identify`, `explore` and `export` on a machine that is no task.

#![cfg(feature = "mujoco")]
#![allow(clippy::unwrap_used)]

#[path = "../cli_support/mod.rs"]
#[allow(dead_code)]
mod cli_support;
mod explore;
mod identify;
mod play;
mod refusals;
#[path = "../diagnosis/world.rs"]
mod world;

use asid::core::Parameter;
use cli_support::Workplace;
use serde_json::Value;

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn ok(place: &Workplace, arguments: &[&str]) -> String {
    let done = place.run(arguments);
    assert!(
        done.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&done.stderr)
    );
    String::from_utf8(done.stdout).unwrap()
}

fn mass() -> Parameter {
    Parameter {
        name: "mass".into(),
        targets: vec!["geom/cart/mass".parse().unwrap()],
        range: [0.4, 3.0],
        scale: asid::core::parameter::Scale::Linear,
        unit: "kg".into(),
    }
}
