//! Transmissions beside other effects of the same drive.

use super::bench::{Bench, engines_for, near};
use super::{DT, INERTIA, ROTOR};

/// Inertia of the drive's own rotor, kg m².
const ARMATURE: f64 = 0.1;

fn machine(actuator: &str) -> String {
    ROTOR
        .replace(r#"<motor name="drive" joint="spin" gear="1"/>"#, actuator)
        .replace(
            r#"name="spin" axis"#,
            &format!(r#"name="spin" armature="{ARMATURE}" axis"#),
        )
        .replace(
            r#"gravity="0 0 0""#,
            r#"gravity="0 0 0" integrator="implicitfast""#,
        )
}

const MOTOR: &str = r#"<motor name="drive" joint="spin"/>"#;
const TRANSMISSIONS: [&str; 2] = [
    "joint-compliance@spin:compliance=0.001",
    "backlash@spin:width=0.01",
];

/// Symptom: a friction that grows with the load vanished where the elasticity of the joint was named
/// before it, and limits of the force acted on the wrong side of it.
///
/// Cause: a transmission takes the drive from its joint, and the other effects then saw none.
#[test]
fn beside_a_transmission_effects_may_be_named_in_any_order() {
    let servo = r#"<position name="drive" joint="spin" kp="100" kv="2" forcerange="-9 9"/>"#;
    for (actuator, others) in [
        (MOTOR, &["load-friction@spin:coefficient=0.5"][..]),
        (MOTOR, &["actuator-saturation@drive:limit=0.6"][..]),
        (servo, &["load-friction@spin:coefficient=0.3"][..]),
        (
            servo,
            &[
                "load-friction@spin:coefficient=0.3",
                "servo-stiffness@drive:factor=0.1",
            ][..],
        ),
        (servo, &["actuator-saturation@drive:limit=2"][..]),
        (servo, &["torque-speed-limit@drive:force=4,speed=3"][..]),
    ] {
        let xml = machine(actuator);
        for transmission in TRANSMISSIONS {
            for backend in engines_for(transmission) {
                let first = [&[transmission][..], others].concat();
                let last = [others, &[transmission]].concat();
                let [first, last] = [first, last]
                    .map(|effects| Bench::new(&*backend, &xml, &effects).hold(200, &[1.0]));
                assert!(first == last, "{others:?}, {transmission}");
            }
        }
    }
}

/// The drive moves rotor and load with the share of its force that the friction leaves.
#[test]
fn friction_of_the_load_takes_its_share_behind_a_spring() {
    let effects = [TRANSMISSIONS[0], "load-friction@spin:coefficient=0.5"];
    for backend in engines_for(effects[1]) {
        let angle = Bench::new(&*backend, &machine(MOTOR), &effects).hold(200, &[1.0])[199][0];
        let time = 200.0 * DT;
        let expected = 0.5 * 0.5 / (INERTIA + ARMATURE) * time * time;
        near(backend.name(), angle, expected, 0.05 * expected);
    }
}

/// A limit that an effect sets is that of a drive that has it itself.
#[test]
fn a_limit_behind_a_transmission_is_the_one_of_its_drive() {
    for (kind, limit) in [(r#"position kp="1000" kv="5""#, 3.0), ("motor", 0.6)] {
        let plain = format!(r#"<{kind} name="drive" joint="spin"/>"#);
        let limited = plain.replace("/>", &format!(r#" forcerange="-{limit} {limit}"/>"#));
        let effect = format!("actuator-saturation@drive:limit={limit}");
        for transmission in TRANSMISSIONS {
            for backend in engines_for(transmission) {
                let run = |actuator: &str, effects: &[&str]| {
                    Bench::new(&*backend, &machine(actuator), effects).hold(200, &[1.0])
                };
                let own = run(&limited, &[transmission]);
                let added = run(&plain, &[&effect, transmission]);
                for (a, b) in own.iter().zip(&added) {
                    near(transmission, b[0], a[0], 1e-9);
                }
            }
        }
    }
}

/// The speed approaches that of the drive with the time constant `(I + J) v0 / F`, as without a
/// transmission.
#[test]
fn a_torque_speed_line_holds_behind_a_transmission() {
    let (force, speed): (f64, f64) = (2.0, 3.0);
    let effects = [
        "torque-speed-limit@drive:force=2,speed=3",
        "joint-compliance@spin:compliance=1e-4",
    ];
    for backend in engines_for(effects[0]) {
        let rows = Bench::new(&*backend, &machine(MOTOR), &effects).hold(500, &[5.0]);
        let rate = force / ((INERTIA + ARMATURE) * speed);
        for k in [100, 500] {
            let expected = -(-rate * k as f64 * DT).exp_m1() * speed;
            near(backend.name(), rows[k - 1][1], expected, 0.02);
        }
    }
}
