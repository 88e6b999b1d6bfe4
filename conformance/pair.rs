//! Two simulations side by side, one with nominal and one with other parameters.

use asid_core::{Backend, Result};

use crate::rig::{Rig, Rows, Size, largest, last, relative};

/// Two simulations, the first with nominal parameters and the second with the given ones.
pub fn pair(
    backend: &dyn Backend,
    inside: &str,
    channels: &[&str],
    parameters: &[(&str, f64)],
) -> Result<Rig> {
    let targets: Vec<&str> = parameters.iter().map(|p| p.0).collect();
    let size = Size {
        sims: 2,
        threads: 1,
        targets: &targets,
    };
    let mut rig = Rig::with(backend, inside, channels, size)?;
    let values: Vec<f64> = parameters.iter().map(|p| p.1).collect();
    rig.simulator.set_parameters(&[1], &values)?;
    Ok(rig)
}

/// Last row of each simulation.
pub fn ends(rows: &Rows) -> Result<[Vec<f64>; 2]> {
    let half = rows.len() / 2;
    Ok([last(&rows[..half])?.to_vec(), last(&rows[half..])?.to_vec()])
}

/// Largest relative deviation of the two from theory.
pub fn both(found: [f64; 2], theory: [f64; 2]) -> f64 {
    largest((0..2).map(|i| relative(found[i], theory[i])))
}
