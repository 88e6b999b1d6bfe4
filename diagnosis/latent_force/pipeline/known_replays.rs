//! Residuals of the last replays of whole logs.
//!
//! A search compares many sets with its base, and asks for the replays of that base each time. A
//! fit to replays begins where a set was replayed before. Equal values and initial states give
//! equal residuals, so each is replayed once.

use std::cell::RefCell;
use std::collections::VecDeque;

use asid_core::Result;

use crate::predict::Point;

/// Most residuals that are kept, of all replays together: 32 MB.
const MOST: usize = 4_000_000;

/// Residuals of the last replays, with what was replayed.
#[derive(Default)]
pub(super) struct KnownReplays {
    /// The replay that was asked for last is the last one.
    known: RefCell<VecDeque<(Vec<u64>, Vec<f64>)>>,
}

impl KnownReplays {
    /// Returns the residuals of some candidates (`members`) at a point: the known ones, or else
    /// those that `replayed` returns.
    ///
    /// # Errors
    /// As `replayed`.
    pub(super) fn residuals(
        &self,
        (members, point): (&[usize], &Point),
        replayed: impl FnOnce() -> Result<Vec<f64>>,
    ) -> Result<Vec<f64>> {
        let key = key(members, point);
        let place = self.known.borrow().iter().position(|(k, _)| *k == key);
        let own = place.and_then(|place| self.known.borrow_mut().remove(place));
        let residuals = match own {
            Some((_, residuals)) => residuals,
            None => replayed()?,
        };
        let mut known = self.known.borrow_mut();
        known.push_back((key, residuals.clone()));
        let mut kept: usize = known.iter().map(|(_, r)| r.len()).sum();
        while kept > MOST && known.len() > 1 {
            kept -= known.pop_front().map_or(0, |(_, r)| r.len());
        }
        Ok(residuals)
    }
}

/// The bits of all numbers that a replay depends on.
fn key(members: &[usize], point: &Point) -> Vec<u64> {
    let members = std::iter::once(members.len()).chain(members.iter().copied());
    let starts = point.starts.iter();
    let starts = starts.flat_map(|s| s.qpos.iter().chain(&s.qvel));
    let numbers = point.theta.iter().chain(starts);
    let members = members.map(|m| m as u64);
    members.chain(numbers.map(|x| x.to_bits())).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use crate::predict::State;

    use super::*;

    fn point(theta: f64, place: f64) -> Point {
        Point {
            theta: vec![theta],
            starts: vec![State {
                qpos: vec![place],
                qvel: vec![0.0],
            }],
        }
    }

    #[test]
    fn a_replay_is_made_once_and_another_value_member_or_initial_state_is_another_replay() {
        let known = KnownReplays::default();
        let replays = Cell::new(0);
        // The residuals of the n-th replay are n.
        let ask = |members: &[usize], at: &Point| {
            let replayed = || {
                replays.set(replays.get() + 1);
                Ok(vec![f64::from(replays.get())])
            };
            known.residuals((members, at), replayed).unwrap()[0]
        };
        assert_eq!(ask(&[], &point(0.5, 0.1)), 1.0);
        assert_eq!(ask(&[], &point(0.5, 0.1)), 1.0);
        assert_eq!(ask(&[3], &point(0.5, 0.1)), 2.0);
        assert_eq!(ask(&[], &point(0.5 + f64::EPSILON, 0.1)), 3.0);
        assert_eq!(ask(&[], &point(0.5, 0.2)), 4.0);
        assert_eq!(ask(&[], &point(0.5, 0.1)), 1.0);
        assert_eq!(replays.get(), 4);
    }

    #[test]
    fn the_replays_asked_for_last_are_kept() {
        let known = KnownReplays::default();
        let replays = Cell::new(0);
        let ask = |theta: f64| {
            let replayed = || {
                replays.set(replays.get() + 1);
                Ok(vec![0.0; MOST / 2])
            };
            known
                .residuals((&[], &point(theta, 0.0)), replayed)
                .unwrap();
        };
        // There is room for two.
        [1.0, 2.0, 1.0, 3.0, 1.0].into_iter().for_each(ask);
        assert_eq!(replays.get(), 3);
        ask(2.0);
        assert_eq!(replays.get(), 4);
    }

    #[test]
    fn a_replay_that_failed_is_made_again() {
        let known = KnownReplays::default();
        let at = point(0.5, 0.1);
        let failed = || Err(asid_core::Error::Failed("the engine stopped".into()));
        assert!(known.residuals((&[], &at), failed).is_err());
        let found = known.residuals((&[], &at), || Ok(vec![7.0])).unwrap();
        assert_eq!(found, [7.0]);
    }
}
