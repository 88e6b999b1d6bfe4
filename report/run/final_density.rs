//! The final posterior of a parameter, drawn over its prior.

mod binary;

use super::head::{covered, interval, precision};
use super::posterior::spacing;
use super::trace::{ParameterReport, Prior};
use crate::number::{decimals, quantity};
use crate::page::Figure;
use crate::plot::{Axis, Chart, Colour, Layer, Weighted, grid};

/// Share of the prior's range below which the density is drawn in close-up.
const CLOSE_UP: f64 = 0.5;

/// The density of one parameter, with prior, interval, estimate and truth; `None` if nothing is
/// known of it.
pub(super) fn figure(p: &ParameterReport) -> Option<Figure> {
    let title = format!("Posterior of {}", p.name);
    if let Some(Prior::Binary { probability }) = p.prior {
        return Some(Figure::new(
            title,
            binary::bars(p, probability)?,
            "Probability of the values 0 and 1: prior and posterior.",
        ));
    }
    // Everything below uses the axis' own scale: `u` is the logarithm for a parameter drawn on a
    // log axis.
    let axis = Scaled::of(p);
    let (domain, values) = curve(p, axis)?;
    let points: Vec<[f64; 2]> = values.iter().map(|q| [axis.back(q[0]), q[1]]).collect();

    let x_axis = Axis::new(&p.name, &p.unit)
        .domain(domain.map(|u| axis.back(u)))
        .spacing(spacing(p));
    let mut chart = Chart::new(&title, x_axis, Axis::new("density", "").zero().bare());
    let [low, high] = p.interval95;
    if low.is_finite() && high.is_finite() {
        let inside = points
            .iter()
            .copied()
            .filter(|q| (low..=high).contains(&q[0]))
            .collect();
        chart = chart.layer(
            Layer::area(inside)
                .colour(Colour::Blue)
                .opacity(0.22)
                .label("95 % interval"),
        );
    }
    if let Some(prior) = &p.prior {
        let prior_points = grid(domain, 240)
            .map(|u| {
                [
                    axis.back(u),
                    axis.stretch(u) * prior_density(prior, axis.back(u)),
                ]
            })
            .collect();
        chart = chart.layer(
            Layer::line(prior_points)
                .colour(Colour::Muted)
                .dashed()
                .label("prior"),
        );
    }
    chart = chart.layer(Layer::line(points).colour(Colour::Blue).label("posterior"));
    if p.estimate.is_finite() {
        chart = chart.layer(
            Layer::vertical(p.estimate)
                .colour(Colour::Blue)
                .label(format!("estimate {}", precision(p).show(p.estimate))),
        );
    }
    if let Some(truth) = p.truth {
        chart = chart.layer(
            Layer::vertical(truth)
                .colour(Colour::Ink)
                .dashed()
                .label(format!("truth {}", precision(p).show(truth))),
        );
    }
    let range = range(p).map(|r| r.map(|x| axis.from(x)));
    let caption = caption(p, domain, range);
    Some(Figure::new(
        title,
        chart.description(caption.clone()),
        caption,
    ))
}

/// The domain of the density, and points of it, both on the axis' scale.
fn curve(p: &ParameterReport, axis: Scaled) -> Option<([f64; 2], Vec<[f64; 2]>)> {
    let bounds = bounds(p).map(|r| r.map(|x| axis.from(x)));
    let samples: Vec<f64> = p.samples.iter().map(|&x| axis.from(x)).collect();
    let weighted = Weighted::new(&samples, &p.weights);
    let domain = domain(p, axis, weighted.as_ref(), bounds)?;
    let points = match &weighted {
        Some(weighted) => weighted
            .density(bounds.unwrap_or([0.0, 0.0]))
            .points(domain, 240),
        None => grid(domain, 240)
            .map(|u| [u, gaussian(u, axis.from(p.estimate), axis.std(p))])
            .collect(),
    };
    Some((domain, points))
}

