//! Motions of a few numbers: commands over time that begin and end at the machine's rest.
//!
//! The command of an actuator is `base + amplitude · s(t)`. `s` is a smooth curve within `[-1, 1]`
//! that is zero, with its slope, at the beginning and the end. The curve is
//!
//! - a cubic B-spline with some knots ([`Shape::Spline`]), or
//! - a finite Fourier series under a window ([`Shape::Fourier`]; J. Swevers et al., "Optimal robot
//!   excitation and identification", IEEE Trans. Robotics and Automation 13, 1997).
//!
//! It is divided by its own peak where that exceeds one, so that it stays smooth: only the range of
//! a command clips it. A search optimises the coefficients, each within `[-1, 1]`.

use asid_core::rng::Rng;
use rand::Rng as _;

/// How coefficients define a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Heights of this many cubic B-splines, spread evenly over the motion.
    Spline(usize),
    /// Cosine and sine coefficients of this many harmonics of the motion's duration.
    Fourier(usize),
}

/// Share of a Fourier motion over which it fades in, and out.
const FADE: f64 = 0.15;

/// Peak of a curve of splines that all have height one.
///
/// Where a cubic spline peaks, its two neighbours have a quarter each.
const OVERLAP: f64 = 1.5;

/// A family of motions.
#[derive(Clone, Debug)]
pub struct Family {
    /// Shape of the curves.
    pub shape: Shape,
    /// Command of each actuator at rest.
    pub base: Vec<f64>,
    /// Largest distance of each command from its rest; 0 for an actuator that does not move.
    ///
    /// It is infinite for one that only the limits of its joint bound (`open_drives` finds its
    /// size).
    pub amplitude: Vec<f64>,
    /// Range of each command.
    pub range: Vec<Option<[f64; 2]>>,
    /// Frames of the motion, without the rest at its end.
    pub frames: usize,
    /// Frames at the end during which the commands rest.
    pub rest: usize,
    /// Period of a frame, s.
    pub period: f64,
}

impl Family {
    /// Number of coefficients of one actuator.
    pub(crate) fn each(&self) -> usize {
        match self.shape {
            Shape::Spline(knots) => knots,
            Shape::Fourier(harmonics) => 2 * harmonics,
        }
    }

    /// Indices of the actuators that move.
    fn moving(&self) -> Vec<usize> {
        (0..self.base.len())
            .filter(|&a| self.amplitude[a] > 0.0)
            .collect()
    }

    /// Number of coefficients.
    #[must_use]
    pub fn len(&self) -> usize {
        self.each() * self.moving().len()
    }

    /// Whether nothing moves.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Frames of the motion and the rest.
    #[must_use]
    pub fn all_frames(&self) -> usize {
        self.frames + self.rest
    }

    /// Commands, `all_frames x nu`, scaled by `scale`.
    #[must_use]
    pub fn commands(&self, coefficients: &[f64], scale: f64) -> Vec<f64> {
        let nu = self.base.len();
        let mut out = self.base.repeat(self.all_frames());
        let frames: Vec<f64> = (0..self.frames).map(|k| self.time_of(k)).collect();
        for (own, a) in coefficients
            .chunks_exact(self.each().max(1))
            .zip(self.moving())
        {
            for (k, s) in self.curve(own, &frames).into_iter().enumerate() {
                let value = self.base[a] + scale * self.amplitude[a] * s;
                out[k * nu + a] = self.range[a].map_or(value, |[low, high]| value.clamp(low, high));
            }
        }
        out
    }

    /// Time of frame `k`, as a share of the motion.
    fn time_of(&self, k: usize) -> f64 {
        k as f64 / self.frames as f64
    }

    /// The curve at times `at` (shares of the motion), within `[-1, 1]` at each frame.
    fn curve(&self, coefficients: &[f64], at: &[f64]) -> Vec<f64> {
        let frames = (0..self.frames).map(|k| self.height(coefficients, self.time_of(k)).abs());
        let peak = frames.fold(1.0, f64::max);
        at.iter()
            .map(|&at| self.height(coefficients, at) / peak)
            .collect()
    }

    /// The curve before its peak is limited, at a share of the motion.
    fn height(&self, coefficients: &[f64], at: f64) -> f64 {
        match self.shape {
            Shape::Spline(knots) => {
                // Each spline's support lies within the motion: the curve and its slope vanish at
                // the ends.
                let x = at * (knots + 3) as f64;
                coefficients
                    .iter()
                    .enumerate()
                    .map(|(k, c)| c * cubic(x - k as f64))
                    .sum()
            }
            Shape::Fourier(harmonics) => {
                let sum: f64 = (0..harmonics)
                    .map(|k| {
                        let turn = std::f64::consts::TAU * (k + 1) as f64 * at;
                        coefficients[2 * k] * turn.cos() + coefficients[2 * k + 1] * turn.sin()
                    })
                    .sum();
                let edge = (at.min(1.0 - at) / FADE).clamp(0.0, 1.0);
                let window = edge * edge * (3.0 - 2.0 * edge);
                window * sum / (harmonics as f64).sqrt()
            }
        }
    }

    /// Spline heights that approximate a curve of another family. For a spline family.
    #[must_use]
    pub fn near(&self, other: &Self, coefficients: &[f64]) -> Vec<f64> {
        let each = self.each();
        // A spline with the support `[k, k + 4]` peaks in its middle.
        let middle: Vec<f64> = (0..each)
            .map(|k| (k + 2) as f64 / (each + 3) as f64)
            .collect();
        let all = coefficients.chunks_exact(other.each().max(1));
        all.flat_map(|own| other.curve(own, &middle))
            .map(|height| height / OVERLAP)
            .collect()
    }

