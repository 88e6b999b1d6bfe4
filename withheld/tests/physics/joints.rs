//! Forces at joints, and transmissions between drive and joint.

use std::f64::consts::TAU;

use super::rig::{G, PENDULUM, SERVO, SLIDE, Setup, WHEEL, near};

#[test]
fn a_pendulum_with_viscous_friction_swings_down_as_the_formula_says() {
    let (q0, d) = (0.02, 0.3);
    let run = Setup::new(PENDULUM, "viscous-friction", "pivot", d)
        .from(&[q0], &[0.0])
        .lasting(3.0)
        .run(|_| 0.0);
    let inertia = 0.25;
    let omega = (G * 0.5 / inertia).sqrt();
    let decay = d / (2.0 * inertia);
    let damped = (omega * omega - decay * decay).sqrt();
    for t in [0.5, 1.3, 2.2, 3.0] {
        let (sin, cos) = (damped * t).sin_cos();
        let expected = q0 * (-decay * t).exp() * (cos + decay / damped * sin);
        // A hundredth of the remaining amplitude of the swing.
        let tolerance = 0.01 * q0 * (-decay * t).exp();
        assert!((run.at(t, 0) - expected).abs() < tolerance, "at {t} s");
    }
}

#[test]
fn viscous_friction_lets_a_wheel_coast_by_its_time_constant_times_its_speed() {
    let run = Setup::new(WHEEL, "viscous-friction", "axle", 0.4)
        .from(&[0.0], &[5.0])
        .run(|_| 0.0);
    near(run.at(1.0, 0), 5.0 * 0.1 * (1.0 - (-10f64).exp()), 3e-3);
}

#[test]
fn dry_friction_stops_a_mass_after_its_momentum_over_the_force_and_holds_it() {
    let run = Setup::new(SLIDE, "coulomb-friction", "rail", 5.0)
        .from(&[0.0], &[1.0])
        .run(|_| 0.0);
    near(run.at(0.2, 1), 0.5, 5e-3);
    near(run.at(0.4, 0), 0.2, 5e-3);
    near(run.at(1.0, 0), 0.2, 5e-3);
}

#[test]
fn dry_friction_holds_a_smaller_force_without_creep() {
    let run = Setup::new(SLIDE, "coulomb-friction", "rail", 5.0).run(|_| 4.5);
    assert!(run.at(1.0, 0).abs() < 1e-5, "crept {} m", run.at(1.0, 0));
    let more = Setup::new(SLIDE, "coulomb-friction", "rail", 5.0).run(|_| 7.0);
    near(more.at(1.0, 1), 1.0, 3e-3);
}

#[test]
fn an_offset_makes_dry_friction_larger_in_one_direction() {
    let run = |speed: f64| {
        Setup::new(SLIDE, "coulomb-friction", "rail", 5.0)
            .drawn([0.6, 0.9, 0.5, 0.5])
            .from(&[0.0], &[speed])
            .run(|_| 0.0)
    };
    let (there, back) = (run(3.0), run(-3.0));
    let offset = there.value("offset");
    assert!(offset > 0.0 && offset < 5.0);
    near(3.0 - there.at(0.5, 1), (5.0 + offset) / 2.0 * 0.5, 3e-3);
    near(3.0 + back.at(0.5, 1), (5.0 - offset) / 2.0 * 0.5, 3e-3);
}

#[test]
fn stribeck_friction_holds_more_than_it_drags() {
    let setup = || Setup::new(SLIDE, "stribeck-friction", "rail", 10.0);
    let rest = setup().run(|_| 9.0);
    assert!(rest.at(1.0, 0).abs() < 1e-4);
    // In motion: an independent integration of 2 dv/dt = 9 - c - b exp(-(v/s)²).
    let run = setup().from(&[0.0], &[1.0]).run(|_| 9.0);
    let (c, b, s) = (
        run.value("coulomb"),
        run.value("breakaway"),
        run.value("speed"),
    );
    near(c + b, 10.0, 1e-9);
    let (mut v, dt) = (1.0f64, 1e-5);
    for _ in 0..100_000 {
        v += dt * (9.0 - c - b * (-(v / s).powi(2)).exp()) / 2.0;
    }
    near(run.at(1.0, 1), v, 3e-3);
}

#[test]
fn load_friction_takes_its_share_of_the_drives_force() {
    let run = Setup::new(SLIDE, "load-friction", "rail", 0.25).run(|_| 4.0);
    near(run.at(1.0, 1), 1.5, 3e-3);
}

#[test]
fn a_spring_swings_a_mass_at_the_root_of_stiffness_over_mass() {
    let stiffness = 50.0;
    let period = TAU * (2.0f64 / stiffness).sqrt();
    let run = Setup::new(SLIDE, "joint-stiffness", "rail", stiffness)
        .drawn([0.5; 4])
        .from(&[0.1], &[0.0])
        .lasting(2.0)
        .run(|_| 0.0);
    near(run.value("rest"), 0.0, 1e-9);
    near(run.at(period / 2.0, 0), -0.1, 5e-3);
    near(run.at(period, 0), 0.1, 5e-3);
}

