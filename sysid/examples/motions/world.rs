//! True machines: each plays a motion, is read with noise, and is identified.

use std::path::Path;
use std::time::Instant;

use asid::cli::MotionSetup;
use asid::core::Streams;
use asid::core::progress::Silent;
use asid::sysid::fit::{fit, smooth};
use serde::{Deserialize, Serialize};

use crate::machine::Machine;
use crate::motion::{Motion, root_mean_square};
use crate::{Outcome, THREADS};

/// Result of one true machine.
#[derive(Serialize, Deserialize)]
pub struct World {
    /// Values of the unknowns, in their units.
    pub truth: Vec<f64>,
    /// Estimate minus truth, in standard deviations of the prior.
    pub errors: Vec<f64>,
    /// Root mean square of the residuals, in units of the noise.
    pub residual: f64,
    /// The limit that it breaks.
    pub broken: Option<String>,
    /// Time of the identification, s.
    pub wall_s: f64,
}

impl World {
    /// Root mean square of the errors.
    pub fn figure(&self) -> f64 {
        root_mean_square(&self.errors)
    }
}

/// The result of a seed's true machine under a motion, read from its file if it exists.
pub fn met(
    machine: &Machine,
    setup: &mut MotionSetup<'_>,
    (label, motion): (&str, &Motion),
    seed: u64,
    folder: &Path,
) -> Outcome<World> {
    let file = folder.join(format!("{label}-{seed}-world.json"));
    if file.is_file() {
        return Ok(serde_json::from_str(&std::fs::read_to_string(file)?)?);
    }
    let (truth, rehearsed, data) = setup.true_machine(&motion.commands, seed)?;
    let clock = Instant::now();
    let settings = smooth();
    let found = fit(
        &*machine.subject.model,
        &setup.parameters,
        &data,
        (&settings, Streams::new(seed)),
        THREADS,
        &Silent,
    )?;
    let pairs = setup.parameters.iter().zip(found.values.iter().zip(&truth));
    let world = World {
        errors: pairs
            .map(|(p, (x, y))| p.to_scaled(*x) - p.to_scaled(*y))
            .collect(),
        truth,
        residual: found.residual,
        broken: rehearsed.excess.worst.map(|(what, _)| what),
        wall_s: clock.elapsed().as_secs_f64(),
    };
    std::fs::write(file, serde_json::to_string(&world)?)?;
    Ok(world)
}
