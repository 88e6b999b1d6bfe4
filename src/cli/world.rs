//! Opens the simulated real world: its model, its tracker and its perturbations.

use std::sync::Arc;

use anyhow::Result;
use asid_core::{Backend, Error, Model, Streams};
use asid_effects::EffectSpec;
use asid_effects::refined_model::RefinedModel;
use asid_mjcf::Plant;
use asid_worlds::TrackerErrors;
use asid_worlds::{Perturbation, WorldKind};
use serde::Serialize;

use super::model::{self, Needs};
use super::session::{Session, backend, require};

/// An open real world.
pub struct World {
    pub model: Arc<dyn Model>,
    pub tracker: TrackerErrors,
    pub perturbed: Option<PerturbedResult>,
}

/// What is off in a perturbed world.
#[derive(Clone, Serialize, schemars::JsonSchema)]
#[schemars(rename = "Perturbation")]
pub struct PerturbedResult {
    #[serde(flatten)]
    pub drawn: Perturbation,
    /// Parts that the engine or the scene cannot have, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
}

/// What a result says of its real world.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "World")]
pub struct RealResult {
    #[schemars(with = "String")]
    world: WorldKind,
    backend: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    perturbation: Option<PerturbedResult>,
}

impl RealResult {
    /// The real world of a session.
    pub fn of(session: &Session) -> Self {
        let real = &session.config.real;
        Self {
            world: real.world,
            backend: real.backend.clone(),
            perturbation: session.perturbed().cloned(),
        }
    }
}

impl World {
    /// Opens the world that the session's settings describe.
    ///
    /// `simulator` is the task's scene on the method's engine; `streams` draws the perturbations.
    pub fn open(session: &Session, simulator: &Arc<dyn Model>, streams: Streams) -> Result<Self> {
        let real = &session.config.real;
        let effects = real
            .effects
            .iter()
            .map(|text| text.parse::<EffectSpec>())
            .collect::<asid_core::Result<Vec<_>>>()?;
        let plain = |model| Self {
            model,
            tracker: TrackerErrors::default(),
            perturbed: None,
        };
        if real.is_scene_on(&session.config.backend) {
            return Ok(plain(Arc::clone(simulator)));
        }
        let engine = backend(&real.backend)?;
        require(&*engine, session.task.spec().requires)?;
        let needs = Needs {
            task: &*session.task,
            layout: simulator.layout(),
            parameters: &session.parameters,
        };
        let source = match (&real.model, real.world) {
            (_, WorldKind::StandIn) => stand_in(session)?,
            (Some(path), WorldKind::Perturbed) => RefinedModel::open(path)?,
            (Some(path), _) => {
                return Ok(plain(needs.open(&*engine, path, "real world", &effects)?.1));
            }
            (None, _) => model::of_task(&*session.task),
        };
        let source = RefinedModel {
            effects: [source.effects, effects].concat(),
            ..source
        };
        let world = if real.world == WorldKind::Perturbed {
            perturbed(session, &*engine, &source, streams)?
        } else {
            plain(model::compile(&*engine, &source)?)
        };
        if real.world != WorldKind::Custom {
            needs.check(&*world.model).map_err(|e| Error::Scene {
                scene: source.scene.name().to_owned(),
                message: format!("cannot stand for the task's real world: {e}"),
            })?;
        }
        Ok(world)
    }
}

/// The task's scene with another object.
fn stand_in(session: &Session) -> Result<RefinedModel> {
    let scene = session.task.stand_in()?.ok_or_else(|| Error::Config {
        key: "--world stand-in".into(),
        message: format!(
            "task `{}` has no other object that could stand in",
            session.task.name()
        ),
    })?;
    Ok(RefinedModel {
        scene,
        parameters: Vec::new(),
        effects: Vec::new(),
    })
}

fn perturbed(
    session: &Session,
    engine: &dyn Backend,
    source: &RefinedModel,
    streams: Streams,
) -> Result<World> {
    let ranges = session.config.real.perturbation.clone().unwrap_or_default();
    let plant = Plant::of(&source.scene)?;
    let signals = &session.signals;
    let tracked: Vec<String> = signals.iter().map(|s| s.sensor.clone()).collect();
    let drawn = Perturbation::draw(&ranges, &plant, &plant.layout, &tracked, streams)?;
    let world = asid_worlds::perturb(
        engine,
        &source.scene,
        (&source.parameters, &source.effects),
        &session.parameters,
        signals,
        &drawn,
    )?;
    Ok(World {
        model: world.model,
        tracker: world.tracker,
        perturbed: Some(PerturbedResult {
            drawn,
            left_out: world.left_out,
        }),
    })
}
