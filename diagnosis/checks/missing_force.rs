//! What force the model lacks, and what short replays leave unexplained, without and with the
//! verdict's effects.

use super::check;
use crate::forces::{Missing, Short};
use crate::result::{CheckResult, MissingForce};

/// Describes what short replays leave unexplained, and what forces the model lacks at its joints
/// over them, without and with the verdict's effects.
#[must_use]
pub fn windows(before: &Short, after: &Short, seconds: f64) -> Vec<CheckResult> {
    const PLACES: [&str; 2] = [" in free motion", " in contact"];
    let touch = before.gaps.iter().all(Option::is_some);
    let place = |touching: bool| {
        if touch {
            PLACES[usize::from(touching)]
        } else {
            ""
        }
    };
    let gap = |touching: bool| {
        let [a, b] = [before, after].map(|s| s.gaps[usize::from(touching)]);
        let (a, b) = (a?, b?);
        let place = place(touching);
        Some(format!(
            "{a:.1} of the noise{place} ({b:.1} with the best explanation)"
        ))
    };
    let gaps: Vec<String> = [false, true].into_iter().filter_map(gap).collect();
    let replays = format!(
        "the median replay of a window of {seconds:.2} s, each from a start of its own, leaves {}",
        gaps.join(" and ")
    );
    let mut all = vec![check("windows", true, replays)];
    let joint = |(a, b): (&Missing, &Missing)| {
        let [mean, error] = a.against;
        // Two significant digits of the error.
        let digits = (1.0 - error.abs().max(1e-9).log10().floor()).clamp(3.0, 9.0) as usize;
        format!(
            "{}{} {:.3} {} ({mean:.digits$} ± {error:.digits$} against the motion), of which {:.3} are left with the best explanation",
            a.joint,
            place(a.touching),
            a.force,
            a.unit,
            b.force
        )
    };
    let joints: Vec<String> = before.joints.iter().zip(&after.joints).map(joint).collect();
    if !joints.is_empty() {
        let forces = format!(
            "over these windows the model lacks a force, root mean square, of {}",
            joints.join("; of ")
        );
        all.push(check("forces", true, forces));
    }
    all
}

/// Describes what force the model lacks at each degree of freedom, without and with the verdict's
/// effects; `None` where it was not estimated.
#[must_use]
pub fn missing_force(missing: &[MissingForce]) -> Option<CheckResult> {
    let one = |m: &MissingForce| {
        format!(
            "{} {:.3} {} ({:.3} with the best explanation)",
            m.dof, m.identified, m.unit, m.refined
        )
    };
    let all: Vec<String> = missing.iter().map(one).collect();
    (!all.is_empty()).then(|| {
        let detail = format!(
            "the model lacks a force, standard deviation, of {}",
            all.join("; of ")
        );
        check("forces", true, detail)
    })
}
