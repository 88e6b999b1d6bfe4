//! Where the gap lies: by signal, by regime of motion, and under which readable condition.
//!
//! Open loop, an error that a force makes in one place persists for the rest of the episode. Shares
//! are of the residual itself, which is what the user sees. Conditions are searched for where the
//! residual *grows*, which is where its cause acts.

mod condition;

use asid_core::layout::JointKind;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use crate::data::Logs;
use crate::result::Where;
use crate::trajectory::{Path, Trajectory};
use condition::{Features, growth};

/// Share of an episode that counts as its start.
const BEGINNING: f64 = 0.03;
/// Share of the largest speed below which a joint stands still or reverses.
const SLOW: f64 = 0.03;
/// Number of rows before and after a reversal over which the speed has changed its sign.
const AROUND: usize = 5;

/// Returns the share of the excess squared residual in each cell of signal and regime that has
/// some, largest first; they sum to 1.
///
/// `residuals` are in units of the noise, without whitening, 0 where missing.
#[must_use]
pub fn localise(plant: &Plant, logs: &Logs, shown: &Trajectory, residuals: &[f64]) -> Vec<Where> {
    let n = logs.entries.len();
    let mut cells: Vec<(usize, String, f64)> = Vec::new();
    for e in 0..logs.episodes.len() {
        let path = &shown.episodes[e];
        let fastest = fastest(path, plant.layout.nv);
        let rows = logs.episodes[e].plan.rows();
        for (j, entry) in logs.entries.iter().enumerate() {
            let name = &logs.sensors[entry.sensor].name;
            for k in 0..rows {
                let r = residuals[logs.offset(e) + k * n + j];
                if !r.is_finite() || r == 0.0 {
                    continue;
                }
                let regime = regime(plant, shown, (path, &fastest), name, k, rows);
                let excess = r * r - 1.0;
                match cells.iter_mut().find(|(i, g, _)| *i == j && *g == regime) {
                    Some(cell) => cell.2 += excess,
                    None => cells.push((j, regime, excess)),
                }
            }
        }
    }
    cells.retain(|c| c.2 > 0.0);
    cells.sort_by(|a, b| b.2.total_cmp(&a.2));
    let total: f64 = cells.iter().map(|c| c.2).sum();
    let features = Features::of(logs);
    let present = logs.present();
    let mut conditions: Vec<Option<Option<String>>> = vec![None; n];
    cells
        .into_iter()
        .map(|(j, regime, excess)| Where {
            signal: logs.entries[j].label.clone(),
            regime,
            share: excess / total,
            condition: conditions[j]
                .get_or_insert_with(|| features.condition(&growth(logs, (residuals, &present), j)))
                .clone(),
        })
        .collect()
}

/// Returns the regime, in a row, of the part of the machine that a sensor reads.
fn regime(
    plant: &Plant,
    shown: &Trajectory,
    (path, fastest): (&Path, &[f64]),
    sensor: &str,
    row: usize,
    rows: usize,
) -> String {
    let layout = &plant.layout;
    if (row as f64) < BEGINNING * rows as f64 {
        return "start".into();
    }
    let place = layout.sensors.iter().position(|s| s.name == sensor);
    match place.map(|p| plant.sensors[p]) {
        Some(Reads::Joint(j))
            if matches!(layout.joints[j].kind, JointKind::Hinge | JointKind::Slide) =>
        {
            joint_regime(plant, (path, fastest), j, row)
        }
        Some(Reads::Body(b)) => body_regime(plant, shown, path, b, row),
        _ => "motion".into(),
    }
}

/// Returns the largest speed of each degree of freedom along a path, `nv`.
fn fastest(path: &Path, nv: usize) -> Vec<f64> {
    let mut fastest = vec![0.0_f64; nv];
    for speeds in path.qvel.chunks_exact(nv.max(1)) {
        for (fastest, v) in fastest.iter_mut().zip(speeds) {
            *fastest = fastest.max(v.abs());
        }
    }
    fastest
}

fn joint_regime(
    plant: &Plant,
    (path, fastest): (&Path, &[f64]),
    joint: usize,
    row: usize,
) -> String {
    let layout = &plant.layout;
    let (nq, nv, nu) = (layout.nq, layout.nv, layout.nu());
    let place = &layout.joints[joint];
    let speeds = || path.qvel.iter().skip(place.qvel).step_by(nv);
    let largest = fastest[place.qvel];
    let speed = path.qvel[row * nv + place.qvel];
    let saturated = plant.drives_of(joint).any(|(i, d)| {
        let u = path.ctrl[row * nu + i];
        let outside = d.ctrl_range.is_some_and(|[a, b]| u <= a || u >= b);
        let q = path.qpos[row * nq + place.qpos];
        let limited = d.force_range.is_some_and(|[a, b]| {
            let force = d.force(u, q, speed) / d.gear;
            force <= a || force >= b
        });
        outside || limited
    });
    if saturated {
        return "saturated".into();
    }
    if speed.abs() > SLOW * largest {
        return "moving".into();
    }
    let before = speeds().nth(row.saturating_sub(AROUND)).copied();
    let after = speeds().nth(row + AROUND).copied();
    match (before, after) {
        (Some(a), Some(b)) if a * b < 0.0 => "reversal".into(),
        _ => "standing".into(),
    }
}

fn body_regime(plant: &Plant, shown: &Trajectory, path: &Path, body: usize, row: usize) -> String {
    let pairs = shown.pairs.len();
    let forces = &path.contact[row * pairs..(row + 1) * pairs];
    let touching = shown
        .pairs
        .iter()
        .zip(forces)
        .filter(|(p, f)| p.contains(&body) && **f > 0.0)
        .max_by(|a, b| a.1.total_cmp(b.1));
    let Some((pair, _)) = touching else {
        return "free".into();
    };
    let other = if pair[0] == body { pair[1] } else { pair[0] };
    // Of several contacts, the one with a moving body is of interest.
    let mover = shown
        .pairs
        .iter()
        .zip(forces)
        .filter(|(p, f)| p.contains(&body) && **f > 0.0)
        .map(|(p, _)| if p[0] == body { p[1] } else { p[0] })
        .find(|&b| plant.moves(b));
    let names = &plant.layout.bodies;
    let other = mover.unwrap_or(other);
    format!("contact {}/{}", names[body], names[other])
}