#[test]
fn armature_adds_to_the_mass_that_a_force_accelerates() {
    let run = Setup::new(SLIDE, "armature", "rail", 3.0).run(|_| 4.0);
    near(run.at(1.0, 1), 4.0 / 5.0, 1e-4);
}

#[test]
fn torque_ripple_conserves_kinetic_energy_and_its_potential() {
    let run = Setup::new(WHEEL, "torque-ripple", "axle", 0.3)
        .from(&[0.1], &[6.0])
        .run(|_| 0.0);
    let (a, b, n) = (
        run.value("amplitude_sin"),
        run.value("amplitude_cos"),
        run.value("teeth"),
    );
    let energy = |t: f64| {
        let (sin, cos) = (n * run.at(t, 0)).sin_cos();
        0.5 * 0.04 * run.at(t, 1).powi(2) + (a * cos - b * sin) / n
    };
    for t in [0.21, 0.5, 0.83, 1.0] {
        near(energy(t), energy(0.0), 5e-3);
    }
}

#[test]
fn compliance_lets_a_load_sag_by_its_weight_times_itself() {
    let compliance = 0.002;
    let run = Setup::new(SERVO, "joint-compliance", "rail", compliance)
        .lasting(3.0)
        .run(|_| 0.0);
    near(run.at(3.0, 0), -G * (1.0 / 1000.0 + compliance), 1e-2);
}

/// A servo whose limit is stated twice, by `forcelimited` and by its range.
#[test]
fn compliance_keeps_the_limit_of_a_servo_that_says_it_is_limited() {
    let limited = r#"<position name="servo" joint="rail" kp="1000" kv="60" forcelimited="true" forcerange="-5 5"/>"#;
    let plain = r#"<position name="servo" joint="rail" kp="1000" kv="60"/>"#;
    let model = SERVO.model.replace(plain, limited);
    let machine = asid_withheld::machine::Machine {
        model: Box::leak(model.into_boxed_str()),
        ..SERVO
    };
    let run = Setup::new(machine, "joint-compliance", "rail", 0.002).run(|_| 0.0);
    // The drive gives 5 N against a weight of 9.81 N. The load falls against its damping of 2 N
    // s/m.
    let (pull, damping) = (G - 5.0, 2.0);
    near(
        run.at(1.0, 1),
        -pull / damping * (1.0 - f64::exp(-damping)),
        2e-2,
    );
}

#[test]
fn backlash_hangs_a_load_half_its_width_lower() {
    let width = 0.03;
    let run = Setup::new(SERVO, "backlash", "rail", width)
        .lasting(3.0)
        .run(|_| 0.0);
    // The ends of the play yield by a tenth of a millimetre under the load.
    let expected = -(G / 1000.0 + width / 2.0);
    assert!(
        (run.at(3.0, 0) - expected).abs() < 2e-4,
        "{}",
        run.at(3.0, 0)
    );
}

#[test]
fn backlash_is_lost_once_at_each_reversal() {
    // The axis is horizontal. The drive moves slowly up and down against the joint's damping, and
    // the load trails by half the width.
    let mut machine = SERVO;
    let text = SERVO.model.replace("axis=\"0 0 1\"", "axis=\"1 0 0\"");
    machine.model = Box::leak(text.into_boxed_str());
    let up_and_down = |t: f64| 0.1 * if t < 1.0 { t } else { 2.0 - t };
    let lag = |cause: &'static str, size: f64| {
        let run = Setup::new(machine, cause, "rail", size)
            .lasting(2.0)
            .run(up_and_down);
        // Difference between the way up and the way back at the same command.
        run.at(0.5, 0) - run.at(1.5, 0)
    };
    let width = 0.02;
    let without = lag("viscous-friction", 0.0);
    let with = lag("backlash", width);
    assert!(
        (without - with - width).abs() < 0.05 * width,
        "{without} {with}"
    );
}

#[test]
fn a_hidden_absorber_keeps_the_momentum_of_both() {
    let inertia = 1.5;
    let run = Setup::new(SLIDE, "unknown:hidden-absorber", "rail", inertia)
        .from(&[0.0], &[0.0])
        .lasting(6.0)
        .run(|t| if t < 0.1 { 10.0 } else { 0.0 });
    // Once the oscillation has decayed, both move at the impulse divided by the sum of the masses.
    let mean = (run.at(6.0, 0) - run.at(3.0, 0)) / 3.0;
    near(mean, 1.0 / (2.0 + inertia), 2e-2);
}

#[test]
fn an_eddy_brake_is_strongest_at_its_speed() {
    let size = 4.0;
    let run = Setup::new(SLIDE, "unknown:eddy-brake", "rail", size)
        .from(&[0.0], &[2.0])
        .run(|_| 0.0);
    let s = run.value("speed");
    let (mut v, dt) = (2.0f64, 1e-5);
    for _ in 0..100_000 {
        v -= dt * size * v / (1.0 + (v / s).powi(2)) / 2.0;
    }
    near(run.at(1.0, 1), v, 3e-3);
}