    /// Random coefficients.
    pub fn random(&self, rng: &mut Rng) -> Vec<f64> {
        (0..self.len())
            .map(|_| rng.random_range(-1.0..1.0))
            .collect()
    }

    /// A multisine of equal amplitudes with Schroeder's phases, which keep its peaks low.
    ///
    /// Each actuator has another order of the harmonics (M. Schroeder, IEEE Trans. Information
    /// Theory 16, 1970). For a Fourier family.
    #[must_use]
    pub fn multisine(&self) -> Vec<f64> {
        let harmonics = self.each() / 2;
        let mut all = Vec::with_capacity(self.len());
        for i in 0..self.moving().len() {
            for k in 0..harmonics {
                let order = ((k + i) % harmonics.max(1) + 1) as f64;
                let phase = -std::f64::consts::PI * order * (order - 1.0) / harmonics as f64;
                all.extend([phase.cos(), phase.sin()]);
            }
        }
        all
    }
}

/// The cubic B-spline with support `[0, 4]`, scaled to a peak of one.
fn cubic(x: f64) -> f64 {
    let part = |x: f64| x.max(0.0).powi(3);
    let value =
        part(x) - 4.0 * part(x - 1.0) + 6.0 * part(x - 2.0) - 4.0 * part(x - 3.0) + part(x - 4.0);
    if (0.0..=4.0).contains(&x) {
        value / 4.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Streams;

    fn family(shape: Shape) -> Family {
        Family {
            shape,
            base: vec![0.5, 2.0],
            amplitude: vec![1.0, 0.0],
            range: vec![Some([-0.2, 1.4]), None],
            frames: 200,
            rest: 10,
            period: 0.01,
        }
    }

    #[test]
    fn a_spline_is_smooth_and_peaks_at_one() {
        assert!((cubic(2.0) - 1.0).abs() < 1e-12);
        assert!(cubic(0.0).abs() < 1e-12 && cubic(4.0).abs() < 1e-12);
        // The slope is continuous at a knot.
        let slope = |x: f64| (cubic(x + 1e-6) - cubic(x - 1e-6)) / 2e-6;
        assert!((slope(1.0 - 1e-5) - slope(1.0 + 1e-5)).abs() < 1e-3);
    }

    #[test]
    fn splines_come_near_a_multisine() {
        let [splines, fourier] = [Shape::Spline(24), Shape::Fourier(3)].map(family);
        let wanted = fourier.commands(&fourier.multisine(), 1.0);
        let found = splines.commands(&splines.near(&fourier, &fourier.multisine()), 1.0);
        let (mut off, mut size) = (0.0, 0.0);
        for (a, b) in wanted.iter().zip(&found).step_by(2) {
            off += (a - b).powi(2);
            size += (a - 0.5).powi(2);
        }
        // Sampled heights flatten sharp turns of the curve, by a tenth of its standard deviation.
        assert!(off < 0.03 * size, "{off} {size}");
    }

    #[test]
    fn motions_begin_and_end_at_rest_and_keep_the_range() {
        let mut rng = Streams::new(1).stream("t");
        for shape in [Shape::Spline(8), Shape::Fourier(5)] {
            let family = family(shape);
            let commands = family.commands(&family.random(&mut rng), 1.0);
            assert_eq!(commands.len(), 2 * 210);
            for row in commands.chunks_exact(2) {
                assert!((-0.2..=1.4).contains(&row[0]));
                assert_eq!(row[1], 2.0);
            }
            let at = |k: usize| commands[2 * k];
            // Near either end the curve grows with the square of the time.
            assert!((at(0) - 0.5).abs() < 1e-9 && (at(1) - 0.5).abs() < 2e-2);
            assert!((at(199) - 0.5).abs() < 2e-2);
            assert!((200..210).all(|k| at(k) == 0.5));
        }
    }

    /// Symptom: plateaus with corners in commands that should be smooth.
    ///
    /// Cause: curves above one were clipped there. At twice the frame rate, the second differences
    /// of a curve with a continuous slope fall by four, those at a corner by two.
    #[test]
    fn a_curve_above_one_is_no_plateau() {
        let loud = |shape| match shape {
            Shape::Spline(_) => vec![1.0, 1.0, -1.0, -1.0, 1.0, 0.3, 1.0, 1.0],
            // All harmonics peak in the middle.
            Shape::Fourier(n) => [[-1.0, 0.0], [1.0, 0.0]].concat().repeat(n)[..2 * n].to_vec(),
        };
        for shape in [Shape::Spline(8), Shape::Fourier(3), Shape::Fourier(5)] {
            let sharpest = |frames: usize| {
                let wide = Family {
                    range: vec![None; 2],
                    frames,
                    rest: 0,
                    ..family(shape)
                };
                let commands = wide.commands(&loud(shape), 1.0);
                let curve: Vec<f64> = commands.iter().step_by(2).map(|x| x - 0.5).collect();
                let peak = curve.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
                assert!((peak - 1.0).abs() < 1e-12, "{shape:?}: {peak}");
                let second = curve.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs());
                second.fold(0.0, f64::max)
            };
            let ratio = sharpest(400) / sharpest(800);
            assert!((3.5..4.5).contains(&ratio), "{shape:?}: {ratio}");
        }
    }
}
