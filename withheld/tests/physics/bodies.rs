//! Masses, their positions, and forces on bodies.

use super::rig::{BALL, G, PENDULUM, SLIDE, Setup, WHEEL, near};

/// Draws that give the direction of z.
const UP: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
/// Draws that give the direction of x.
const AHEAD: [f64; 4] = [0.5, 0.0, 0.0, 0.0];

const REST: [f64; 7] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];

#[test]
fn a_heavier_mass_is_accelerated_less() {
    let mass = Setup::new(SLIDE, "mass", "mass", 0.5).run(|_| 4.0);
    near(mass.at(1.0, 1), 4.0 / 3.0, 1e-4);
    let payload = Setup::new(SLIDE, "payload", "mass", 0.5).run(|_| 4.0);
    near(payload.at(1.0, 1), 4.0 / 2.5, 1e-4);
}

#[test]
fn larger_moments_slow_a_wheel_down() {
    let run = Setup::new(WHEEL, "inertia", "wheel", 0.5).run(|_| 0.1);
    near(run.at(1.0, 1), 0.1 / 0.06, 1e-4);
}

#[test]
fn a_pendulum_whose_center_lies_aside_hangs_askew() {
    // The body's frame is that of its inertia; MuJoCo's shortcut for such bodies must be off.
    let mut setup = Setup::new(PENDULUM, "center-of-mass", "bob", 0.05).drawn(AHEAD);
    setup.causes.push(("viscous-friction", "pivot", 3.0));
    let run = setup.lasting(4.0).run(|_| 0.0);
    near(run.value("x"), 0.05, 1e-9);
    // The centre hangs below the pivot. The angle about +y is measured from -z towards -x.
    near(run.at(4.0, 0), (0.05f64 / 0.5).atan(), 3e-3);
}

#[test]
fn a_center_further_down_swings_more_slowly() {
    let run = Setup::new(PENDULUM, "center-of-mass", "bob", 0.3)
        .drawn([0.0, 0.0, 0.0, 0.0])
        .from(&[0.01], &[0.0])
        .lasting(2.0)
        .run(|_| 0.0);
    near(run.value("z"), -0.3, 1e-9);
    let period = std::f64::consts::TAU * (0.8f64 / G).sqrt();
    near(run.at(period, 0), 0.01, 5e-3);
    near(run.at(period / 2.0, 0), -0.01, 5e-3);
}

#[test]
fn a_tilt_lets_a_slide_run_downhill() {
    let run = Setup::new(SLIDE, "gravity-tilt", "", 0.1)
        .drawn([0.0; 4])
        .run(|_| 0.0);
    near(run.value("pitch"), 0.1, 1e-9);
    near(run.at(1.0, 1), G * 0.1f64.sin(), 1e-4);
}

#[test]
fn wind_pushes_a_ball_along_a_parabola() {
    let run = Setup::new(BALL, "constant-force", "ball", 0.05)
        .drawn(AHEAD)
        .from(&REST, &[0.0; 6])
        .run(|_| 0.0);
    near(run.at(1.0, 0), 0.5 * 0.05 / 0.1, 2e-3);
    near(run.at(1.0, 2), -0.5 * G, 2e-3);
}

#[test]
fn linear_drag_takes_a_falling_ball_to_its_terminal_speed() {
    let c = 0.2;
    let run = Setup::new(BALL, "linear-drag", "ball", c)
        .drawn(UP)
        .from(&REST, &[0.0; 6])
        .lasting(2.0)
        .run(|_| 0.0);
    let (top, tau) = (0.1 * G / c, 0.1 / c);
    let fallen = |t: f64| -top * (t - tau * (1.0 - (-t / tau).exp()));
    for t in [0.3, 1.0, 2.0] {
        near(run.at(t, 2), fallen(t), 3e-3);
    }
}

#[test]
fn quadratic_drag_takes_a_falling_ball_along_the_logarithm_of_a_hyperbolic_cosine() {
    let c = 0.05;
    let run = Setup::new(BALL, "quadratic-drag", "ball", c)
        .from(&REST, &[0.0; 6])
        .lasting(2.0)
        .run(|_| 0.0);
    let top = (0.1 * G / c).sqrt();
    let fallen = |t: f64| -top * top / G * (G * t / top).cosh().ln();
    for t in [0.3, 1.0, 2.0] {
        near(run.at(t, 2), fallen(t), 3e-3);
    }
}

#[test]
fn a_spinning_ball_curves_at_the_rate_of_its_magnus_force() {
    // The body spins about the vertical at 20 rad/s. Its horizontal velocity rotates at c w / m.
    let (c, w, v) = (0.002, 20.0, 3.0);
    let run = Setup::new(BALL, "magnus", "ball", c)
        .from(&REST, &[v, 0.0, 0.0, 0.0, 0.0, w])
        .run(|_| 0.0);
    let turn = c * w / 0.1;
    near(run.at(1.0, 0), v * turn.sin() / turn, 3e-3);
    near(run.at(1.0, 1), v * (1.0 - turn.cos()) / turn, 3e-3);
}

#[test]
fn a_gust_gives_its_momentum_and_no_more() {
    // The mean of a squared sine is a half: the velocity is F L / 2 over the mass.
    let run = Setup::new(SLIDE, "unknown:gust", "mass", 3.0)
        .drawn(AHEAD)
        .run(|_| 0.0);
    near(run.at(1.0, 1), 3.0 * 0.2 / 2.0 / 2.0, 3e-3);
}

#[test]
fn a_hidden_wheel_does_no_work() {
    let run = Setup::new(BALL, "unknown:hidden-gyroscope", "ball", 0.001)
        .drawn(UP)
        .from(&REST, &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0])
        .run(|_| 0.0);
    // A ball of I = 0.4 m r² rotates about x. The torque H x w rotates w about z at H / I and keeps
    // its magnitude.
    let inertia = 0.4 * 0.1 * 0.05f64.powi(2);
    let dt = 0.002;
    let rate = |t: f64| {
        let q = |t: f64| unit([3, 4, 5, 6].map(|c| run.at(t, c)));
        let (a, b) = (q(t), q(t + dt));
        // Angular velocity in the world from two orientations: 2 q' q*.
        let d: Vec<f64> = a.iter().zip(&b).map(|(x, y)| (y - x) / dt).collect();
        let x = 2.0 * (-d[0] * a[1] + d[1] * a[0] - d[2] * a[3] + d[3] * a[2]);
        let y = 2.0 * (-d[0] * a[2] + d[2] * a[0] - d[3] * a[1] + d[1] * a[3]);
        (x, y)
    };
    let t = 0.05;
    let (x, y) = rate(t);
    near((x * x + y * y).sqrt(), 2.0, 1e-2);
    let angle = 0.001 / inertia * (t + dt / 2.0);
    near(y.atan2(x), angle, 0.03);
}

/// A unit quaternion of four readings.
fn unit(q: [f64; 4]) -> [f64; 4] {
    let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    q.map(|x| x / norm)
}
