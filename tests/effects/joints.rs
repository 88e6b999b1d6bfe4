//! Friction, springs and inertia of a joint, on a rotor and its motor.

use super::bench::{Bench, engines_for, near, on_each};
use super::{DT, INERTIA, ROTOR};

#[test]
fn viscous_friction_and_rotors_are_those_of_the_engine() {
    for (effect, attribute) in [
        ("viscous-friction@spin:damping=0.8", r#"damping="0.8""#),
        ("armature@spin:inertia=0.2", r#"armature="0.2""#),
    ] {
        let native = ROTOR.replace(
            r#"name="spin" axis"#,
            &format!(r#"name="spin" {attribute} axis"#),
        );
        assert_ne!(native, ROTOR);
        for backend in engines_for(effect) {
            let run = |xml: &str, effects: &[&str]| {
                let mut bench = Bench::new(&*backend, xml, effects);
                bench.state(&[0.0], &[1.0]).hold(200, &[0.3])
            };
            assert_eq!(
                run(&native, &[]),
                run(ROTOR, &[effect]),
                "{effect}, {}",
                backend.name()
            );
        }
    }
}

#[test]
fn viscous_friction_is_an_exponential() {
    on_each(ROTOR, &["viscous-friction@spin:damping=0.8"], |bench| {
        let speed = bench.state(&[0.0], &[3.0]).hold(500, &[0.0])[499][1];
        // An implicit step has the factor 1 / (1 + x) instead of e^-x, with x = damping dt /
        // inertia.
        let expected = 3.0 * (-0.8_f64 / INERTIA).exp();
        near(&bench.engine, speed, expected, 0.003 * expected);
    });
}

#[test]
fn coulomb_friction_stops_a_rotor_in_time_and_holds_it() {
    let (force, offset) = (0.4, 0.1);
    on_each(
        ROTOR,
        &["coulomb-friction@spin:force=0.4,offset=0.1,creep=0.001"],
        |bench| {
            for direction in [1.0, -1.0] {
                let against = force + direction * offset;
                let time = INERTIA / against;
                let rows = bench.state(&[0.0], &[direction]).hold(900, &[0.0]);
                let half = (time / 2.0 / DT) as usize;
                let expected = direction * (1.0 - against * half as f64 * DT / INERTIA);
                near(&bench.engine, rows[half - 1][1], expected, 2e-3);
                near(&bench.engine, rows[899][1], 0.0, 2e-3);
                // The friction holds the rotor just below the breakaway torque, and releases it
                // just above.
                let held = bench
                    .state(&[0.0], &[0.0])
                    .hold(500, &[0.95 * direction * against]);
                near(&bench.engine, held[499][1], 0.0, 5e-3);
                let torque = 1.2 * direction * against;
                let gone = bench.state(&[0.0], &[0.0]).hold(500, &[torque]);
                near(
                    &bench.engine,
                    gone[499][1],
                    0.2 * direction * against / INERTIA,
                    0.01,
                );
            }
        },
    );
}

/// With an offset alone the force is the same in both directions and at rest: a constant force.
#[test]
fn an_offset_of_dry_friction_is_a_force_against_the_positive_direction() {
    on_each(ROTOR, &["coulomb-friction@spin:offset=0.2"], |bench| {
        for speed in [1.0, 0.0, -1.0] {
            let end = bench.state(&[0.0], &[speed]).hold(500, &[0.0])[499][1];
            near(&bench.engine, end, speed - 0.2 / INERTIA, 2e-3);
        }
    });
}

#[test]
fn stribeck_friction_breaks_away_high_and_slides_low() {
    let effect = "stribeck-friction@spin:coulomb=0.2,breakaway=0.3,speed=0.05";
    on_each(ROTOR, &[effect], |bench| {
        let held = bench.state(&[0.0], &[0.0]).hold(500, &[0.47])[499][1];
        near(&bench.engine, held, 0.0, 0.01);
        let rows = bench.state(&[0.0], &[0.0]).hold(1000, &[0.55]);
        let rate = (rows[999][1] - rows[799][1]) / (200.0 * DT);
        near(&bench.engine, rate, (0.55 - 0.2) / INERTIA, 5e-3);
        let rows = bench.state(&[0.0], &[1.0]).hold(200, &[0.0]);
        near(
            &bench.engine,
            rows[199][1],
            1.0 - 0.2 * 200.0 * DT / INERTIA,
            2e-3,
        );
    });
}

#[test]
fn load_friction_takes_a_share_of_the_drive() {
    on_each(ROTOR, &["load-friction@spin:coefficient=0.3"], |bench| {
        for torque in [1.0, -2.0] {
            let speed = bench.state(&[0.0], &[0.0]).hold(500, &[torque])[499][1];
            near(&bench.engine, speed, 0.7 * torque / INERTIA, 5e-3);
        }
        let coasting = bench.state(&[0.0], &[1.0]).hold(500, &[0.0])[499][1];
        near(&bench.engine, coasting, 1.0, 1e-3);
    });
}

#[test]
fn a_spring_swings_about_its_rest() {
    let (stiffness, rest): (f64, f64) = (8.0, 0.3);
    on_each(
        ROTOR,
        &["joint-stiffness@spin:stiffness=8,rest=0.3"],
        |bench| {
            let rows = bench.state(&[0.5], &[0.0]).hold(500, &[0.0]);
            let omega = (stiffness / INERTIA).sqrt();
            for (k, row) in rows.iter().enumerate() {
                let t = (k + 1) as f64 * DT;
                // Tolerance: half a step of phase.
                near(
                    &bench.engine,
                    row[0],
                    rest + 0.2 * (omega * t).cos(),
                    0.2 * omega * DT,
                );
            }
        },
    );
}

/// Oscillation on a purely cubic spring (Duffing). At amplitude `A` its period is
/// `4 K(1/√2) sqrt(I / c) / A`, with the complete elliptic integral `K(1/√2) = 1.8540746773`.
#[test]
fn a_spring_that_stiffens_has_the_period_of_its_elliptic_integral() {
    let (cubic, amplitude): (f64, f64) = (20.0, 0.5);
    on_each(
        ROTOR,
        &["joint-stiffness@spin:rest=0.3,cubic=20"],
        |bench| {
            let rows = bench.state(&[0.3 + amplitude], &[0.0]).hold(2000, &[0.0]);
            // The speed crosses zero after each half period; the time is interpolated between
            // steps.
            let mut turns = Vec::new();
            for (k, pair) in rows.windows(2).enumerate() {
                let (a, b) = (pair[0][1], pair[1][1]);
                if a * b < 0.0 {
                    turns.push((k as f64 + a / (a - b)) * DT);
                }
            }
            let found = 2.0 * (turns[2] - turns[0]) / 2.0;
            let expected = 4.0 * 1.854_074_677_3 * (INERTIA / cubic).sqrt() / amplitude;
            // The amplitude, and with it the period, varies by the work of half a step.
            near(&bench.engine, found, expected, 4e-3 * expected);
            let energy = |row: &[f64]| {
                0.5 * INERTIA * row[1].powi(2) + 0.25 * cubic * (row[0] - 0.3).powi(4)
            };
            let whole = 0.25 * cubic * amplitude.powi(4);
            for row in &rows {
                // The work of half a step. rapier's own energy error grows by up to half a percent
                // per second.
                let slack = if bench.rounding > 1e-6 {
                    0.02 * whole
                } else {
                    0.0
                };
                near(
                    &bench.engine,
                    energy(row),
                    whole,
                    2.5 * 0.8 * DT / 2.0 + slack,
                );
            }
        },
    );
}

/// The cubic term adds to the linear term.
#[test]
fn a_spring_with_both_terms_holds_a_known_load() {
    let damped = ROTOR.replace(r#"name="spin" axis"#, r#"name="spin" damping="4" axis"#);
    on_each(
        &damped,
        &["joint-stiffness@spin:stiffness=8,cubic=20"],
        |bench| {
            // 8 x 0.5 + 20 x 0.5³.
            let angle = bench.hold(10_000, &[6.5])[9999][0];
            near(&bench.engine, angle, 0.5, 1e-4);
        },
    );
}

#[test]
fn ripple_keeps_energy() {
    let (sin, cos, teeth) = (0.3, -0.2, 5.0);
    let effect = "torque-ripple@spin:amplitude_sin=0.3,amplitude_cos=-0.2,teeth=5";
    on_each(ROTOR, &[effect], |bench| {
        let energy = |q: f64, v: f64| {
            let (s, c) = (teeth * q).sin_cos();
            0.5 * INERTIA * v * v + (sin * c - cos * s) / teeth
        };
        let whole = energy(0.1, 1.0);
        for row in bench.state(&[0.1], &[1.0]).hold(1000, &[0.0]) {
            // Tolerance: the work of half a step.
            near(
                &bench.engine,
                energy(row[0], row[1]),
                whole,
                0.36 * 1.3 * DT,
            );
        }
    });
}
