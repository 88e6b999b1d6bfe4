//! Writes simulated logs as files.

use std::fmt::Write as _;
use std::path::Path;

use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

/// Writes the log of an episode; the last of `episodes` is held out.
///
/// `columns` are the columns after the time. Each row has `places` (`rows x width`) with noise of a
/// standard deviation, seeded by the episode. The first row also has the initial state, `start`.
pub fn write_log(
    folder: &Path,
    (episode, episodes): (usize, usize),
    columns: &str,
    (places, width): (&[f64], usize),
    start: &[f64],
    (seconds, noise): (f64, f64),
) {
    let mut random = ChaCha8Rng::seed_from_u64(episode as u64);
    let mut text = format!("time{columns}\n");
    for (row, place) in places.chunks(width).enumerate() {
        write!(text, "{:.2}", row as f64 * seconds).unwrap();
        for x in place {
            // The sum of twelve uniform numbers is approximately normal.
            let normal = (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            write!(text, ",{}", x + noise * normal).unwrap();
        }
        for x in start {
            match row {
                0 => write!(text, ",{x}").unwrap(),
                _ => text.push(','),
            }
        }
        text.push('\n');
    }
    write_episode(folder, (episode, episodes - 1), &text);
}

/// Writes the text of an episode's log; episodes from `training` on are held out.
pub fn write_episode(folder: &Path, (episode, training): (usize, usize), text: &str) {
    let part = if episode < training { "train" } else { "test" };
    std::fs::write(folder.join(format!("{part}_{episode}.csv")), text).unwrap();
}

/// Writes the model, and a study of such logs.
pub fn write_model(folder: &Path, xml: &str) {
    write_model_with(folder, xml, "");
}

/// Writes the model, and a study with parameters.
pub fn write_model_with(folder: &Path, xml: &str, parameters: &str) {
    std::fs::write(folder.join("nominal.xml"), xml).unwrap();
    let study = "model = \"nominal.xml\"\ntrain = [\"train_*.csv\"]\ntest = [\"test_*.csv\"]\n";
    std::fs::write(folder.join("study.toml"), format!("{study}{parameters}")).unwrap();
}
