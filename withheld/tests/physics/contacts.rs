//! Contacts: a puck that slides on a level board, and one that is dropped onto it.

use super::rig::{G, PUCK, Setup, near};

/// Friction of the rig's board.
const MU: f64 = 0.2;
/// Height of a puck at rest: it sinks in by `(1 - d) g / (d k)`, 0.025 mm.
const HEIGHT: f64 = 0.029_975;

fn slide(cause: &'static str, size: f64, draw: [f64; 4], velocity: [f64; 3]) -> super::rig::Run {
    Setup::new(PUCK, cause, "board", size)
        .drawn(draw)
        .from(&[0.0, 0.0, HEIGHT], &velocity)
        .run(|_| 0.0)
}

const PLUS: [f64; 4] = [0.9; 4];

#[test]
fn friction_brakes_a_puck_by_its_coefficient() {
    let run = slide("sliding-friction", 0.5, PLUS, [2.0, 0.0, 0.0]);
    near(run.value("factor"), 1.5, 1e-9);
    let t = 0.5;
    near(run.at(t, 0), 2.0 * t - 0.5 * 1.5 * MU * G * t * t, 1e-2);
    // The puck stops after v / (mu g), at v² / (2 mu g).
    near(run.at(1.0, 0), 4.0 / (2.0 * 1.5 * MU * G), 1e-2);
}

#[test]
fn friction_that_grows_brakes_by_its_integral() {
    let rate = 2.0;
    let run = slide("friction-drift", rate, PLUS, [3.0, 0.0, 0.0]);
    let t = 0.5f64;
    let expected = 3.0 * t - MU * G * (t * t / 2.0 + rate * t.powi(3) / 6.0);
    near(run.at(t, 0), expected, 1e-2);
}

#[test]
fn a_patch_brakes_beyond_its_edge_only() {
    // The edge is along x, by the second draw; the third draw sets its position.
    let run = slide("friction-patch", 1.0, [0.9, 0.1, 0.8, 0.5], [2.0, 0.0, 0.0]);
    let edge = run.value("place");
    assert!(edge > 0.01 && edge < 0.9, "edge at {edge}");
    // Energy: v² - 2 mu g edge is left at the edge. The friction doubles beyond it.
    let left = 4.0 - 2.0 * MU * G * edge;
    let stop = edge + left / (2.0 * run.value("ratio") * MU * G);
    let slow = Setup::new(PUCK, "friction-patch", "board", 1.0)
        .drawn([0.9, 0.1, 0.8, 0.5])
        .from(&[0.0, 0.0, HEIGHT], &[2.0, 0.0, 0.0])
        .lasting(2.0)
        .run(|_| 0.0);
    near(slow.at(2.0, 0), stop, 1e-2);
}

#[test]
fn friction_by_direction_differs_between_x_and_y() {
    let draw = [0.0, 0.5, 0.5, 0.5];
    let (x, y) = (
        slide("friction-anisotropy", 0.4, draw, [1.5, 0.0, 0.0]),
        slide("friction-anisotropy", 0.4, draw, [0.0, 1.5, 0.0]),
    );
    let t = 0.4;
    near(x.at(t, 0), 1.5 * t - 0.5 * 1.4 * MU * G * t * t, 1e-2);
    near(y.at(t, 1), 1.5 * t - 0.5 * 0.6 * MU * G * t * t, 1e-2);
}

/// Drops the puck from 0.2 m above contact. Returns the height of the first bounce and the deepest
/// penetration.
fn drop(cause: &'static str, size: f64, draw: [f64; 4]) -> (f64, f64) {
    let run = Setup::new(PUCK, cause, "board", size)
        .drawn(draw)
        .from(&[0.0, 0.0, 0.03 + 0.2], &[0.0; 3])
        .lasting(1.2)
        .run(|_| 0.0);
    let heights: Vec<f64> = (0..2400)
        .map(|i| run.at(f64::from(i) * 0.0005, 2) - 0.03)
        .collect();
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let at = heights.iter().position(|h| *h == lowest).unwrap_or(0);
    let highest = heights[at..]
        .iter()
        .copied()
        .fold(f64::NEG_INFINITY, f64::max);
    (highest, -lowest)
}

/// Integrates the rig's contact by hand, by MuJoCo's documentation.
///
/// While it is compressed, `z'' = -g (1 - d) - d (k z + b z')`. Its impedance `d` rises from 0.9 to
/// 0.95 over a millimetre, piecewise quadratically.
fn by_hand(k: f64, b: f64) -> (f64, f64) {
    let (mut z, mut v) = (0.2, 0.0);
    let (dt, mut lowest, mut highest) = (1e-6, 0.0f64, 0.0f64);
    for _ in 0..1_200_000 {
        let mut a = -G;
        if z < 0.0 {
            let x = (-z / 0.001f64).min(1.0);
            // solimp 0.9 0.95 0.001 with a midpoint of 0.5 and a power of 2.
            let y = if x < 0.5 {
                2.0 * x * x
            } else {
                1.0 - 2.0 * (1.0 - x).powi(2)
            };
            let d = 0.9 + 0.05 * y;
            // The direct form of solref is scaled by the largest impedance, which is squared for
            // the stiffness.
            let reference = -b / 0.95 * v - k * d / (0.95 * 0.95) * z;
            // A contact pushes but never pulls.
            a = a.max((1.0 - d) * -G + d * reference);
        }
        v += dt * a;
        z += dt * v;
        lowest = lowest.min(z);
        if lowest < 0.0 && v < 0.0 && highest == 0.0 && z > 0.0 {
            highest = z;
        }
    }
    (highest, -lowest)
}

#[test]
fn a_contact_of_less_damping_bounces_higher_as_an_integration_by_hand_does() {
    let (height, depth) = drop("contact-restitution", 4.0, [0.1; 4]);
    let (by_hand, deep) = by_hand(20_000.0, 280.0 / 5.0);
    near(height, by_hand, 0.05);
    near(depth, deep, 0.05);
    let (harder, _) = drop("contact-restitution", 1.0, PLUS);
    assert!(harder < height);
}

#[test]
fn a_contact_of_less_stiffness_gives_way_further_as_an_integration_by_hand_does() {
    let (height, depth) = drop("contact-stiffness", 3.0, [0.1; 4]);
    let (high, by_hand) = by_hand(5_000.0, 280.0);
    near(depth, by_hand, 0.05);
    assert!((height - high).abs() < 0.002, "{height} {high}");
}

#[test]
fn friction_that_grows_with_the_episodes_brakes_the_more() {
    let run = Setup::new(PUCK, "friction-trend", "board", 0.5)
        .from(&[0.0, 0.0, HEIGHT], &[2.0, 0.0, 0.0])
        .repeated(3)
        .run(|_| 0.0);
    let t = 0.4;
    for n in 0..3 {
        let a = (1.0 + 0.5 * n as f64) * MU * G;
        near(run.in_episode(n, t, 0), 2.0 * t - 0.5 * a * t * t, 1e-2);
    }
}
