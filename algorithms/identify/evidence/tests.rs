use super::*;
use crate::identify::emulator::Emulator;
use crate::optimise::Gaussian;
use asid_core::Streams;
use rand::Rng as _;
use rand_distr::{Distribution, StandardNormal};

/// Readings, in pieces of [`RUN`] that the roughness moves together.
const READINGS: usize = 200;
const RUN: usize = 5;
/// Deviation of the roughness, in units of the noise.
const ROUGH: f64 = 2.0;
/// Readings of the two models differ by this much.
const APART: f64 = 0.8;
/// Comparisons of which probabilities are compared with frequencies.
const CASES: u64 = 300;

/// Roughness that moves the readings of a piece together.
fn luck(normal: &mut impl FnMut() -> f64) -> Vec<f64> {
    let pieces: Vec<f64> = (0..READINGS / RUN).map(|_| ROUGH * normal()).collect();
    (0..READINGS).map(|k| pieces[k / RUN]).collect()
}

/// What two models leave of an episode of one of them, and which one it is.
///
/// Both have an unknown of slope 1 that moves even readings up and odd ones down, and all readings
/// of model 1 are higher by [`APART`].
fn compared(seed: u64) -> ([Evidence; 2], usize) {
    let mut rng = Streams::new(seed).stream("luck");
    let truth = usize::from(rng.random::<f64>() < 0.5);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let side = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
    let real = luck(&mut normal);
    let observed: Vec<f64> = real
        .iter()
        .map(|luck| luck + truth as f64 * APART + normal())
        .collect();
    let region = Gaussian::diagonal(&[0.0], &[1.0], &[-9.0], &[9.0]);
    let mut draws = Streams::new(seed).stream("draws");
    let models = [0.0, APART].map(|shift| {
        let points: Vec<Vec<f64>> = (0..64).map(|_| region.sample(&mut draws)).collect();
        let residual = |x: &Vec<f64>| -> Vec<f64> {
            let both = luck(&mut normal).into_iter().zip(&observed);
            both.enumerate()
                .map(|(k, (luck, seen))| x[0] * side(k) + shift + luck - seen)
                .collect()
        };
        let residuals: Vec<Vec<f64>> = points.iter().map(residual).collect();
        let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let rows: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
        let emulator = Emulator::fit(&region, &points, &rows, READINGS, false).unwrap();
        emulator.evidence(READINGS, 0.0)
    });
    (models, truth)
}

/// Deviations of a binomial by which right answers are fewer than the probabilities say, of cases
/// whose probability is `from` to `to`.
fn excess(cases: &[(f64, bool)], from: f64, to: f64) -> f64 {
    let within = || cases.iter().filter(|(p, _)| (from..to).contains(p));
    let expected: f64 = within().map(|(p, _)| p).sum();
    let variance: f64 = within().map(|(p, _)| p * (1.0 - p)).sum();
    let right = within().filter(|(_, right)| *right).count();
    (expected - right as f64) / variance.max(0.25).sqrt()
}

/// The probability of the preferred model by nats of model 1 over model 0, and whether it is right.
fn stated(nats: f64, truth: usize) -> (f64, bool) {
    let preferred = usize::from(nats > 0.0);
    (1.0 / (1.0 + (-nats.abs()).exp()), preferred == truth)
}

/// Symptom: of answers with a probability of 99 %, one in five was wrong. Cause: squared residuals
/// counted as independent, although a contact that comes early moves all readings after it.
#[test]
fn probabilities_of_models_are_frequencies_where_roughness_is_correlated() {
    let cases: Vec<([Evidence; 2], usize)> = (0..CASES).map(compared).collect();
    for correlated in [false, true] {
        let adjusted: Vec<(f64, bool)> = cases
            .iter()
            .map(|([zero, one], truth)| {
                let behind = behind(&[zero, one], correlated);
                stated(behind[0] - behind[1], *truth)
            })
            .collect();
        for (from, to) in [(0.5, 0.75), (0.75, 0.95), (0.95, 1.1)] {
            let off = excess(&adjusted, from, to);
            assert!(off.abs() < 3.0, "{correlated}, {from} to {to}: {off}");
        }
        // The episodes tell the models apart.
        let right = adjusted.iter().filter(|(_, right)| *right).count();
        assert!(right as u64 > CASES * 3 / 4, "{right}");
    }
    // With independent readings that have the variance of noise and roughness.
    let independent: Vec<(f64, bool)> = cases
        .iter()
        .map(|([zero, one], truth)| {
            let loss = |model: &Evidence| 0.5 * model.row().norm_squared() / (1.0 + ROUGH.powi(2));
            stated(loss(zero) - loss(one), *truth)
        })
        .collect();
    let off = excess(&independent, 0.95, 1.1);
    assert!(off > 10.0, "{off}");
}

/// Models that predict the same are equally probable, whatever their simulations scatter.
#[test]
fn equal_models_stay_undecided() {
    let mut rng = Streams::new(0).stream("equal");
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let (rows, share) = (64, 0.05_f64);
    for _ in 0..20 {
        let real = luck(&mut normal);
        let model = |normal: &mut dyn FnMut() -> f64| {
            let mut normal = || normal();
            let residual = luck(&mut normal).into_iter().zip(&real);
            let simulated: Vec<f64> = (0..rows).flat_map(|_| luck(&mut normal)).collect();
            let simulated = DMatrix::from_row_slice(rows, READINGS, &simulated);
            Evidence {
                residual: residual
                    .map(|(luck, real)| luck * share.sqrt() - real)
                    .collect(),
                present: READINGS,
                roughness: Roughness::new(simulated, rows as f64),
                scatter: share,
                narrowing: 0.0,
            }
        };
        let [zero, one] = [0, 1].map(|_| model(&mut normal));
        let behind = behind(&[&zero, &one], false);
        assert!((behind[0] - behind[1]).abs() < 2.0, "{behind:?}");
    }
}

#[test]
fn without_roughness_it_is_the_difference_of_half_squares() {
    let left = |residual: [f64; 3]| Evidence {
        residual: residual.to_vec(),
        present: 3,
        roughness: Roughness::none(3),
        scatter: 0.0,
        narrowing: 0.0,
    };
    let [zero, one] = [left([1.0, -1.0, 0.5]), left([1.0, 1.0, -2.0])];
    for correlated in [false, true] {
        let behind = behind(&[&zero, &one], correlated);
        assert!(
            behind[0].abs() < 1e-12 && (behind[1] - 1.875).abs() < 1e-12,
            "{behind:?}"
        );
    }
}
