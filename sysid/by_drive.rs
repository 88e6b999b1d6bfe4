//! A start of the search that moves one drive after the other.
//!
//! Where all drives move at once at one scale, the first that breaks a limit keeps all of them
//! small. A joint that dry friction holds then never slips: its unknowns have no slope, and a
//! search has nothing to follow. It slips where its command goes far, and keeps a limit of force or
//! speed if the command is slow.
//!
//! Each drive in its turn therefore tries curves of its own, on top of the motion of the drives
//! before it. They are slow and fast, large and small, and slow ones to either side, since a joint
//! may begin near one end of its range. The curve with the smallest objective that keeps the limits
//! stays; where none is better, the drive rests. The largest curve that keeps the limits defines
//! how far the search may move this drive (its reach).

use asid_core::error::Result;
use asid_core::rng::Rng;

use crate::design::Designer;
use crate::method::DesignSettings;
use crate::motion::{Family, Shape};
use crate::places::Places;

/// Numbers of spline heights of a drive's slow curves: one swing there and back, and two of them.
///
/// They are tried beside a curve with the search's own number. A slow curve goes farthest before a
/// speed limit binds.
const SLOW: [usize; 2] = [2, 4];

/// Ratio of neighbouring scales of a drive's curve; the largest that keeps limits is known to this.
const RATIO: f64 = 0.6;

/// Number of scales of a drive's curve: from one down to a thirty-fifth.
const SIZES: i32 = 8;

/// Most curves of a drive that are checked at all points.
const LOOKS: usize = 6;

/// Where a search begins.
pub(crate) struct Start {
    /// Coefficients.
    pub coefficients: Vec<f64>,
    /// Their cost.
    pub cost: f64,
    /// Reach of each coefficient: the largest scale, of 1, at which its drive's curve kept the
    /// limits.
    pub reach: Vec<f64>,
}

impl Designer<'_, '_> {
    /// Moves one drive after the other, starting with all at rest.
    ///
    /// # Errors
    /// When the engine fails.
    pub(crate) fn by_drive(
        &mut self,
        settings: &DesignSettings,
        places: &mut Places<'_>,
        rng: &mut Rng,
    ) -> Result<Start> {
        let (n, each) = (self.family.len(), self.family.each());
        let mut coefficients = vec![0.0; n];
        let mut cost = self
            .candidates(&places.far)
            .costs(std::slice::from_ref(&coefficients), 1)?[0];
        let mut reach = vec![0.0; n];
        for drive in 0..n / each {
            let own = drive * each..(drive + 1) * each;
            let (mut trials, mut sizes) = (Vec::new(), Vec::new());
            let mut curves = Vec::new();
            for knots in SLOW {
                let curve = self.curve(knots, rng);
                curves.push(curve.iter().map(|c| -c).collect());
                curves.push(curve);
            }
            curves.push(self.curve(settings.knots, rng));
            for curve in &curves {
                for k in 0..SIZES {
                    let size = RATIO.powi(k);
                    let mut trial = coefficients.clone();
                    for (to, c) in trial[own.clone()].iter_mut().zip(curve) {
                        *to = size * c;
                    }
                    trials.push(trial);
                    sizes.push(size);
                }
            }
            let mut costs = self.candidates(&places.far).costs(&trials, 1)?;
            let found = self.best(&trials, &mut costs, (LOOKS, cost), places)?;
            // Curves that keep the limits, informative or not.
            let kept = sizes
                .iter()
                .zip(&costs)
                .filter(|(_, c)| !crate::candidates::breaks(**c));
            let largest = kept.fold(RATIO.powi(SIZES), |most, (size, _)| most.max(*size));
            reach[own].fill(largest);
            if let Some(k) = found {
                (coefficients, cost) = (trials.swap_remove(k), costs[k]);
            }
        }
        Ok(Start {
            coefficients,
            cost,
            reach,
        })
    }

    /// A drive's random curve of `knots` heights, as heights of the search's spline.
    ///
    /// The largest has magnitude 1.
    fn curve(&self, knots: usize, rng: &mut Rng) -> Vec<f64> {
        let one = Family {
            base: vec![0.0],
            amplitude: vec![1.0],
            range: vec![None],
            ..self.family.clone()
        };
        let drawn = Family {
            shape: Shape::Spline(knots),
            ..one.clone()
        };
        let heights = drawn.random(rng);
        let heights = if knots == one.each() {
            heights
        } else {
            one.near(&drawn, &heights)
        };
        let most = heights
            .iter()
            .fold(f64::MIN_POSITIVE, |m: f64, c| m.max(c.abs()));
        heights.iter().map(|c| c / most).collect()
    }
}