/// The scale of a parameter's axis.
#[derive(Clone, Copy, Debug)]
struct Scaled {
    log: bool,
}

impl Scaled {
    fn of(p: &ParameterReport) -> Self {
        let positive = |x: f64| x > 0.0;
        Self {
            log: p.log_scale && positive(p.estimate) && bounds(p).is_none_or(|r| positive(r[0])),
        }
    }

    /// Converts from the parameter to the axis; NaN for a value that the axis cannot represent.
    fn from(self, x: f64) -> f64 {
        if self.log { x.ln() } else { x }
    }

    fn back(self, u: f64) -> f64 {
        if self.log { u.exp() } else { u }
    }

    /// `dx / du`: the factor that converts a density.
    fn stretch(self, u: f64) -> f64 {
        if self.log { u.exp() } else { 1.0 }
    }

    /// The posterior standard deviation on the axis, to first order.
    fn std(self, p: &ParameterReport) -> f64 {
        if self.log { p.std / p.estimate } else { p.std }
    }
}

/// The caption; `domain` and `range` are on the axis' scale.
fn caption(p: &ParameterReport, domain: [f64; 2], range: Option<[f64; 2]>) -> String {
    let mut text = match interval(p) {
        Some(interval) => format!("95 % interval {}", quantity(&interval, &p.unit)),
        None => "The final posterior".to_owned(),
    };
    match covered(p) {
        Some(true) => text.push_str(", which holds the truth"),
        Some(false) => text.push_str(", which misses the truth"),
        None => {}
    }
    let times = range.map_or(1.0, |r| (r[1] - r[0]) / (domain[1] - domain[0]));
    if times > 1.01 {
        text.push_str(&format!(
            "; a close-up, the prior's range is {} times as wide",
            decimals(times, usize::from(times < 10.0))
        ));
    }
    text.push('.');
    text
}

/// The range of the prior.
fn range(p: &ParameterReport) -> Option<[f64; 2]> {
    let range = match p.prior? {
        Prior::Uniform { low, high }
        | Prior::LogUniform { low, high }
        | Prior::Normal { low, high, .. } => [low, high],
        Prior::Binary { .. } => [0.0, 1.0],
    };
    (range[0].is_finite() && range[1].is_finite() && range[0] < range[1]).then_some(range)
}

/// The range that was searched: that of the prior, and what lies past it where the search went on.
fn bounds(p: &ParameterReport) -> Option<[f64; 2]> {
    let [low, high] = range(p)?;
    let [from, to] = p.searched.unwrap_or([low, high]);
    Some([low.min(from), high.max(to)])
}

/// The domain of the density: the range that was searched, or a close-up where the posterior fills
/// little of it.
fn domain(
    p: &ParameterReport,
    axis: Scaled,
    weighted: Option<&Weighted>,
    range: Option<[f64; 2]>,
) -> Option<[f64; 2]> {
    let (center, std) = match weighted {
        Some(weighted) => (weighted.mean(), weighted.std()),
        None => (axis.from(p.estimate), axis.std(p)),
    };
    if !center.is_finite() || !std.is_finite() {
        return None;
    }
    let least = range.map_or(1e-3 * center.abs().max(1e-6), |r| 1e-3 * (r[1] - r[0]));
    let reach = (4.5 * std).max(least);
    let mut close = [center - reach, center + reach];
    let marks = p
        .truth
        .into_iter()
        .chain(p.interval95)
        .map(|x| axis.from(x))
        .filter(|u| u.is_finite());
    let mut held = range.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    for u in marks {
        close = [
            close[0].min(u - 0.15 * reach),
            close[1].max(u + 0.15 * reach),
        ];
        // Keep a truth outside the range in view.
        held = [held[0].min(u), held[1].max(u)];
    }
    match range {
        Some(range) if close[1] - close[0] > CLOSE_UP * (range[1] - range[0]) => Some(held),
        _ => Some([close[0].max(held[0]), close[1].min(held[1])]),
    }
}

