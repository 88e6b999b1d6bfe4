//! Gains of servos, with and without force limits.

use super::INERTIA;
use super::bench::{Bench, engines_for, near, on_each};

/// A servo that holds a weight of 1 kg at 0.2 m on a level axis. The inertia about the axis is that
/// of the other scenes.
fn loaded(servo: &str) -> String {
    format!(
        r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 -9.81" integrator="implicitfast"/>
  <worldbody><body name="arm"><joint name="spin" axis="0 -1 0" damping="1"/>
    <inertial pos="0.2 0 0" mass="1" diaginertia="0.46 0.46 0.46"/></body></worldbody>
  <actuator><{servo} name="drive" joint="spin"/></actuator>
  <sensor><jointpos name="angle" joint="spin"/><jointvel name="speed" joint="spin"/></sensor></mujoco>"#
    )
}

/// The same without weight.
fn weightless(servo: &str) -> String {
    loaded(servo).replace("-9.81", "0")
}

const STIFF: &str = r#"position kp="60" kv="2""#;

#[test]
fn a_soft_servo_sags_by_the_load_over_its_gain() {
    let effect = "servo-stiffness@drive:factor=0.5";
    on_each(&loaded(STIFF), &[effect], |bench| {
        let angle = bench.hold(8000, &[0.0])[7999][0];
        let load = 9.81 * 0.2 * angle.cos();
        near(&bench.engine, angle, -load / 30.0, 1e-4);
    });
}

#[test]
fn gains_are_those_of_the_engine() {
    for (effect, servo) in [
        (
            "servo-stiffness@drive:factor=0.02",
            r#"position kp="1.2" kv="2""#,
        ),
        (
            "servo-damping@drive:damping=3",
            r#"position kp="60" kv="5""#,
        ),
        (
            "servo-damping@drive:damping=-9",
            r#"position kp="60" kv="0""#,
        ),
    ] {
        for limit in ["", r#" forcerange="-3 3""#] {
            for backend in engines_for(effect) {
                let run = |servo: &str, effects: &[&str]| {
                    let xml = loaded(&format!("{servo}{limit}"));
                    Bench::new(&*backend, &xml, effects).hold(300, &[0.4])
                };
                let (native, with) = (run(servo, &[]), run(STIFF, &[effect]));
                assert!(native == with, "{effect}, {}", backend.name());
            }
        }
    }
}

/// A model 60 times as stiff as the machine, with a force limit. Far from the goal the servo is at
/// its limit, like the machine; near the goal it is not.
#[test]
fn a_limited_servo_is_at_its_limit_until_its_gain_asks_for_less() {
    let servo = r#"position kp="998" kv="0" forcerange="-2.9 2.9""#;
    let effect = "servo-stiffness@drive:factor=0.016";
    let kp = 998.0 * 0.016;
    on_each(&weightless(servo), &[effect], |bench| {
        // Above an error of 2.9 / kp the limit pushes against the damping of 1 N m s/rad.
        let rows = bench.hold(100, &[1.0]);
        let t = 0.2_f64;
        let speed = 2.9 * -(-t / INERTIA).exp_m1();
        near(&bench.engine, rows[99][1], speed, 0.01);
        // At the end it rests at its goal.
        let end = bench.hold(10_000, &[1.0]);
        near(&bench.engine, end[9999][0], 1.0, 1e-3);
        // About the goal it oscillates as on a spring of this gain: w = sqrt(kp / I - (d / 2 I)²).
        let rows = bench.state(&[1.05], &[0.0]).hold(2000, &[1.0]);
        let crossings: Vec<f64> = rows
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| (pair[0][0] - 1.0) * (pair[1][0] - 1.0) < 0.0)
            .map(|(k, pair)| k as f64 + (pair[0][0] - 1.0) / (pair[0][0] - pair[1][0]))
            .collect();
        let half = (crossings[2] - crossings[0]) / 2.0 * super::DT;
        let omega = (kp / INERTIA - (1.0 / (2.0 * INERTIA)).powi(2)).sqrt();
        near(
            &bench.engine,
            half,
            std::f64::consts::PI / omega,
            0.01 * half,
        );
    });
}

/// A velocity servo approaches its command with the time constant `I / (kv + d)`.
#[test]
fn damping_of_a_velocity_servo_is_its_gain() {
    let servo = r#"velocity kv="1""#;
    on_each(
        &weightless(servo),
        &["servo-damping@drive:damping=2"],
        |bench| {
            let rows = bench.hold(2000, &[0.8]);
            let (end, rate) = (3.0 * 0.8 / 4.0, 4.0 / INERTIA);
            near(&bench.engine, rows[1999][1], end, 1e-3);
            let early = end * -(-rate * 0.1_f64).exp_m1();
            near(&bench.engine, rows[49][1], early, 0.01);
        },
    );
}

/// Effects that limit a servo's force, or depend on it, use the changed gain and not the model's.
#[test]
fn effects_of_the_force_follow_the_gain() {
    let soft = "servo-stiffness@drive:factor=0.1";
    let plain = r#"position kp="60""#;
    let scaled = r#"position kp="6""#;
    for other in [
        "actuator-saturation@drive:limit=2",
        "torque-speed-limit@drive:force=2,speed=3",
        "load-friction@spin:coefficient=0.3",
        "backlash@spin:width=0.05",
    ] {
        for backend in engines_for(other) {
            let run = |servo: &str, effects: &[&str]| {
                Bench::new(&*backend, &weightless(servo), effects).hold(500, &[0.5])
            };
            let native = run(scaled, &[other]);
            for order in [[soft, other], [other, soft]] {
                for (a, b) in native.iter().zip(run(plain, &order)) {
                    near(other, b[0], a[0], 1e-9);
                }
            }
        }
    }
}

#[test]
fn sites_are_servos_with_the_gain() {
    let sites = |effect: &str, actuators: &str| {
        let xml = loaded("motor").replace("<motor name=\"drive\" joint=\"spin\"/>", actuators);
        let plant = asid::mjcf::Plant::of(&super::bench::scene(&xml)).unwrap();
        let entry = asid::core::registry::find::<asid::effects::EffectEntry>(effect).unwrap();
        let effect = (entry.make)();
        let sites = effect.sites(&plant);
        let unusual = sites
            .iter()
            .filter(|s| effect.unusual_at(&plant, s))
            .count();
        (sites, unusual)
    };
    let all = r#"<motor name="m" joint="spin"/><velocity name="v" joint="spin" kv="2"/>
      <position name="p" joint="spin" kp="2" kv="1"/>
      <position name="q" joint="spin" kp="2" forcerange="-1 1"/>"#;
    let names = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    assert_eq!(sites("servo-stiffness", all), (names(&["p", "q"]), 0));
    assert_eq!(sites("servo-damping", all), (names(&["v", "p", "q"]), 1));
}
