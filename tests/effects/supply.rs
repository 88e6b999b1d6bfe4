//! Effects of speed and of the supply on a drive's force.

use super::bench::{near, on_each};
use super::{DT, INERTIA, ROTOR};

/// A torque that falls from `F` at rest to zero at `v0`: the speed approaches `v0` with the time
/// constant `I v0 / F`.
#[test]
fn a_drive_whose_force_falls_with_speed_approaches_its_own_speed() {
    let (force, speed) = (2.0, 3.0);
    let effect = "torque-speed-limit@drive:force=2,speed=3";
    on_each(ROTOR, &[effect], |bench| {
        for sign in [1.0, -1.0] {
            let rows = bench.state(&[0.0], &[0.0]).hold(1500, &[sign * 5.0]);
            for k in [100, 500, 1500] {
                let t = k as f64 * DT;
                let expected = -(-t * force / (INERTIA * speed)).exp_m1() * speed;
                // The error of one step of backward Euler.
                near(&bench.engine, rows[k - 1][1], sign * expected, 5e-3);
            }
        }
    });
}

#[test]
fn below_the_limit_a_command_is_as_given() {
    let effect = "torque-speed-limit@drive:force=2,speed=3";
    on_each(ROTOR, &[effect], |bench| {
        let speed = bench.hold(500, &[0.5])[499][1];
        near(&bench.engine, speed, 0.5 / INERTIA, 2.0 * bench.rounding);
        // While braking, the limit rises as the rotor slows down: F (1 - v / v0) gives an
        // exponential.
        let rows = bench.state(&[0.0], &[1.5]).hold(100, &[-5.0]);
        let t = 100.0 * DT;
        let expected = 3.0 - 1.5 * (t * 2.0 / (INERTIA * 3.0)).exp();
        near(&bench.engine, rows[99][1], expected, 5e-3);
    });
}

/// The same for a servo with damping and limits of its own, whatever its command. Its `kp` is
/// small, since rapier's servos fall short by `kp v dt`.
#[test]
fn a_servo_is_held_to_its_torque_speed_line() {
    let servo = r#"<position name="drive" joint="spin" kp="1" kv="5" forcerange="-1.5 1.5"/>"#;
    let xml = ROTOR
        .replace(r#"<motor name="drive" joint="spin" gear="1"/>"#, servo)
        .replace(
            r#"gravity="0 0 0""#,
            r#"gravity="0 0 0" integrator="implicitfast""#,
        );
    assert!(xml.contains("kp"));
    let effect = "torque-speed-limit@drive:force=2,speed=3";
    on_each(&xml, &[effect], |bench| {
        // 1.5 N m up to a quarter of the speed, then along the line.
        let rows = bench.hold(800, &[1000.0]);
        let knee = 0.75 * INERTIA / 1.5;
        near(&bench.engine, rows[99][1], 1.5 * 0.2 / INERTIA, 0.01);
        let t = 1.6 - knee;
        let expected = 3.0 - 2.25 * (-t * 2.0 / (INERTIA * 3.0)).exp();
        near(&bench.engine, rows[799][1], expected, 0.01);
    });
}

/// With the gain `1 + r t` of a torque `u`, the speed is `u (t + r t² / 2) / I`.
#[test]
fn a_supply_that_fades_loses_speed_with_the_square_of_time() {
    on_each(ROTOR, &["supply-drift@drive:rate=-0.4"], |bench| {
        let rows = bench.hold(2000, &[1.0]);
        for k in [500, 1250, 2000] {
            // The supply is empty after 2.5 s.
            let t = (k as f64 * DT).min(2.5);
            let expected = (t - 0.2 * t * t) / INERTIA;
            near(&bench.engine, rows[k - 1][1], expected, 1.0 * DT / INERTIA);
        }
        // Each episode begins with a full supply.
        bench.simulator.reset(&[0]).unwrap();
        let again = bench.hold(500, &[1.0])[499][1];
        near(&bench.engine, again, 0.8 / INERTIA, DT / INERTIA);
    });
}

/// `dv/dt = (1 + rate n) u / I` in episode `n`.
#[test]
fn a_supply_that_falls_from_episode_to_episode_gives_a_smaller_share_each_time() {
    on_each(ROTOR, &["supply-trend@drive:rate=-0.1"], |bench| {
        for n in [0, 1, 5, 12] {
            let share = (1.0 - 0.1 * f64::from(n)).max(0.0);
            let rows = bench.episode(n as usize).hold(500, &[0.5]);
            let expected = share * 0.5 * 500.0 * DT / INERTIA;
            near(&bench.engine, rows[499][1], expected, bench.rounding * 10.0);
        }
    });
}
