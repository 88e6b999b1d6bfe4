//! Effects on commands, on a rotor that integrates its torque.

use super::bench::{Bench, engines_that_load, near, on_each};
use super::{DT, INERTIA, ROTOR};

/// A stiff, strongly damped servo without load.
const SERVO: &str = r#"<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0" integrator="implicitfast"/>
  <worldbody><body name="rotor"><joint name="spin" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.5 0.5 0.5"/></body></worldbody>
  <actuator><position name="drive" joint="spin" kp="20" kv="20"/></actuator>
  <sensor><jointpos name="angle" joint="spin"/><jointvel name="speed" joint="spin"/></sensor></mujoco>"#;

/// Speed at 1 s, after `steps` steps without torque and then 1 N m.
fn speed_after_a_step(bench: &mut Bench, steps: usize) -> f64 {
    let commands: Vec<_> = (0..500).map(|k| vec![f64::from(k >= steps)]).collect();
    bench.run(1, &commands)[499][1]
}

#[test]
fn a_delay_shifts_a_step_by_exactly_its_time() {
    for delay in [0.0006, 0.04, 0.0473] {
        on_each(
            ROTOR,
            &[&format!("actuator-delay@drive:delay={delay}")],
            |bench| {
                let expected = (1.0 - 100.0 * DT - delay) / INERTIA;
                let speed = speed_after_a_step(bench, 100);
                near(&bench.engine, speed, expected, 2.0 * bench.rounding);
            },
        );
    }
}

#[test]
fn before_the_first_row_the_command_was_the_same() {
    for effect in [
        "actuator-delay@drive:delay=0.05",
        "actuator-lag@drive:time_constant=0.1",
    ] {
        on_each(ROTOR, &[effect], |bench| {
            let speed = speed_after_a_step(bench, 0);
            near(&bench.engine, speed, 1.0 / INERTIA, 2.0 * bench.rounding);
        });
    }
}

#[test]
fn a_lag_is_an_exponential() {
    for lag in [0.001, 0.08] {
        on_each(
            ROTOR,
            &[&format!("actuator-lag@drive:time_constant={lag}")],
            |bench| {
                let t = 1.0 - 50.0 * DT;
                // The integral of 1 - exp(-t/T), divided by the inertia.
                let expected = (t + lag * (-t / lag).exp_m1()) / INERTIA;
                let speed = speed_after_a_step(bench, 50);
                near(&bench.engine, speed, expected, 2.0 * bench.rounding);
            },
        );
    }
}

#[test]
fn gain_bias_saturation_and_dead_band_change_the_torque() {
    for (effect, command, torque) in [
        ("actuator-gain@drive:gain=0.7", 1.0, 0.7),
        ("actuator-bias@drive:bias=-0.05", 1.0, 0.95),
        ("actuator-saturation@drive:limit=0.4", 1.0, 0.4),
        ("actuator-saturation@drive:limit=0.4", -0.3, -0.3),
        ("actuator-deadband@drive:width=0.1", -1.0, -0.9),
        ("actuator-deadband@drive:width=0.1", 0.09, 0.0),
    ] {
        on_each(ROTOR, &[effect], |bench| {
            let speed = bench.hold(500, &[command])[499][1];
            near(effect, speed, torque / INERTIA, 2.0 * bench.rounding);
        });
    }
}

#[test]
fn a_saturated_servo_pushes_with_its_limit() {
    on_each(SERVO, &["actuator-saturation@drive:limit=2"], |bench| {
        // The servo asks for more than 20 N m until the damping at its speed reduces that.
        let speed = bench.hold(50, &[1.5])[49][1];
        near(&bench.engine, speed, 2.0 * 50.0 * DT / INERTIA, 0.02);
    });
}

/// Guards against a servo that runs away because its damping is compensated while its own limit has
/// switched the damping off.
#[test]
fn a_saturated_servo_with_a_limit_of_its_own_does_not_run_away() {
    let limited = SERVO.replace("kv=\"20\"", "kv=\"20\" forcerange=\"-5 5\"");
    on_each(&limited, &["actuator-saturation@drive:limit=4"], |bench| {
        // The command swings by far more than the limit can follow.
        let commands: Vec<_> = (0..3000)
            .map(|k| vec![if (k / 100) % 2 == 0 { 9.0 } else { -9.0 }])
            .collect();
        let rows = bench.run(1, &commands);
        let fastest = rows.iter().map(|row| row[1].abs()).fold(0.0, f64::max);
        // A push of 4 N m for 0.2 s; the bound is twice that speed, because a push may begin at any
        // speed.
        let bound = 2.0 * 4.0 * 0.2 / INERTIA;
        assert!(fastest < bound, "{}: {fastest} rad/s", bench.engine);
    });
}

#[test]
fn a_servo_with_a_dead_band_stops_short_of_its_command() {
    on_each(SERVO, &["actuator-deadband@drive:width=0.1"], |bench| {
        // Overdamped: it approaches the edge of the band slowly.
        let angle = bench.hold(4000, &[0.5])[3999][0];
        near(&bench.engine, angle, 0.4, 1e-3);
        let angle = bench.hold(500, &[0.45])[499][0];
        near(&bench.engine, angle, 0.4, 1e-3);
    });
}

