//! What is known of the unknowns before and after a motion.

use asid_core::Parameter;
use asid_sysid::design::Designed;
use asid_sysid::tells::Told;
use serde::Serialize;

/// Largest number of repeats that is counted; above it another motion is the better choice.
const MOST_REPEATS: usize = 1000;

/// Contact limits a motion when the expected deviation exceeds the one from slopes alone by this
/// ratio.
const LIMITED: f64 = 2.0;

/// What is known of an unknown, in its unit.
#[derive(Clone, Debug, Serialize, schemars::JsonSchema)]
#[schemars(rename = "MotionUnknown")]
pub struct UnknownResult {
    pub name: String,
    pub unit: String,
    /// The value about which the motion was designed.
    pub value: f64,
    /// What shares are taken of: the value, or half the width of the range where it is zero.
    pub reference: f64,
    /// Standard deviations: of the prior, by the logs so far, by this motion, by both.
    pub prior: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub logs: Option<f64>,
    pub motion: f64,
    /// What slopes alone would promise of this motion, where contact limits what it tells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub by_slopes: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub both: Option<f64>,
    /// Plays of the motion until it is known to the precision asked for, with the logs; null where
    /// no number of them suffices.
    pub repeats: Option<usize>,
}

/// Reference of a deviation: the value, or half the width of the range where the value is zero.
fn reference(parameter: &Parameter, value: f64) -> f64 {
    if value == 0.0 {
        let [low, high] = parameter.range;
        (high - low) / 2.0
    } else {
        value.abs()
    }
}

/// What is known of the unknowns, before and after the motion.
pub fn unknown_results(
    unknowns: &[Parameter],
    values: &[f64],
    logs: Option<&Told>,
    found: &Designed,
    precision: f64,
) -> Vec<UnknownResult> {
    let motion = &found.told;
    let nothing = Told::nothing(motion.sought, motion.matrix.nrows());
    let known = logs.unwrap_or(&nothing);
    let alone = motion.deviations();
    let by_slopes = found.by_slopes.deviations();
    let so_far = known.deviations();
    let both = motion.and(1.0, known).deviations();
    unknowns
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let unit = |scaled: f64| p.unscale_std(values[i], scaled);
            let wanted = precision * reference(p, values[i]);
            let enough = |n: usize| unit(motion.and(n as f64, known).deviations()[i]) <= wanted;
            // Information only grows with repeats, so bisection finds the fewest.
            let repeats = (wanted > 0.0 && enough(MOST_REPEATS)).then(|| {
                let (mut low, mut high) = (0, MOST_REPEATS);
                while low < high {
                    let middle = usize::midpoint(low, high);
                    if enough(middle) {
                        high = middle
                    } else {
                        low = middle + 1
                    }
                }
                low
            });
            UnknownResult {
                name: p.name.clone(),
                unit: p.unit.clone(),
                value: values[i],
                reference: reference(p, values[i]),
                prior: unit(1.0),
                logs: logs.map(|_| unit(so_far[i])),
                motion: unit(alone[i]),
                by_slopes: (alone[i] > LIMITED * by_slopes[i]).then(|| unit(by_slopes[i])),
                both: logs.map(|_| unit(both[i])),
                repeats,
            }
        })
        .collect()
}
