//! The path of a tracked object in an episode: its places, its displacement, and how evenly it
//! visited the parts of the floor.

use asid::core::episode::Episode;
use asid::core::task::Outline;

/// Positions of an object in the plane, m, one per reading of its position sensor.
///
/// Missing readings are skipped. The path is empty if the log has no such sensor.
#[must_use]
pub fn path(episode: &Episode, position: &str) -> Vec<[f64; 2]> {
    let Some(range) = episode.channel(position).filter(|r| r.len() >= 2) else {
        return Vec::new();
    };
    (0..episode.rows())
        .map(|i| {
            let row = &episode.reading(i)[range.clone()];
            [row[0], row[1]]
        })
        .filter(|at| at.iter().all(|x| x.is_finite()))
        .collect()
}

/// Distance from the first position of a path to its last, m; 0 for an empty path.
#[must_use]
pub fn displacement(path: &[[f64; 2]]) -> f64 {
    match (path.first(), path.last()) {
        (Some(a), Some(b)) => (b[0] - a[0]).hypot(b[1] - a[1]),
        _ => 0.0,
    }
}

/// Share of a path's positions in each region; NaN for an empty path.
///
/// A position outside of all regions counts for none. If regions do not overlap, the shares
/// therefore sum to at most 1.
#[must_use]
pub fn shares(path: &[[f64; 2]], regions: &[Outline]) -> Vec<f64> {
    regions
        .iter()
        .map(|region| {
            let inside = path.iter().filter(|at| contains(&region.corners, **at));
            inside.count() as f64 / path.len() as f64
        })
        .collect()
}

/// How evenly regions were visited: the entropy of the shares over that of equal shares.
///
/// It is 1 if all regions have equal shares, and 0 if one has all. It is NaN if all shares are
/// zero, or if there are fewer than two regions.
#[must_use]
pub fn coverage(shares: &[f64]) -> f64 {
    let total: f64 = shares.iter().sum();
    let entropy: f64 = shares
        .iter()
        .map(|s| s / total)
        .filter(|p| *p != 0.0)
        .map(|p| -p * p.ln())
        .sum();
    // The sum of nothing is -0.
    if shares.len() < 2 {
        return f64::NAN;
    }
    (entropy / (shares.len() as f64).ln()).abs()
}

/// Whether a point is in a polygon, by the number of edges to the right of the point.
#[must_use]
pub fn contains(corners: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
    let n = corners.len();
    let crossings = (0..n).filter(|&i| {
        let ([ax, ay], [bx, by]) = (corners[i], corners[(i + 1) % n]);
        (ay > y) != (by > y) && x < ax + (y - ay) / (by - ay) * (bx - ax)
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid::core::episode::ChannelColumns;

    fn square(from: f64) -> Outline {
        Outline {
            label: String::new(),
            corners: vec![
                [from, 0.0],
                [from + 1.0, 0.0],
                [from + 1.0, 1.0],
                [from, 1.0],
            ],
        }
    }

    #[test]
    fn equal_shares_cover_wholly_and_one_region_not_at_all() {
        let regions = [square(0.0), square(1.0), square(2.0)];
        let even = shares(&[[0.5, 0.5], [1.5, 0.5], [2.5, 0.5]], &regions);
        assert!(even.iter().all(|s| (s - 1.0 / 3.0).abs() < 1e-12));
        assert!((coverage(&even) - 1.0).abs() < 1e-12);
        let one = shares(&[[0.5, 0.5], [0.2, 0.1]], &regions);
        assert_eq!((one[0], coverage(&one)), (1.0, 0.0));
        // Equal shares of two of three regions.
        let two = shares(&[[0.5, 0.5], [1.5, 0.5]], &regions);
        assert!((coverage(&two) - 2_f64.ln() / 3_f64.ln()).abs() < 1e-12);
        // A position outside of all regions counts for none.
        let outside = shares(&[[0.5, 0.5], [9.0, 9.0]], &regions);
        assert_eq!(outside, [0.5, 0.0, 0.0]);
        assert!(coverage(&[0.0, 0.0]).is_nan());
    }

    #[test]
    fn a_path_passes_over_missing_readings() {
        let episode = Episode {
            time: vec![0.0, 0.1, 0.2],
            channels: vec![ChannelColumns {
                name: "ball_pos".into(),
                len: 3,
            }],
            readings: [[0.0, 0.0, 0.1], [f64::NAN; 3], [0.3, 0.4, 0.1]].concat(),
            ..Episode::default()
        };
        let path = path(&episode, "ball_pos");
        assert_eq!(path, [[0.0, 0.0], [0.3, 0.4]]);
        assert!((displacement(&path) - 0.5).abs() < 1e-12);
        assert_eq!(displacement(&[]), 0.0);
    }
}