/// Torque that arrives after each command, from the change of the speed.
fn torques(bench: &mut Bench, commands: &[f64]) -> Vec<f64> {
    let commands: Vec<_> = commands.iter().map(|&c| vec![c]).collect();
    let mut before = 0.0;
    let rows = bench.run(1, &commands).into_iter();
    let torque = |row: Vec<f64>| {
        let change = row[1] - before;
        before = row[1];
        change * INERTIA / DT
    };
    rows.map(torque).collect()
}

#[test]
fn play_of_a_command_is_the_play_operator() {
    on_each(ROTOR, &["actuator-hysteresis@drive:width=0.4"], |bench| {
        // From the middle of the play up, down, and partly up again: an inner loop.
        let sent = [0.5, 0.6, 0.8, 1.0, 0.9, 0.7, 0.3, 0.0, 0.3, 0.5];
        let arrives = [0.5, 0.5, 0.6, 0.8, 0.8, 0.8, 0.5, 0.2, 0.2, 0.3];
        for (found, expected) in torques(bench, &sent).into_iter().zip(arrives) {
            near(&bench.engine, found, expected, 1e-3 + 0.1 * bench.rounding);
        }
    });
}

/// The area of the hysteresis loop is the loss, and does not depend on the rate. That of a delay
/// grows with the rate.
#[test]
fn play_of_a_command_loses_the_same_at_any_rate() {
    let (width, amplitude) = (0.4, 1.0);
    for rows in [100_usize, 400] {
        on_each(ROTOR, &["actuator-hysteresis@drive:width=0.4"], |bench| {
            let sent: Vec<f64> = (0..3 * rows)
                .map(|k| amplitude * (std::f64::consts::TAU * k as f64 / rows as f64).sin())
                .collect();
            let arrives = torques(bench, &sent);
            let area: f64 = (2 * rows..3 * rows)
                .map(|k| (arrives[k - 1] + arrives[k]) / 2.0 * (sent[k] - sent[k - 1]))
                .sum();
            // A parallelogram with the width of the play and the height of the arriving torque.
            let expected = width * 2.0 * (amplitude - width / 2.0);
            near(&bench.engine, area.abs(), expected, 0.01);
        });
    }
}

/// Symptom: a gain above 1 and a bias did nothing at the end of a command's range, and a gain before
/// a bias was cut off between the two.
///
/// Cause: the range, which limits the command that a drive is given, was applied once more to what
/// the effects made of it.
#[test]
fn a_gain_and_a_bias_act_behind_the_range_of_the_command() {
    let motor = ROTOR.replace(r#"gear="1""#, r#"gear="1" ctrlrange="-1 1""#);
    for (effects, torque) in [
        (&["actuator-gain@drive:gain=1.5"][..], 1.5),
        (&["actuator-bias@drive:bias=0.5"][..], 1.5),
        (
            &[
                "actuator-gain@drive:gain=1.5",
                "actuator-bias@drive:bias=-0.2",
            ][..],
            1.3,
        ),
        (
            &[
                "actuator-gain@drive:gain=1.5",
                "actuator-delay@drive:delay=0.01",
            ][..],
            1.5,
        ),
        (
            &[
                "actuator-saturation@drive:limit=1.2",
                "actuator-gain@drive:gain=1.5",
            ][..],
            1.2,
        ),
        (&["supply-trend@drive:rate=0.1"][..], 1.0),
        (&["actuator-gain@drive:gain=0.5"][..], 0.5),
    ] {
        on_each(&motor, effects, |bench| {
            let speed = bench.hold(500, &[3.0])[499][1];
            near(&bench.engine, speed, torque / INERTIA, 3.0 * bench.rounding);
        });
    }
    // 1.5 of the largest command of 0.5.
    let servo = SERVO.replace(r#"kv="20""#, r#"kv="20" ctrlrange="-0.5 0.5""#);
    on_each(&servo, &["actuator-gain@drive:gain=1.5"], |bench| {
        let angle = bench.hold(6000, &[2.0])[5999][0];
        near(&bench.engine, angle, 0.75, 1e-3);
    });
}

/// Symptom: a drive with a filter or a delay of its own began an episode with the command before a
/// gain, and moved too fast or too slowly until it had forgotten that.
///
/// Cause: the engine filled its memory with the command of the log.
#[test]
fn a_filter_or_a_delay_begins_with_the_command_that_reaches_it() {
    let effect = "actuator-gain@drive:gain=0.5";
    for own in [
        r#"<general name="drive" joint="spin" dyntype="filterexact" dynprm="0.1"/>"#,
        r#"<motor name="drive" joint="spin" delay="0.1" nsample="60"/>"#,
    ] {
        let xml = ROTOR.replace(r#"<motor name="drive" joint="spin" gear="1"/>"#, own);
        assert_ne!(xml, ROTOR);
        for backend in engines_that_load(effect, &xml) {
            let speed = Bench::new(&*backend, &xml, &[effect]).hold(100, &[1.0])[99][1];
            near(own, speed, 0.5 * 100.0 * DT / INERTIA, 1e-9);
        }
    }
}
