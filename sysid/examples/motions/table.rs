//! The tables of the comparison.

use std::fmt::Write as _;

use asid_comparison::statistics::{bootstrap, interquartile_mean, mean};

use crate::motion::Motion;
use crate::world::World;

/// One method on one machine.
pub struct Row {
    /// Name of the machine.
    pub machine: String,
    /// Name of the method.
    pub method: String,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Motions: one, or one a seed where the method draws.
    pub motions: Vec<Motion>,
    /// True machines, one a seed.
    pub worlds: Vec<World>,
}

impl Row {
    /// Expected figure, the mean over its motions.
    fn expected(&self) -> f64 {
        let figures: Vec<f64> = self.motions.iter().map(Motion::figure).collect();
        mean(&figures)
    }

    /// Errors, one a seed.
    fn errors(&self) -> Vec<f64> {
        self.worlds.iter().map(World::figure).collect()
    }
}

/// A figure of three digits.
fn three(x: f64) -> String {
    let digits = 2 - x.abs().max(f64::MIN_POSITIVE).log10().floor() as i32;
    format!("{x:.*}", digits.clamp(0, 7) as usize)
}

/// Table of Markdown. Errors are interquartile means over the true machines with bootstrap intervals of 95 %; ratios are geometric
/// means over the same true machines.
pub fn markdown(rows: &[Row]) -> String {
    let mut text = String::from(
        "\n| machine | motion by | expected | actual | fisher-cem's actual over it | design, s | processor, s | limits broken |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for row in rows {
        let errors = row.errors();
        let [low, high] = bootstrap(std::slice::from_ref(&errors), interquartile_mean);
        let best = rows.iter().find(|r| r.machine == row.machine);
        let ratio = best.filter(|b| b.method != row.method).map(|best| {
            let pairs = best.errors().into_iter().zip(&errors);
            let logs: Vec<f64> = pairs.map(|(a, b)| (a / b).ln()).collect();
            let [low, high] = bootstrap(std::slice::from_ref(&logs), mean);
            format!(
                "{} ({} to {})",
                three(mean(&logs).exp()),
                three(low.exp()),
                three(high.exp())
            )
        });
        let times = |of: fn(&Motion) -> f64| mean(&row.motions.iter().map(of).collect::<Vec<_>>());
        let broken = row.worlds.iter().filter(|w| w.broken.is_some()).count();
        let _ = writeln!(
            text,
            "| {} ({} unknowns) | {} | {} | {} ({} to {}) | {} | {:.1} | {:.1} | {broken} of {} |",
            row.machine,
            row.unknowns,
            row.method,
            three(row.expected()),
            three(interquartile_mean(&errors)),
            three(low),
            three(high),
            ratio.unwrap_or_default(),
            times(|m| m.wall_s),
            times(|m| m.cpu_s),
            row.worlds.len()
        );
    }
    text
}
