//! Information of episodes compared with known derivatives.
//!
//! A cart of mass `m` under a force moves by `s = C / m`, whatever the engine's integrator, so that
//! `ds/dm = -s / m`.

#![allow(clippy::unwrap_used)]

mod cart_support;
#[allow(dead_code)] // not every test needs all of it
mod task_support;

use asid::algorithms::explore::FisherEnvironment;
use asid::algorithms::fisher::{FisherBatch, FisherSettings, Form};
use asid::core::environment::{BatchEnvironment, Transition};
use asid::core::parameter::{Parameter, Scale};
use asid::core::registry::{BackendEntry, all};
use cart_support::{Cart, FRAME, HORIZON, NOISE};

const FORCE: f64 = 2.0;

/// An episode under a constant force.
struct Episode {
    /// Displacement of the cart at each reading, m.
    moved: Vec<f64>,
    /// `tr I` of the unknown after each control step.
    trace: Vec<f64>,
    /// Expected standard deviation of the unknown after each control step, in standard deviations
    /// of the prior.
    std: Vec<f64>,
}

/// Calls `check` on every engine with the information about the mass of an episode at `mass`.
fn on_every_engine(
    mass: f64,
    scale: Scale,
    settings: &FisherSettings,
    check: impl Fn(&str, Episode),
) {
    let task = Cart::new();
    let parameters = [Cart::mass(scale)];
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        task_support::on_engine(&*backend, &task, &parameters, 0, |problem, _| {
            let mut batch = FisherBatch::new(problem, settings, 1).unwrap();
            let (mut reading, mut reward) = ([0.0], [0.0]);
            let x0 = 0.02;
            batch.begin(&[mass], &[x0], &mut reading).unwrap();
            assert!((reading[0] - x0).abs() < 1e-6);
            let mut episode = Episode {
                moved: Vec::new(),
                trace: Vec::new(),
                std: Vec::new(),
            };
            for _ in 0..HORIZON {
                batch.step(&[FORCE], &mut reading, &mut reward).unwrap();
                episode.moved.push(reading[0] - x0);
                episode.trace.push(batch.information()[0].trace());
                episode.std.push(batch.information()[0].expected_std()[0]);
            }
            // Newton's law, up to the integrator's error of one physics step.
            let t = HORIZON as f64 * FRAME;
            let newton = FORCE * t * t / (2.0 * mass);
            let last = episode.moved[HORIZON - 1];
            assert!((last / newton - 1.0).abs() < 0.02, "{}: {last}", entry.name);
            check(entry.name, episode);
        });
    }
}

/// `d m / d z` at `mass`.
fn unit(mass: f64, scale: Scale) -> f64 {
    Cart::mass(scale).unscale_std(mass, 1.0)
}

fn close(engine: &str, found: f64, wanted: f64, tolerance: f64) {
    assert!(
        (found / wanted - 1.0).abs() < tolerance,
        "{engine}: {found}, analytically {wanted}"
    );
}

fn settings(form: Form, nuisance: bool) -> FisherSettings {
    FisherSettings {
        form,
        nuisance,
        // The difference over 0.02 standard deviations differs from the derivative by a relative
        // 1e-4.
        delta: 0.02,
        ..FisherSettings::default()
    }
}

#[test]
fn the_trajectory_form_is_the_derivative_of_the_trajectory() {
    for scale in [Scale::Linear, Scale::Log] {
        for mass in [0.8, 1.0, 1.7] {
            let one = settings(Form::Trajectory, false);
            on_every_engine(mass, scale, &one, |engine, episode| {
                let mut wanted = 0.0;
                for (s, trace) in episode.moved.iter().zip(&episode.trace) {
                    let slope = -s / mass * unit(mass, scale);
                    wanted += (slope / NOISE).powi(2);
                    close(engine, *trace, wanted, 5e-3);
                }
                let std = (1.0 + wanted).sqrt().recip();
                close(engine, episode.std[HORIZON - 1], std, 5e-3);
            });
        }
    }
}

/// Symptom: an estimate far beyond the prior's range takes away all information, that about other
/// unknowns too. Cause: both copies are at the end of the range, and their difference is 0/0.
#[test]
fn an_estimate_beyond_the_range_has_the_information_of_its_end() {
    let one = settings(Form::Trajectory, false);
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        let parameters = [Cart::mass(Scale::Linear)];
        task_support::on_engine(&*backend, &Cart::new(), &parameters, 0, |problem, _| {
            let told = |mass: f64| {
                let mut batch = FisherBatch::new(problem, &one, 1).unwrap();
                let (mut reading, mut reward) = ([0.0], [0.0]);
                batch.begin(&[mass], &[0.02], &mut reading).unwrap();
                for _ in 0..HORIZON {
                    batch.step(&[FORCE], &mut reading, &mut reward).unwrap();
                }
                batch.information()[0].trace()
            };
            let [_, end] = parameters[0].range;
            let at_the_end = told(end);
            assert!(at_the_end > 0.0, "{}: {at_the_end}", entry.name);
            close(entry.name, told(1.3 * end), at_the_end, 1e-9);
        });
    }
}

