//! The missing force that remains with the accepted effects: how much of it could be learned, and
//! from what.

use crate::ceiling::{Course, Left, Variable, learn};
use crate::trace::ForceSeries;

use super::context::Context;
use super::picture::{dofs, most_missing_of, series};
use super::search::Outcome;

/// Most rows of a degree of freedom to learn from: some thousand show a law, and neighbouring rows
/// say the same.
const ROWS: usize = 6000;

/// Time derivative of a series, one value a row, from the rows before and after.
fn rate(values: &[f64], time: &[f64]) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    (0..values.len())
        .map(|k| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(last));
            (values[b] - values[a]) / (time[b] - time[a])
        })
        .collect()
}

/// A stretch of a degree of freedom as a course: its remaining force with the variables that may
/// explain it.
fn course(force: ForceSeries) -> Course {
    let mut variables = Vec::new();
    let mut add = |name: &str, kinds: &'static [&'static str], values: Vec<f64>| {
        variables.push(Variable {
            name: name.to_owned(),
            kinds,
            values,
        });
    };
    let (time, speed, load) = (&force.time, &force.speed, &force.load);
    add("speed", &["friction-like", "drag-like"], speed.clone());
    if !force.position.is_empty() {
        add(
            "position",
            &["stiffness-like", "gravity-like"],
            force.position.clone(),
        );
    }
    add("acceleration", &["inertia-like"], rate(speed, time));
    if !load.is_empty() {
        let along = load.iter().zip(speed).map(|(l, v)| l.abs() * v.signum());
        add("load", &["load-like", "gain-like"], load.clone());
        add(
            "load against the motion",
            &["load-friction-like"],
            along.collect(),
        );
        add(
            "rate of the load",
            &["delay-like", "lag-like"],
            rate(load, time),
        );
    }
    add("time", &["drift-like"], time.clone());
    Course {
        left: force.after,
        variables,
    }
}

/// The remaining force at the degrees of freedom that lack the most, and how much a flexible model
/// predicts.
pub(super) fn left(context: &Context<'_>, outcome: &Outcome) -> Vec<Left> {
    let estimate = &outcome.best.fitted.estimate;
    let smoothed: Vec<usize> = (0..context.walks.len())
        .filter(|&w| context.walks[w].segment.is_none())
        .collect();
    if smoothed.is_empty() {
        return Vec::new();
    }
    let dofs = dofs(&context.plant().layout);
    let rows: usize = smoothed.iter().map(|&w| context.walks[w].len() - 1).sum();
    let stride = rows.div_ceil(ROWS).max(1);
    let of_dof = |d: usize| {
        let courses: Vec<Course> = (smoothed.iter())
            .map(|&w| {
                let rows = (0..context.walks[w].len() - 1).step_by(stride);
                let rows: Vec<(usize, usize)> = rows.map(|k| (w, k)).collect();
                course(series(context, outcome, &[], (&dofs[d], d), &rows))
            })
            .collect();
        Left {
            place: dofs[d].name.clone(),
            weight: estimate.missing_power(context, d),
            foretold: learn(&courses),
        }
    };
    most_missing_of(context, estimate)
        .into_iter()
        .map(of_dof)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_a_central_difference_and_one_sided_at_the_ends() {
        let found = rate(&[0.0, 1.0, 4.0, 9.0], &[0.0, 1.0, 2.0, 3.0]);
        assert_eq!(found, [1.0, 2.0, 4.0, 5.0]);
    }

    #[test]
    fn a_late_drive_goes_with_the_rate_of_its_load() {
        let time: Vec<f64> = (0..600).map(|k| 0.01 * f64::from(k)).collect();
        let of = |f: &dyn Fn(f64) -> f64| -> Vec<f64> { time.iter().map(|t| f(*t)).collect() };
        let load = |t: f64| (9.0 * t).sin() + 0.5 * (4.1 * t).cos();
        let found = learn(&[course(ForceSeries {
            position: of(&|t| (2.3 * t).sin()),
            speed: of(&|t| (3.7 * t).cos()),
            load: of(&load),
            after: of(&|t| load(t - 0.01) - load(t)),
            time: time.clone(),
            ..ForceSeries::default()
        })]);
        assert_eq!(found.variable.as_deref(), Some("rate of the load"));
        assert!(found.share > 0.9, "{found:?}");
    }
}
