//! One cell: a single run of a method in its own session.

use std::time::Instant;

use crate::pipeline::{self, Method as Parts};
use anyhow::Result;
use asid_algorithms::explore::reused::{Plans, Reused};
use asid_comparison::cell::{Cell, CellKey, CellParameter, SCHEMA, Versions};
use asid_core::registry::{ExplorerEntry, IdentifierEntry, SolverEntry, find};
use asid_core::{Explorer, Model};

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

/// Settings that no plan of exploration depends on. The real world does, but shows itself in the
/// first reading alone.
const AFTER_PLANNING: [&str; 5] = ["real", "identifier", "model_errors", "expected", "solver"];

/// The explorer of a session, with the plans of other sessions.
fn explorer<'p>(session: &Session, plans: &'p Plans) -> Result<Reused<'p>> {
    let config = &session.config;
    let explorer = &config.explorer;
    let mut named = toml::Table::try_from(config)?;
    for section in AFTER_PLANNING {
        named.remove(section);
    }
    let condition = config.condition.as_deref();
    let other_task = condition.map_or(Ok(None), |c| session.task.under(c))?;
    if other_task.is_none() {
        // The condition sets the hidden truth alone.
        named.remove("condition");
    }
    Ok(Reused {
        explorer: (find::<ExplorerEntry>(&explorer.name)?.make)(&explorer.settings)?,
        plans,
        name: named.to_string(),
    })
}

/// Runs a cell; returns it with the seconds that it took. Open-loop plans of exploration are
/// [shared](asid_algorithms::explore::reused) by the cells that would make the same.
///
/// # Errors
/// When it cannot be opened, or an algorithm or the world fails.
pub fn run(arm: &Arm, key: &CellKey, plans: &Plans) -> Result<(Cell, f64)> {
    let clock = Instant::now();
    let session = open(arm, key)?;
    let config = &session.config;
    let method = &arm.method;
    let explorer = method
        .explores()
        .then(|| explorer(&session, plans))
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
        explorer: explorer.as_ref().map(|e| e as &dyn Explorer),
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
