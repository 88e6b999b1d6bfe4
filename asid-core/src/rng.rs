//! One seed, many independent streams.
//!
//! Every use of random numbers names its stream. Adding one use therefore does not shift the
//! numbers of another, and work split over threads draws the same numbers as work that is not.
//!
//! [`Streams::child`] separates parts that trust each other: its mix can be inverted, and its
//! siblings are reachable from their common root. [`Streams::sealed`] separates parts that must not
//! know of each other, such as a method and the real world by which it is judged.

use rand::{RngCore as _, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The generator used everywhere.
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

    /// Streams of a part of the work, independent of those of the whole.
    #[must_use]
    pub fn child(&self, name: &str) -> Self {
        Self {
            seed: mix(self.seed ^ hash(name).rotate_left(17)),
        }
    }

    /// Streams from which neither these nor other sealed streams can be derived.
    ///
    /// The new root is 64 bits of ChaCha's output under a key made of this root and the name.
    /// ChaCha is a pseudo-random function: the key can only be found by trying keys, and the
    /// outputs of two keys are unrelated. The holder of `sealed("a")` can name any stream and any
    /// child, and still draws no number of `sealed("b")`. One direction suffices, because sealed
    /// streams are passed on alone, never with the root. The root is often a small number, so this
    /// does not protect against guessing it. It only prevents unintended access.
    #[must_use]
    pub fn sealed(&self, name: &str) -> Self {
        let key = mix(self.seed ^ hash(name).rotate_left(31));
        Self {
            seed: Rng::seed_from_u64(key).next_u64(),
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

    /// Names that a method might try do not help it: neither a stream, nor a child, nor another
    /// seal of what it holds draws the world's numbers.
    #[test]
    fn sealed_streams_do_not_lead_to_each_other() {
        const NAMES: [&str; 8] = [
            "world",
            "method",
            "truth",
            "wear",
            "task start",
            "exploration start",
            "perturbation",
            "",
        ];
        for seed in 0..20 {
            let root = Streams::new(seed);
            let (method, world) = (root.sealed("method"), root.sealed("world"));
            assert_eq!(world, root.sealed("world"), "a seed repeats");
            let first = |s: &Streams, n: &str| s.stream(n).random::<u64>();
            let hidden: Vec<u64> = NAMES.iter().map(|n| first(&world, n)).collect();
            let mut reached = vec![method];
            for _ in 0..2 {
                let more: Vec<Streams> = reached
                    .iter()
                    .flat_map(|s| NAMES.map(|n| [s.child(n), s.sealed(n)]))
                    .flatten()
                    .collect();
                reached.extend(more);
            }
            for streams in &reached {
                assert!(*streams != world && *streams != root);
                assert!(NAMES.iter().all(|n| !hidden.contains(&first(streams, n))));
            }
        }
    }
}
