//! Limits of drives and of their joints, values of both that differ from the document's, and
//! integrators that an effect cannot do with.

use super::bench::{Bench, engines_that_load, near, scene};
use super::{DT, INERTIA, ROTOR};
use asid::core::Target;

/// Inertia of the drive's own rotor, kg m².
const ARMATURE: f64 = 0.05;

/// A rotor with a drive; `joint` are attributes of its joint.
fn machine(joint: &str, actuator: &str) -> String {
    let named = format!(r#"name="spin" armature="{ARMATURE}" {joint} axis"#);
    ROTOR
        .replace(r#"<motor name="drive" joint="spin" gear="1"/>"#, actuator)
        .replace(r#"name="spin" axis"#, &named)
        .replace(
            r#"gravity="0 0 0""#,
            r#"gravity="0 0 0" integrator="implicitfast""#,
        )
}

/// Effects on a drive, or that depend on its force.
const OF_DRIVES: [&str; 5] = [
    "backlash@spin:width=1e-4",
    "joint-compliance@spin:compliance=0.001",
    "load-friction@spin:coefficient=0.1",
    "actuator-saturation@drive:limit=1.7",
    "torque-speed-limit@drive:force=2.5,speed=9",
];

/// Symptom: with `actuatorfrcrange` in the document a servo pulled its elastic joint with a thousand
/// N m in place of 3, and friction of the load held it.
///
/// Cause: the parser of the document does not read this limit, and effects did not know it.
#[test]
fn a_limit_of_a_joint_is_one_of_its_drive() {
    let servo = |limit: &str| {
        format!(r#"<position name="drive" joint="spin" kp="1000" gear="-2" {limit}/>"#)
    };
    // Both limits are 3 N m at the joint.
    let of_joint = machine(r#"actuatorfrcrange="-3 3""#, &servo(""));
    let of_drive = machine("", &servo(r#"forcerange="-1.5 1.5""#));
    for effect in OF_DRIVES {
        for backend in engines_that_load(effect, &of_joint) {
            let [a, b] = [&of_joint, &of_drive]
                .map(|xml| Bench::new(&*backend, xml, &[effect]).hold(200, &[1.0]));
            for (a, b) in a.iter().zip(&b) {
                near(effect, a[0], b[0], 1e-9);
            }
        }
    }
    let gap = OF_DRIVES[0];
    for backend in engines_that_load(gap, &of_joint) {
        let angle = Bench::new(&*backend, &of_joint, &[gap]).hold(200, &[1.0])[199][0];
        let time = 200.0 * DT;
        let expected = -0.5 * 3.0 / (INERTIA + ARMATURE) * time * time;
        near(gap, angle, expected, -0.02 * expected);
    }
}

/// Symptom: an effect on a command held it at 0 with `ctrlrange="0 0"`, and did not hold it with
/// `inheritrange`.
///
/// Cause: the parser takes the first as a range and does not read the second. MuJoCo compiles both.
#[test]
fn a_range_of_a_command_is_that_of_the_engine() {
    let servo = |range: &str| {
        let limited = r#"limited="true" range="-1 1""#;
        machine(
            limited,
            &format!(r#"<position name="drive" joint="spin" kp="100" kv="20" {range}/>"#),
        )
    };
    let motor = |range: &str| {
        machine(
            "",
            &format!(r#"<motor name="drive" joint="spin" {range}/>"#),
        )
    };
    let pairs = [
        (servo(r#"inheritrange="1""#), servo(r#"ctrlrange="-1 1""#)),
        (motor(r#"ctrlrange="0 0""#), motor("")),
    ];
    for effect in [
        "actuator-gain@drive:gain=0.5",
        "supply-drift@drive:rate=0.5",
        "actuator-saturation@drive:limit=1.7",
    ] {
        for (stated, plain) in &pairs {
            for backend in engines_that_load(effect, stated) {
                let [a, b] = [stated, plain]
                    .map(|xml| Bench::new(&*backend, xml, &[effect]).hold(200, &[2.0]));
                for (a, b) in a.iter().zip(&b) {
                    near(effect, a[0], b[0], 1e-9);
                }
            }
        }
    }
}

/// Symptom: a study's `gear` or `forcerange` did nothing at a drive with an effect of a transmission
/// or of a limit.
///
/// Cause: these effects had the document's, and only the gains of the simulation.
#[test]
fn gears_and_limits_of_the_simulation_are_those_of_the_effects() {
    let motor = |gear: &str, range: &str| {
        machine(
            "",
            &format!(
                r#"<general name="drive" joint="spin" gainprm="2" gear="{gear}" forcerange="{range}"/>"#
            ),
        )
    };
    let servo = |gear: &str, range: &str| {
        machine(
            "",
            &format!(
                r#"<position name="drive" joint="spin" kp="30" kv="0.5" gear="{gear}" forcerange="{range}"/>"#
            ),
        )
    };
    let plain = machine("", r#"<motor name="drive" joint="spin" gear="1"/>"#);
    let geared = plain.replace(r#"gear="1""#, r#"gear="2""#);
    let cases = [
        ("gear/0", 2.0, plain, geared),
        ("gear/0", 2.0, servo("1", "-2 2"), servo("2", "-2 2")),
        ("forcerange/1", 6.0, motor("1", "-2 3"), motor("1", "-2 6")),
        ("forcerange/1", 6.0, servo("1", "-2 3"), servo("1", "-2 6")),
        (
            "forcerange/0",
            -0.5,
            motor("-1", "-2 3"),
            motor("-1", "-0.5 3"),
        ),
    ];
    for (attribute, value, was, is) in &cases {
        let target = format!("actuator/drive/{attribute}");
        let at: Target = target.parse().unwrap();
        for effect in OF_DRIVES {
            for backend in engines_that_load(effect, was) {
                if backend.load(&scene(was)).unwrap().nominal(&at).is_err() {
                    continue;
                }
                let values = [(target.as_str(), *value)];
                let mut given = Bench::with_values(&*backend, was, &values, &[effect]);
                let mut stated = Bench::new(&*backend, is, &[effect]);
                for command in [3.0, -3.0] {
                    let rows = [&mut given, &mut stated].map(|bench| bench.hold(60, &[command]));
                    for (a, b) in rows[0].iter().zip(&rows[1]) {
                        near(&format!("{effect}, {target}"), a[0], b[0], 1e-9);
                    }
                }
            }
        }
    }
}

/// Symptom: a servo with two limits of its force ran ahead of the lower one.
///
/// Cause: each of the two compensated the servo's damping.
#[test]
fn of_two_limits_of_a_servo_the_lower_one_holds() {
    // A small `kp`, since rapier's servos fall short by `kp v dt`. At 20 N m s/rad a second
    // compensation raises the speed by 8 %.
    let servo = machine(
        "",
        r#"<position name="drive" joint="spin" kp="1" kv="20"/>"#,
    );
    let of_speed = "torque-speed-limit@drive:force=1.5,speed=900";
    for limits in [
        [of_speed, "actuator-saturation@drive:limit=2"],
        ["actuator-saturation@drive:limit=2", of_speed],
        [
            "actuator-saturation@drive:limit=1.5",
            "torque-speed-limit@drive:force=2,speed=900",
        ],
    ] {
        for backend in engines_that_load(of_speed, &servo) {
            let rows = Bench::new(&*backend, &servo, &limits).hold(50, &[1e4]);
            let expected = 1.5 * 50.0 * DT / (INERTIA + ARMATURE);
            let what = limits.join(" and ");
            near(&what, rows[49][1], expected, 0.03 * expected);
        }
    }
}
