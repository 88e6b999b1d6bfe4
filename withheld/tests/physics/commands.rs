//! Effects on commands: a mass of 2 kg under a force that begins at 0.1 s.

use super::rig::{G, SERVO, SLIDE, Setup, near};

fn step(time: f64) -> f64 {
    if time >= 0.1 - 1e-9 { 4.0 } else { 0.0 }
}

#[test]
fn a_delay_that_is_no_multiple_of_a_step_shifts_the_motion_by_itself() {
    let delay = 0.0537_21;
    let run = Setup::new(SLIDE, "actuator-delay", "motor", delay).run(step);
    // 2 m/s² from 0.1 s + delay.
    let t = 1.0 - 0.1 - delay;
    near(run.at(1.0, 1), 2.0 * t, 1e-4);
    near(run.at(1.0, 0), t * t, 1e-3);
}

#[test]
fn a_lag_follows_with_its_time_constant() {
    let tau = 0.2;
    let run = Setup::new(SLIDE, "actuator-lag", "motor", tau).run(step);
    let t = 0.9f64;
    let speed = 2.0 * (t - tau * (1.0 - (-t / tau).exp()));
    near(run.at(1.0, 1), speed, 2e-3);
}

#[test]
fn a_gain_scales_and_a_bias_shifts_the_acceleration() {
    let gain = Setup::new(SLIDE, "actuator-gain", "motor", 0.3).run(|_| 4.0);
    near(gain.at(1.0, 1), 2.6, 1e-4);
    let bias = Setup::new(SLIDE, "actuator-bias", "motor", 1.0).run(|_| 4.0);
    near(bias.at(1.0, 1), 2.5, 1e-4);
}

#[test]
fn a_drive_gives_no_more_than_its_limit() {
    // The rig's peak force is 10 N; three tenths of it are missing.
    let run = Setup::new(SLIDE, "actuator-saturation", "motor", 0.3).run(|_| 9.0);
    near(run.value("limit"), 7.0, 1e-9);
    near(run.at(1.0, 1), 3.5, 1e-4);
    let below = Setup::new(SLIDE, "actuator-saturation", "motor", 0.3).run(|_| 6.0);
    near(below.at(1.0, 1), 3.0, 1e-4);
}

#[test]
fn a_dead_band_takes_its_width_off_a_motors_command() {
    let run = Setup::new(SLIDE, "actuator-deadband", "motor", 1.0).run(|_| -4.0);
    near(run.at(1.0, 1), -1.5, 1e-4);
    let within = Setup::new(SLIDE, "actuator-deadband", "motor", 1.0).run(|_| 0.9);
    near(within.at(1.0, 0), 0.0, 1e-9);
}

#[test]
fn a_dead_band_of_a_servo_lets_its_load_sag_by_its_width_more() {
    let run = Setup::new(SERVO, "actuator-deadband", "servo", 0.02).run(|_| 0.0);
    near(run.at(1.0, 0), -(G / 1000.0 + 0.02), 1e-3);
}

#[test]
fn a_stiffer_servo_sags_less() {
    let run = Setup::new(SERVO, "servo-stiffness", "servo", 1.0).run(|_| 0.0);
    near(run.at(1.0, 0), -G / 2000.0, 1e-3);
}

#[test]
fn a_supply_that_falls_takes_a_growing_share_of_the_force() {
    let run = Setup::new(SLIDE, "supply-drift", "motor", 0.4)
        .drawn([0.1; 4])
        .run(|_| 4.0);
    // dv/dt = 2 (1 - 0.4 t).
    near(run.at(1.0, 1), 2.0 * (1.0 - 0.2), 1e-3);
}

#[test]
fn a_play_of_the_command_swallows_its_width_at_each_turn() {
    // Half the width is lost on the way up, the whole width on the way back.
    let command = |t: f64| if t < 0.5 { 4.0 } else { 0.0 };
    let run = Setup::new(SLIDE, "actuator-hysteresis", "motor", 1.0).run(command);
    // The filter begins at 4 N, the command before the first row. Later it stays 0.5 N above 0.
    near(run.at(0.5, 1), 1.0, 1e-4);
    near(run.at(1.0, 1) - run.at(0.5, 1), 0.25 * 0.5, 1e-3);
}

#[test]
fn a_slew_limit_turns_a_step_into_a_ramp() {
    // The rate is 1 N / 0.25 s for a typical command of 1 N: 4 N take one second from 0.1 s.
    let run = Setup::new(SLIDE, "unknown:slew-limit", "motor", 0.25).run(step);
    let t = 0.9;
    near(run.at(1.0, 1), 0.5 * 4.0 * t * t / 2.0, 3e-3);
}

#[test]
fn a_force_that_falls_with_speed_ends_at_a_top_speed() {
    // The rig's typical speed is 1 m/s, so at a size of 2 the force vanishes at 0.5 m/s. F = 10 N,
    // m = 2 kg.
    let run = Setup::new(SLIDE, "torque-speed-limit", "motor", 2.0).run(|_| 100.0);
    let speed = |t: f64| 0.5 * (1.0 - (-10.0 * t / (2.0 * 0.5)).exp());
    for t in [0.05, 0.1, 0.3, 1.0] {
        near(run.at(t, 1), speed(t), 5e-3);
    }
}

#[test]
fn a_supply_that_falls_from_episode_to_episode_gives_a_smaller_share() {
    let run = Setup::new(SLIDE, "supply-trend", "motor", 0.1)
        .drawn([0.1; 4])
        .repeated(3)
        .run(|_| 4.0);
    for n in 0..3 {
        near(
            run.in_episode(n, 1.0, 1),
            2.0 * (1.0 - 0.1 * n as f64),
            1e-6,
        );
    }
}
