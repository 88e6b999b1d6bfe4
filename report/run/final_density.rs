//! The final posterior of a parameter, drawn over its prior.

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
            binary(p, probability)?,
            "Probability of the values 0 and 1: prior and posterior.",
        ));
    }
    // Everything below uses the axis' own scale: `u` is the logarithm for a parameter drawn on a
    // log axis.
    let axis = Scaled::of(p);
    let range = range(p).map(|r| r.map(|x| axis.from(x)));
    let samples: Vec<f64> = p.samples.iter().map(|&x| axis.from(x)).collect();
    let weighted = Weighted::new(&samples, &p.weights);
    let domain = domain(p, axis, weighted.as_ref(), range)?;
    let values: Vec<[f64; 2]> = match &weighted {
        Some(weighted) => weighted
            .density(range.unwrap_or([0.0, 0.0]))
            .points(domain, 240),
        None => grid(domain, 240)
            .map(|u| [u, gaussian(u, axis.from(p.estimate), axis.std(p))])
            .collect(),
    };
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
    let caption = caption(p, domain, range);
    Some(Figure::new(
        title,
        chart.description(caption.clone()),
        caption,
    ))
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
            log: p.log_scale && positive(p.estimate) && range(p).is_none_or(|r| positive(r[0])),
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

/// The domain of the density: the prior's range, or a close-up where the posterior fills little of
/// it.
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
        // Keep a truth outside the prior's range in view.
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

/// Two pairs of bars for a binary parameter.
fn binary(p: &ParameterReport, prior: f64) -> Option<Chart> {
    let after = match Weighted::new(&p.samples, &p.weights) {
        Some(weighted) => weighted.mean(),
        None => p.estimate,
    };
    if !after.is_finite() {
        return None;
    }
    let pair = |one: f64, x: f64| vec![[x, x + 0.3, 1.0 - one], [1.0 + x, 1.3 + x, one]];
    let x_axis = Axis::new(&p.name, "")
        .domain([-0.5, 1.5])
        .marks(vec![(0.0, "0".to_owned()), (1.0, "1".to_owned())]);
    let mut chart = Chart::new(
        &format!("Posterior of {}", p.name),
        x_axis,
        Axis::new("probability", "").domain([0.0, 1.0]),
    )
    .description(format!(
        "Probability of 1: {} before, {} after.",
        decimals(prior, 2),
        decimals(after, 2)
    ))
    .layer(
        Layer::bars(pair(prior, -0.3))
            .colour(Colour::Muted)
            .opacity(0.35)
            .label("prior"),
    )
    .layer(
        Layer::bars(pair(after, 0.0))
            .colour(Colour::Blue)
            .label("posterior"),
    );
    if let Some(truth) = p.truth {
        chart = chart.layer(
            Layer::vertical(truth)
                .colour(Colour::Ink)
                .dashed()
                .label("truth"),
        );
    }
    Some(chart)
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
