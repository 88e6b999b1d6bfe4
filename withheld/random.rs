//! Random streams: one seed gives a stream to each case and to each purpose within it.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};

/// A stream that depends on a seed and on names alone, not on the order in which streams are made.
#[must_use]
pub fn stream(seed: u64, names: &[&str]) -> ChaCha8Rng {
    ChaCha8Rng::from_seed(digest(seed, names))
}

/// SHA-256 of a seed and names.
#[must_use]
pub fn digest(seed: u64, names: &[&str]) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(seed.to_le_bytes());
    for name in names {
        hash.update((name.len() as u64).to_le_bytes());
        hash.update(name.as_bytes());
    }
    hash.finalize().into()
}

/// A normal deviate of unit variance (Box and Muller 1958).
#[must_use]
pub fn normal(random: &mut impl Rng) -> f64 {
    let radius = (-2.0 * (1.0 - random.random::<f64>()).ln()).sqrt();
    radius * (std::f64::consts::TAU * random.random::<f64>()).cos()
}