#[test]
fn the_one_step_form_is_the_derivative_of_a_step() {
    // Each step begins from the same state, velocity included. It therefore differs only by what
    // the force adds in it, which does not depend on the speed.
    for mass in [0.8, 1.7] {
        let one = settings(Form::OneStep, false);
        on_every_engine(mass, Scale::Linear, &one, |engine, episode| {
            let slope = -episode.moved[0] / mass * unit(mass, Scale::Linear);
            for (h, trace) in episode.trace.iter().enumerate() {
                let wanted = (h + 1) as f64 * (slope / NOISE).powi(2);
                close(engine, *trace, wanted, 5e-3);
            }
        });
    }
}

#[test]
fn a_start_pose_that_is_not_known_costs_what_schurs_complement_says() {
    let mass = 1.0;
    let both = settings(Form::Trajectory, true);
    let start = 0.2 / 12_f64.sqrt();
    on_every_engine(mass, Scale::Linear, &both, |engine, episode| {
        // Columns: the mass, and the initial position, which shifts every reading equally,
        // including the first.
        let slopes: Vec<f64> = std::iter::once(0.0)
            .chain(
                episode
                    .moved
                    .iter()
                    .map(|s| -s / mass * unit(mass, Scale::Linear)),
            )
            .map(|j| j / NOISE)
            .collect();
        let shift = start / NOISE;
        let (n, sum) = (slopes.len() as f64, slopes.iter().sum::<f64>());
        let mm = 1.0 + slopes.iter().map(|j| j * j).sum::<f64>();
        let ms = sum * shift;
        let ss = 1.0 + n * shift * shift;
        let wanted = (mm - ms * ms / ss).sqrt().recip();
        close(engine, episode.std[HORIZON - 1], wanted, 5e-3);
        // The unknown initial position costs information.
        assert!(wanted > 1.2 / mm.sqrt());
    });
}

#[test]
fn a_step_that_the_range_cuts_short_is_divided_by_what_was_taken() {
    // At the end of its range the mass can only be lowered, so the difference is one-sided.
    let mass = 2.0;
    let delta = 0.3;
    let cut = FisherSettings {
        delta,
        roughness: false,
        ..settings(Form::Trajectory, false)
    };
    let parameter: Parameter = Cart::mass(Scale::Linear);
    let lower = parameter.from_scaled(Parameter::scaled_bound() - delta);
    on_every_engine(mass, Scale::Linear, &cut, |engine, episode| {
        let wanted: f64 = episode
            .moved
            .iter()
            .map(|s| {
                // s = C / m, so the copies are s and s 2 / lower.
                let slope = (s - s * mass / lower) / delta;
                (slope / NOISE).powi(2)
            })
            .sum();
        close(engine, episode.trace[HORIZON - 1], wanted, 1e-4);
        // Divided by the full step of 2 delta, the information would be a quarter of that.
        let derivative: f64 = episode
            .moved
            .iter()
            .map(|s| (s / mass * unit(mass, Scale::Linear) / NOISE).powi(2))
            .sum();
        close(engine, episode.trace[HORIZON - 1], derivative, 0.25);
    });
}

#[test]
fn curvature_counts_as_noise_where_roughness_is_asked_for() {
    // The second difference of C / m over a step h of the mass is 2 s h^2 / (m^2 - h^2).
    let (mass, delta) = (1.0, 0.3);
    let rough = FisherSettings {
        delta,
        ..settings(Form::Trajectory, false)
    };
    let h = delta * unit(mass, Scale::Linear);
    on_every_engine(mass, Scale::Linear, &rough, |engine, episode| {
        let wanted: f64 = episode
            .moved
            .iter()
            .map(|s| {
                let (up, down) = (s * mass / (mass + h), s * mass / (mass - h));
                let slope = (up - down) / (2.0 * delta) / NOISE;
                let bent = 0.5 * (up + down - 2.0 * s) / NOISE;
                slope * slope / (1.0 + bent * bent)
            })
            .sum();
        close(engine, episode.trace[HORIZON - 1], wanted, 1e-4);
    });
}

/// An episode that the engine has given up waits for the others.
///
/// Symptom: it ended again at every step, so that the mean return counted each of these as an
/// episode of its own.
#[test]
fn a_diverged_episode_is_worth_nothing_until_the_horizon() {
    let task = Cart::new();
    let parameters = [Cart::mass(Scale::Linear)];
    let mut diverged = 0;
    for entry in all::<BackendEntry>() {
        let backend = (entry.make)().unwrap();
        task_support::on_engine(&*backend, &task, &parameters, 0, |problem, _| {
            let settings = FisherSettings::default();
            let mut environment = FisherEnvironment::new(problem, &settings, 2).unwrap();
            let len = environment.observation_len();
            let mut observation = vec![0.0; 2 * len];
            // The second cart is so far away that double precision resolves no step: engines give
            // it up.
            let begun = environment.begin_at(&[2.0, 2.0], &[0.02, 1e30], &mut observation);
            if begun.is_err() {
                return;
            }
            let mut transition = Transition::new(2, len);
            environment.step(&[0.5, 0.5], &mut transition).unwrap();
            let alive = environment.batch().alive().to_vec();
            assert!(alive[0], "{}", entry.name);
            assert_eq!(transition.terminated, [false; 2], "{}", entry.name);
            if !alive[1] {
                assert_eq!(transition.reward[1], 0.0);
                diverged += 1;
            }
        });
    }
    assert!(diverged > 0, "no engine gives up a cart at 1e30 m");
}
