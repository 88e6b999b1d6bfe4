//! The parts of a diagnosis by the missing force: forces along the logs, evidence, angles between
//! effects.

use asid_results::diagnosis::*;
use asid_results::trace::*;

use super::{Diagnosis, Noise, names};

/// A joint with dry friction, beside which a spring was named: most of the missing force lies on
/// the law.
fn joint(dof: &str, size: f64) -> ForceTrace {
    let mut noise = Noise(9);
    let mut series = |rows: usize, gap: f64| {
        let time: Vec<f64> = (0..rows).map(|k| gap * k as f64).collect();
        let position: Vec<f64> = time.iter().map(|t| 0.8 * (1.7 * t).sin()).collect();
        let speed: Vec<f64> = time.iter().map(|t| 1.36 * (1.7 * t).cos()).collect();
        let law: Vec<f64> = (position.iter().zip(&speed))
            .map(|(x, v)| -size * v.signum() - 0.3 * size * x)
            .collect();
        let mut near = |share: f64| -> Vec<f64> {
            law.iter()
                .map(|f| share * f + 0.1 * size * noise.normal())
                .collect()
        };
        ForceSeries {
            before: near(1.0),
            after: near(0.05),
            load: position.iter().map(|x| 3.0 * x.cos()).collect(),
            time,
            position,
            speed,
            law,
        }
    };
    ForceTrace {
        dof: dof.into(),
        unit: "N m".into(),
        position_unit: "rad".into(),
        episode: "train_0.csv".into(),
        stretch: series(400, 0.01),
        spread: series(400, 0.137),
        whole: ForceSeries::default(),
    }
}

/// Adds these parts to a diagnosis.
pub fn add(d: &mut Diagnosis) {
    d.trace.forces = ["shoulder", "elbow", "wrist"]
        .iter()
        .zip([1.2, 0.4, 0.02])
        .map(|(dof, size)| joint(dof, size))
        .collect();
    // A machine without drives, turning about a free axis.
    let wrist = &mut d.trace.forces[2];
    wrist.spread.load.clear();
    wrist.spread.position.clear();
    wrist.spread.law.fill(f64::NAN);
    wrist.stretch.after[20..60].fill(f64::NAN);
    let force = |(dof, identified): (&str, f64)| MissingForce {
        dof: dof.into(),
        unit: "N m".into(),
        identified,
        refined: 0.1 * identified,
        correlation_time: 0.3,
    };
    let all = [("shoulder", 1.3), ("elbow", 0.43), ("wrist", f64::NAN)];
    d.result.missing_force = all.into_iter().map(force).collect();
    let verdict = d.result.verdict.effects.clone();
    let ranked = |effects: &[&str], screened, fitted| RankedSet {
        effects: names(effects),
        screened,
        fitted,
    };
    let joints = ["coulomb-friction@shoulder", "coulomb-friction@elbow"];
    d.result.ranking = vec![
        RankedSet {
            effects: verdict,
            screened: Some(3804.0),
            fitted: Some(4120.5),
        },
        ranked(&joints, None, Some(2011.3)),
        ranked(&["linear-drag@puck"], Some(310.0), None),
        ranked(&["gravity-tilt"], Some(f64::NAN), None),
        ranked(&["sensor-bias@q_elbow"], Some(-2.0), None),
    ];
    let n = 14;
    let angle = |i: usize, j: usize| {
        let apart = i.abs_diff(j) as f64;
        (0.4 * apart).min(std::f64::consts::FRAC_PI_2)
    };
    d.result.isolability = Some(Isolability {
        effects: (0..n)
            .map(|i| format!("friction-anisotropy@joint_{i}"))
            .collect(),
        angles: (0..n)
            .map(|i| (0..n).map(|j| angle(i, j)).collect())
            .collect(),
    });
    d.result.not_tried = vec![
        NotTried {
            stage: "confirmation of what leads in screening".into(),
            effects: names(&["linear-drag@puck", "gravity-tilt"]),
        },
        NotTried {
            stage: "fit of the values to whole replays".into(),
            effects: Vec::new(),
        },
    ];
}
