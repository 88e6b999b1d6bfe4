//! Large arrays of numbers as text: 16-bit integers, little-endian, in base64.

use asid_results::view::Take;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD_NO_PAD;

/// Steps of a position across the box: one less than the largest value, which marks a missing pose.
const STEPS: f64 = 65534.0;
/// Steps of a quaternion's component from 0 to 1.
const TURN: f64 = 32767.0;
/// First number of a missing pose.
const MISSING: u16 = u16::MAX;

/// The text of some numbers.
pub fn text(numbers: &[u16]) -> String {
    let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
    STANDARD_NO_PAD.encode(bytes)
}

/// The cube that defines the units of positions.
#[derive(Clone, Copy, Debug)]
pub struct Cube {
    /// Lowest corner, m.
    pub low: [f64; 3],
    /// Side, m.
    pub size: f64,
}

impl Cube {
    /// The smallest cube around some points; non-finite points are ignored.
    pub fn around(points: impl Iterator<Item = [f64; 3]>) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for p in points.filter(|p| p.iter().all(|x| x.is_finite())) {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        if low[0] > high[0] {
            (low, high) = ([0.0; 3], [1.0; 3]);
        }
        // Use the corner as it is written, with fewer digits, so that no point falls outside.
        let low = low.map(below);
        let widest = (0..3).map(|k| high[k] - low[k]).fold(1e-6, f64::max);
        Self {
            low,
            size: f64::from((widest * 1.000_001) as f32),
        }
    }

    /// Its lowest and its highest corner.
    pub fn corners(&self) -> [[f64; 3]; 2] {
        [self.low, self.low.map(|x| x + self.size)]
    }

    /// Limits it to a distance of `most` around another cube: what a stray simulation reaches is
    /// not worth the resolution.
    pub fn near(self, other: Self, most: f64) -> Self {
        let [low, high] = [0, 1].map(|side| {
            [0, 1, 2].map(|k| match side {
                0 => self.low[k].max(other.low[k] - most),
                _ => (self.low[k] + self.size).min(other.low[k] + other.size + most),
            })
        });
        Self::around([low, high].into_iter())
    }

    /// A point in steps of the cube.
    pub fn point(&self, p: [f64; 3]) -> [u16; 3] {
        [0, 1, 2].map(|k| {
            let steps = (p[k] - self.low[k]) / self.size * STEPS;
            steps.round().clamp(0.0, STEPS) as u16
        })
    }

    /// A pose in steps; missing if it is not finite or lies outside.
    pub fn pose(&self, pose: &nalgebra::Isometry3<f64>) -> [u16; 7] {
        let (t, q) = (&pose.translation, &pose.rotation);
        let inside = |k: usize| {
            let across = (t.vector[k] - self.low[k]) / self.size;
            (-1e-6..=1.0 + 1e-6).contains(&across)
        };
        if ![q.w, q.i, q.j, q.k].iter().all(|x| x.is_finite()) || !(0..3).all(inside) {
            return [MISSING; 7];
        }
        let turn = |x: f64| ((x + 1.0) * TURN).round().clamp(0.0, 2.0 * TURN) as u16;
        let [x, y, z] = self.point([t.x, t.y, t.z]);
        [x, y, z, turn(q.w), turn(q.i), turn(q.j), turn(q.k)]
    }

    /// Writes the cube into the page's data.
    pub fn tell(&self, take: &mut Take) {
        take.low = self.low.map(|x| x as f32);
        take.size = self.size as f32;
    }
}

/// The largest number of single precision that is not above `x`.
fn below(x: f64) -> f64 {
    let near = x as f32;
    f64::from(if f64::from(near) > x {
        near.next_down()
    } else {
        near
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};

    /// Half a step in each direction: 1/65534 of the cube for positions, 1/32767 for a quaternion's
    /// component.
    #[test]
    fn a_pose_comes_back_within_half_a_step() {
        let cube = Cube::around([[-1.0, 2.0, 0.0], [3.0, 2.5, 1.0], [f64::NAN; 3]].into_iter());
        let turn = UnitQuaternion::from_euler_angles(0.4, -1.2, 3.0);
        let place = Translation3::new(1.234, 2.3, 0.7);
        let n = cube
            .pose(&Isometry3::from_parts(place, turn))
            .map(f64::from);
        for k in 0..3 {
            let back = cube.low[k] + n[k] / STEPS * cube.size;
            assert!((back - place.vector[k]).abs() <= 0.51 * cube.size / STEPS);
        }
        for (n, x) in n[3..].iter().zip([turn.w, turn.i, turn.j, turn.k]) {
            assert!((n / TURN - 1.0 - x).abs() <= 0.51 / TURN);
        }
    }

    /// Symptom: a machine with one hinge was not drawn, nor some poses of one far from the origin.
    ///
    /// Cause: the corner of the cube was rounded to the nearest number of single precision. If that
    /// is above the lowest point, this point lies outside.
    #[test]
    fn the_lowest_point_lies_inside_however_small_and_far_the_cube_is() {
        let pose = |cube: &Cube, [x, y, z]: [f64; 3]| {
            let place = Translation3::new(x, y, z);
            cube.pose(&Isometry3::from_parts(place, UnitQuaternion::identity()))
        };
        for p in [[0.0, 0.0, 0.3], [0.05, 0.0, 1.0], [20.1, -30.7, 0.2]] {
            let cube = Cube::around(std::iter::once(p));
            assert_ne!(pose(&cube, p)[0], MISSING, "{p:?} in {cube:?}");
        }
        // Twenty points over 0.5 m, at many places 50 m away.
        for place in 0..200 {
            let at = |k: usize, axis: usize| {
                let spread = (0.7 * k as f64 + axis as f64).sin();
                50.0 * (1.3 * f64::from(place) + axis as f64).sin() + 0.25 * spread
            };
            let points: Vec<[f64; 3]> =
                (0..20).map(|k| [0, 1, 2].map(|axis| at(k, axis))).collect();
            let cube = Cube::around(points.iter().copied());
            for p in points {
                let n = pose(&cube, p);
                assert_ne!(n[0], MISSING, "{p:?} in {cube:?}");
                for k in 0..3 {
                    let back = cube.low[k] + f64::from(n[k]) / STEPS * cube.size;
                    assert!((back - p[k]).abs() <= 0.51 * cube.size / STEPS);
                }
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_missing() {
        let cube = Cube::around(std::iter::empty());
        let nowhere = Isometry3::from_parts(
            Translation3::new(f64::NAN, 0.0, 0.0),
            UnitQuaternion::identity(),
        );
        assert_eq!(cube.pose(&nowhere)[0], MISSING);
        assert_eq!(text(&[1, 65535]), "AQD//w");
    }
}
