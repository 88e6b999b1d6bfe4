//! The tables of the comparison.

use std::fmt::Write as _;

use asid_statistics::{bootstrap, interquartile_mean, mean};

use crate::motion::Motion;
use crate::world::World;

/// Results of one method on one machine.
pub struct Row {
    /// Name of the machine.
    pub machine: String,
    /// Name of the method.
    pub method: String,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Motions: one, or one for each seed of a random method.
    pub motions: Vec<Motion>,
    /// True machines, one for each seed.
    pub worlds: Vec<World>,
}

impl Row {
    /// Mean of the expected figures of its motions.
    fn expected(&self) -> f64 {
        let figures: Vec<f64> = self.motions.iter().map(Motion::figure).collect();
        mean(&figures)
    }

    /// Figures of the errors, one for each seed.
    fn errors(&self) -> Vec<f64> {
        self.worlds.iter().map(World::figure).collect()
    }
}

/// A number with three digits.
fn three(x: f64) -> String {
    let digits = 2 - x.abs().max(f64::MIN_POSITIVE).log10().floor() as i32;
    format!("{x:.*}", digits.clamp(0, 7) as usize)
}

/// Geometric mean of ratios, with an interval if there are several.
fn ratio(ratios: &[f64]) -> String {
    let logs: Vec<f64> = ratios.iter().map(|r| r.ln()).collect();
    let middle = three(mean(&logs).exp());
    if logs.len() < 2 {
        return middle;
    }
    let [low, high] = bootstrap(std::slice::from_ref(&logs), mean);
    format!("{middle} ({} to {})", three(low.exp()), three(high.exp()))
}

/// A Markdown table.
///
/// Errors are interquartile means over the true machines with bootstrap intervals of 95 %. Ratios
/// are geometric means over the same true machines; those of expected figures are over the motions.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = String::from(
        "\n| machine | motion by | expected | actual | fisher-cem's expected over it | its actual over it | design, s | processor, s | limits broken |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let errors = row.errors();
        let [low, high] = bootstrap(std::slice::from_ref(&errors), interquartile_mean);
        let best = rows.iter().find(|r| r.machine == row.machine);
        let best = best.filter(|b| b.method != row.method);
        let expected = best.map(|best| {
            let figures = row.motions.iter().map(Motion::figure);
            ratio(&figures.map(|f| best.expected() / f).collect::<Vec<_>>())
        });
        let actual = best.map(|best| {
            let pairs = best.errors().into_iter().zip(&errors);
            ratio(&pairs.map(|(a, b)| a / b).collect::<Vec<_>>())
        });
        let times = |of: fn(&Motion) -> f64| mean(&row.motions.iter().map(of).collect::<Vec<_>>());
        let broken = row.worlds.iter().filter(|w| w.broken.is_some()).count();
        let _ = writeln!(
            text,
            "| {} ({} unknowns) | {} | {} | {} ({} to {}) | {} | {} | {:.1} | {:.1} | {broken} of {} |",
            row.machine,
            row.unknowns,
            row.method,
            three(row.expected()),
            three(interquartile_mean(&errors)),
            three(low),
            three(high),
            expected.unwrap_or_default(),
            actual.unwrap_or_default(),
            times(|m| m.wall_s),
            times(|m| m.cpu_s),
            row.worlds.len()
        );
    }
    text
}
