//! Success of a shot: the distance from the zone's middle at which the puck comes to rest.

use asid_core::task::Outcome;

use super::{LANE_HALF, Zone};

/// Motion in the last frame below which the puck counts as at rest, m.
const REST: f64 = 5e-5;

/// Cost added where the puck has left the board sideways or still moves, m.
const MISS_COST: f64 = 0.25;

/// Error where the simulation has diverged, m.
const LOST: f64 = 10.0;

/// Distance along the board from the middle of the zone, m.
pub fn zone_error(zone: Zone, position: &[f64]) -> f64 {
    (position[0] - zone.middle()).abs()
}

/// Outcome of an attempt for a zone of `zone_length` (m): the puck's position in the last row. Rows
/// have three entries.
pub fn outcome(zone: Zone, zone_length: f64, readings: &[f64]) -> Outcome {
    let [before, last] = [6, 3].map(|back| &readings[readings.len().saturating_sub(back)..][..3]);
    if last.iter().chain(before).any(|x| !x.is_finite()) {
        return Outcome {
            value: LOST,
            success: false,
            cost: LOST + MISS_COST,
        };
    }
    let value = zone_error(zone, last).min(LOST);
    let rests = (last[0] - before[0]).hypot(last[1] - before[1]) < REST;
    let on_board = last[1].abs() <= LANE_HALF[1];
    let fair = rests && on_board;
    Outcome {
        value,
        success: fair && value <= 0.5 * zone_length,
        cost: value + if fair { 0.0 } else { MISS_COST },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resting(x: f64, y: f64) -> [f64; 6] {
        [x, y, 0.0127, x, y, 0.0127]
    }

    #[test]
    fn a_puck_scores_in_its_zone_alone() {
        for (zone, low, high) in [(Zone::Near, 0.675, 0.925), (Zone::Far, 0.925, 1.175)] {
            for (x, scores) in [
                (low - 0.01, false),
                (low + 0.01, true),
                (high - 0.01, true),
                (high + 0.01, false),
            ] {
                assert_eq!(
                    outcome(zone, 0.25, &resting(x, 0.0)).success,
                    scores,
                    "{zone:?} {x}"
                );
            }
        }
    }

    #[test]
    fn a_shorter_zone_has_the_same_middle() {
        for (x, scores) in [(0.8, true), (0.83, true), (0.87, false)] {
            assert_eq!(
                outcome(Zone::Near, 0.1, &resting(x, 0.0)).success,
                scores,
                "{x}"
            );
        }
    }

    #[test]
    fn beside_the_board_in_motion_or_lost_it_does_not_score() {
        let good = outcome(Zone::Near, 0.25, &resting(0.8, 0.0));
        assert!(good.success && good.value < 1e-12);
        let moving = [0.79, 0.0, 0.0127, 0.8, 0.0, 0.0127];
        for readings in [resting(0.8, 0.12), moving, [f64::NAN; 6]] {
            let bad = outcome(Zone::Near, 0.25, &readings);
            assert!(!bad.success && bad.cost > good.cost);
        }
    }
}
