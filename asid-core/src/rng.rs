//! One seed, many independent streams.
//!
//! Every use of chance names its stream, so that adding one use does not shift
//! the numbers of another, and work split over threads draws the same numbers
//! as work that is not.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The generator used throughout.
pub type Rng = ChaCha8Rng;

/// Source of named random streams.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Streams {
    seed: u64,
}

impl Streams {
    /// Streams of this seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// The seed.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The stream of this name.
    #[must_use]
    pub fn stream(&self, name: &str) -> Rng {
        self.indexed(name, 0)
    }

    /// The `index`-th stream of this name.
    #[must_use]
    pub fn indexed(&self, name: &str, index: u64) -> Rng {
        Rng::seed_from_u64(mix(mix(self.seed ^ hash(name)) ^ mix(index)))
    }

    /// Streams of a part of the work, independent of this one's.
    #[must_use]
    pub fn child(&self, name: &str) -> Self {
        Self {
            seed: mix(self.seed ^ hash(name).rotate_left(17)),
        }
    }
}

/// FNV-1a, which unlike the standard library's hasher never changes.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    })
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng as _;

    #[test]
    fn streams_differ_by_name_index_and_seed_and_repeat() {
        let first = |s: u64, n: &str, i: u64| Streams::new(s).indexed(n, i).random::<u64>();
        assert_eq!(first(0, "a", 0), first(0, "a", 0));
        let all = [
            first(0, "a", 0),
            first(0, "a", 1),
            first(0, "b", 0),
            first(1, "a", 0),
        ];
        for i in 0..all.len() {
            for j in 0..i {
                assert_ne!(all[i], all[j]);
            }
        }
    }
}