fn prior_density(prior: &Prior, x: f64) -> f64 {
    match *prior {
        Prior::Uniform { low, high } if (low..=high).contains(&x) => 1.0 / (high - low),
        Prior::LogUniform { low, high } if low > 0.0 && (low..=high).contains(&x) => {
            1.0 / (x * (high / low).ln())
        }
        // The truncated density is not renormalised: the line is a guide, not a measure.
        Prior::Normal {
            mean,
            std,
            low,
            high,
        } if (low..=high).contains(&x) => gaussian(x, mean, std),
        _ => 0.0,
    }
}

fn gaussian(x: f64, mean: f64, std: f64) -> f64 {
    (-0.5 * ((x - mean) / std).powi(2)).exp() / (std * (2.0 * std::f64::consts::PI).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_close_up_is_taken_only_of_a_narrow_posterior_and_holds_the_truth() {
        let mut p = ParameterReport {
            estimate: 0.06,
            std: 0.002,
            truth: Some(0.075),
            prior: Some(Prior::Uniform {
                low: -0.1,
                high: 0.1,
            }),
            ..ParameterReport::default()
        };
        let close = domain(&p, Scaled::of(&p), None, range(&p)).unwrap();
        assert!(
            close[0] > 0.04 && close[1] > 0.075 && close[1] < 0.1,
            "{close:?}"
        );
        p.std = 0.05;
        assert_eq!(
            domain(&p, Scaled::of(&p), None, range(&p)).unwrap(),
            [-0.1, 0.1]
        );
        p.std = f64::NAN;
        assert!(domain(&p, Scaled::of(&p), None, range(&p)).is_none());
    }

    /// Symptom: a flat posterior, or one mirrored into the prior's range, of an unknown that was
    /// found past that range.
    ///
    /// Cause: the density ended at the prior's range, and what lay beyond was reflected inside.
    #[test]
    fn a_posterior_past_the_prior_is_drawn_where_it_was_found() {
        // Quantiles of a normal distribution of mean 1.1 and standard deviation 0.15, as the
        // inverse of the logistic curve that follows it within 0.01 (Bowling et al. 2009).
        let samples = (0..1000).map(|k| (f64::from(k) + 0.5) / 1000.0);
        let p = ParameterReport {
            estimate: 1.1,
            std: 0.15,
            prior: Some(Prior::Uniform {
                low: 0.0,
                high: 1.0,
            }),
            searched: Some([0.0, 2.0]),
            samples: samples
                .map(|u| 1.1 + 0.15 * (u / (1.0 - u)).ln() / 1.702)
                .collect(),
            ..ParameterReport::default()
        };
        let (_, points) = curve(&p, Scaled::of(&p)).unwrap();
        let step = points[1][0] - points[0][0];
        let mass: f64 = points.iter().map(|q| step * q[1]).sum();
        assert!((mass - 1.0).abs() < 0.01, "{mass}");
        let peak = points.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        assert!((peak[0] - 1.1).abs() < 0.02, "{peak:?}");
        // It is symmetric about its mean, although the prior ends at 1.
        let at = |x: f64| points[((x - points[0][0]) / step).round() as usize][1];
        assert!((at(0.9) / at(1.3) - 1.0).abs() < 0.05);
    }

    #[test]
    fn priors_have_mass_one() {
        for prior in [
            Prior::Uniform {
                low: -0.1,
                high: 0.3,
            },
            Prior::LogUniform {
                low: 0.01,
                high: 0.3,
            },
        ] {
            let points: Vec<f64> = grid([-0.2, 0.4], 60_001)
                .map(|x| prior_density(&prior, x))
                .collect();
            let mass: f64 = points.iter().sum::<f64>() * 0.6 / 60_000.0;
            // The jumps at the ends cost up to half a grid step's mass each.
            assert!((mass - 1.0).abs() < 1e-3, "{prior:?}: {mass}");
        }
    }
}
