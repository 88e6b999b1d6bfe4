//! Effects on readings: a mass that moves at 2 m/s.

use super::rig::{SLIDE, Setup, near};

fn coasting(cause: &'static str, size: f64) -> super::rig::Run {
    Setup::new(SLIDE, cause, "x", size)
        .from(&[0.3], &[2.0])
        .run(|_| 0.0)
}

#[test]
fn an_old_reading_is_where_the_mass_was() {
    let delay = 0.0431_7;
    let run = coasting("sensor-delay", delay);
    for t in [0.0, 0.02, 0.5, 1.0] {
        near(run.at(t, 0), 0.3 + 2.0 * (t - delay), 1e-6);
    }
    // The other sensor has no delay.
    near(run.at(1.0, 1), 2.0, 1e-9);
}

#[test]
fn a_filtered_ramp_trails_by_its_time_constant() {
    let tau = 0.1;
    let run = coasting("sensor-filter", tau);
    for t in [0.05, 0.2, 1.0] {
        let trail = tau * (1.0 - (-t / tau).exp());
        near(run.at(t, 0), 0.3 + 2.0 * (t - trail), 1e-6);
    }
}

#[test]
fn a_scale_a_shift_and_a_drift_are_what_they_say() {
    near(coasting("sensor-scale", 0.2).at(1.0, 0), 1.2 * 2.3, 1e-9);
    near(coasting("sensor-bias", 0.2).at(1.0, 0), 2.5, 1e-9);
    near(coasting("sensor-drift", 0.2).at(0.5, 0), 1.3 + 0.1, 1e-9);
}

#[test]
fn a_reading_in_steps_is_a_multiple_of_its_step() {
    let run = coasting("sensor-quantization", 0.05);
    let value = asid_withheld::gap::in_steps(run.at(0.777, 0), 0, &run.steps);
    near(value / 0.05, (value / 0.05).round(), 1e-9);
    assert!((value - run.at(0.777, 0)).abs() <= 0.025 + 1e-12);
}

#[test]
fn an_eccentric_disc_errs_by_a_sine_of_the_reading() {
    let run = coasting("unknown:encoder-eccentricity", 0.01);
    let (true_value, waves) = (0.3 + 2.0 * 0.4, run.value("waves"));
    let phase = std::f64::consts::TAU * 0.1;
    let expected = true_value + 0.01 * (waves * true_value + phase).sin();
    near(run.at(0.4, 0), expected, 1e-9);
}

#[test]
fn a_trend_shifts_by_a_step_an_episode_and_an_offset_by_chance() {
    let of = |cause| {
        Setup::new(SLIDE, cause, "x", 0.2)
            .from(&[0.3], &[2.0])
            .repeated(3)
            .run(|_| 0.0)
    };
    let trend = of("sensor-trend");
    (0..3).for_each(|n| near(trend.in_episode(n, 0.5, 0), 1.3 + 0.2 * n as f64, 1e-9));
    let offset = of("episode-offset");
    let shift = |n, t| offset.in_episode(n, t, 0) - 0.3 - 2.0 * t;
    assert!(shift(0, 0.5) != shift(1, 0.5));
    (0..3).for_each(|n| near(shift(n, 1.0), shift(n, 0.0), 1e-9));
}
