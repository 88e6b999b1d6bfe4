//! Logs of a machine with one joint, integrated by hand.

use std::fmt::Write as _;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Returns a source of approximately normal numbers with standard deviation 1.
pub fn normal(seed: u64) -> impl FnMut() -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
}

/// A log of one joint that begins at rest at zero.
///
/// After `header` its rows have time, command and angle, each angle with `noise`. Rows are `row` s
/// apart, over `seconds`. `step` advances angle and speed under a command by one of `steps` equal
/// parts of a row.
pub fn joint_log(
    header: &str,
    [seconds, row]: [f64; 2],
    steps: u32,
    (command, step): (impl Fn(f64) -> f64, impl Fn([f64; 2], f64, f64) -> [f64; 2]),
    mut noise: impl FnMut() -> f64,
) -> String {
    let read = |u: &f64, state: &[f64; 2]| format!("{u},{}", state[0] + noise());
    let advance = |state, u: &f64, h| step(state, *u, h);
    let machine = (command, read, advance);
    machine_log(header, ([seconds, row], steps), ([0.0; 2], "0,0"), machine)
}

/// A log of a machine with any state.
///
/// After `header` its rows have the time and what `read` writes of a command and a state. The first
/// row also has the initial state, `begins`. Rows are `row` s apart, over `seconds`. `step`
/// advances the state under a command by one of `steps` equal parts of a row.
pub fn machine_log<S, U>(
    header: &str,
    ([seconds, row], steps): ([f64; 2], u32),
    (mut state, begins): (S, &str),
    (command, mut read, step): (
        impl Fn(f64) -> U,
        impl FnMut(&U, &S) -> String,
        impl Fn(S, &U, f64) -> S,
    ),
) -> String {
    let mut text = header.to_owned();
    let open: String = begins.matches(',').collect();
    for k in 0..(seconds / row) as usize {
        let time = row * k as f64;
        let u = command(time);
        let start = if k == 0 { begins } else { &open };
        let _ = write!(text, "\n{time:.6},{},{start}", read(&u, &state));
        for _ in 0..steps {
            state = step(state, &u, row / f64::from(steps));
        }
    }
    text + "\n"
}
