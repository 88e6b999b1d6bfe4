//! One cell: a single run of a method in its own session.

use std::time::Instant;

use crate::pipeline::{self, Method as Parts};
use anyhow::Result;
use asid_comparison::cell::{Cell, CellKey, CellParameter, SCHEMA, Versions};
use asid_core::Model;
use asid_core::registry::{ExplorerEntry, IdentifierEntry, SolverEntry, find};

use super::arm::Arm;
use crate::cli::options::{Algorithms, Worlds};
use crate::cli::session::Session;

/// Commit that this program was built from.
pub const COMMIT: &str = env!("ASID_GIT");

/// Version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// Opens the session of a cell.
///
/// # Errors
/// When a setting does not fit the task or the engine.
pub fn open(arm: &Arm, key: &CellKey) -> Result<Session> {
    let mut common = arm.common.clone();
    common.seed = Some(key.seed);
    common.set.push(format!("condition={:?}", key.condition));
    Session::open(
        &key.task,
        &common,
        &Algorithms::default(),
        &Worlds::default(),
    )
}

/// Runs a cell; returns it with the seconds that it took.
///
/// # Errors
/// When it cannot be opened, or an algorithm or the world fails.
pub fn run(arm: &Arm, key: &CellKey) -> Result<(Cell, f64)> {
    let clock = Instant::now();
    let session = open(arm, key)?;
    let config = &session.config;
    let method = &arm.method;
    let explorer = method
        .explores()
        .then(|| (find::<ExplorerEntry>(&config.explorer.name)?.make)(&config.explorer.settings))
        .transpose()?;
    let identifier = method
        .identifies()
        .then(|| {
            let component = &config.identifier;
            (find::<IdentifierEntry>(&component.name)?.make)(&component.settings)
        })
        .transpose()?;
    let ensemble = match &identifier {
        Some(identifier) => session.ensemble_if(identifier.assumes().scatter)?,
        None => None,
    };
    let solver = (find::<SolverEntry>(&config.solver.name)?.make)(&config.solver.settings)?;
    let truth = session.truth();
    let problem = session.problem();
    let mut world = session.world(&truth)?;
    let parts = Parts {
        explorer: explorer.as_deref(),
        identifier: identifier.as_deref(),
        solver: &*solver,
        ensemble: ensemble.as_ref().map(|e| e as &dyn Model),
        known: method.knows_the_truth().then_some(&*truth),
        expected: config.expected.settings(),
    };
    let outcome = pipeline::run(&problem, parts, &mut world)?;
    let wall_s = clock.elapsed().as_secs_f64();
    // Without its fits it is the deviation that explorers are paid for, not that of a posterior.
    let predicted = config.expected.rounds > 0;
    let expected = outcome.information.expected_std.last();
    let expected = expected.filter(|_| predicted);
    let marginals = outcome.belief.marginals.iter();
    let parameters = marginals
        .zip(&truth)
        .enumerate()
        .map(|(i, (m, &truth))| CellParameter {
            name: m.name.clone(),
            unit: m.unit.clone(),
            truth,
            estimate: m.estimate,
            std: m.std,
            interval95: m.interval95,
            expected_std: expected.and_then(|e| e.get(i).copied()),
        });
    let cost = session.cost(wall_s);
    let cell = Cell {
        schema: SCHEMA,
        key: key.clone(),
        explorer: method.explorer.clone(),
        identifier: method.identifier.clone(),
        solver: method.solver.clone(),
        settings: arm.hash.clone(),
        versions: Versions {
            asid: VERSION.to_owned(),
            engine: session.engine.clone(),
            git: COMMIT.to_owned(),
        },
        parameters: parameters.collect(),
        residual: outcome.identified.as_ref().map(|f| f.residual),
        contact_fraction: outcome.real.as_ref().map(|r| r.contact_fraction),
        metric: session.task.downstream().metric.clone(),
        value: outcome.attempt.outcome.value,
        success: outcome.attempt.outcome.success,
        physics_steps: cost.physics_steps,
        env_steps: cost.env_steps,
    };
    Ok((cell, wall_s))
}
