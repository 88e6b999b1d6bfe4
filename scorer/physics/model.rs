//! A study's model with effects, replayed along logs.

use std::sync::Arc;

use asid_core::parameter::Parameter;
use asid_core::simulator::{BatchConfig, Simulator};
use asid_core::{Backend, Model, Result, Target};
use asid_effects::refined::Refined;
use asid_effects::{EffectSpec, Start};
use asid_mjcf::Plant;

use super::logs::Logs;
use super::start::State;
use super::study::Study;

/// An engine with the study's scene compiled.
pub struct Engine {
    backend: Arc<dyn Backend>,
    model: Arc<dyn Model>,
    plant: Arc<Plant>,
}

/// An unknown of a fit: one value shared by some targets.
#[derive(Clone, Debug)]
pub struct Unknown {
    parameter: Parameter,
    /// Start value of the fit, in the parameter's unit.
    pub start: f64,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Finite-difference step, in the parameter's unit.
    pub step: f64,
}

/// Finite-difference step relative to the value: the square root of single precision.
///
/// The rollouts of any engine resolve it, and it is far below what changes a slope.
const STEP: f64 = 3e-4;
/// Finite-difference step of a value that starts at zero, in units of its range, or of 1 if the
/// range is larger.
const STEP_AT_ZERO: f64 = 1e-5;

impl Unknown {
    fn new(parameter: Parameter, start: f64) -> Self {
        let [low, high] = parameter.range;
        let step = (STEP * start.abs()).max(STEP_AT_ZERO * (high - low).min(1.0));
        Self {
            start: start.clamp(low, high),
            range: parameter.range,
            parameter,
            step,
        }
    }
}

impl Unknown {
    /// Whether it is a value of the effect `NAME@SITE`.
    #[must_use]
    pub fn is_of(&self, effect: &str) -> bool {
        let mut targets = self.parameter.targets.iter();
        targets.any(|t| t.element == "effect" && t.name == effect)
    }

    /// Writes a value into the effect to which this unknown belongs.
    pub fn set(&self, effects: &mut [EffectSpec], value: f64) {
        for target in &self.parameter.targets {
            let own = effects.iter_mut().find(|e| e.label() == target.name);
            if let Some(spec) = own {
                spec.values.retain(|(name, _)| *name != target.attribute);
                spec.values.push((target.attribute.to_string(), value));
            }
        }
    }
}

/// A model with effects whose values are unknowns.
pub struct World {
    model: Arc<dyn Model>,
    /// The study's parameters, followed by those of the effects.
    pub unknowns: Vec<Unknown>,
}

impl Engine {
    /// Compiles the study's scene.
    ///
    /// # Errors
    /// If the engine refuses it.
    pub fn new(backend: Arc<dyn Backend>, study: &Study) -> Result<Self> {
        Ok(Self {
            model: backend.load(&study.model.scene)?,
            plant: Arc::new(study.plant.clone()),
            backend,
        })
    }

    /// The study's model with more effects; their given values are the start of a fit.
    ///
    /// `known` gives start values of the study's parameters.
    ///
    /// # Errors
    /// If an effect, its site or a value is unknown, or if the engine cannot provide it.
    pub fn world(
        &self,
        study: &Study,
        effects: &[EffectSpec],
        known: &dyn Fn(&str) -> Option<f64>,
    ) -> Result<World> {
        let all = [&study.model.effects[..], effects].concat();
        let fixed = &study.model.parameters;
        let model = Refined::new(
            &*self.backend,
            Arc::clone(&self.model),
            Arc::clone(&self.plant),
            fixed,
            &all,
        )?;
        let mut unknowns: Vec<Unknown> = study
            .parameters
            .iter()
            .map(|p| {
                let start = known(&p.name).unwrap_or_else(|| p.from_unit(0.5));
                Unknown::new(p.clone(), start)
            })
            .collect();
        for spec in effects {
            let effect = spec.find(&self.plant)?;
            let values = spec.values_of(&*effect)?;
            for (p, value) in effect.parameters().iter().zip(values) {
                // A parameter that no search varies keeps its given value.
                if matches!(p.start, Start::Choice(_) | Start::Given | Start::Set(..)) {
                    continue;
                }
                let target = Target::new("effect", &spec.label(), p.name, 0);
                let parameter = Parameter {
                    name: format!("{}.{}", spec.label(), p.name),
                    targets: vec![target],
                    range: p.range,
                    scale: asid_core::parameter::Scale::Linear,
                    unit: p.unit.into(),
                };
                unknowns.push(Unknown::new(parameter, value));
            }
        }
        Ok(World { model, unknowns })
    }
}

/// Values of the unknowns and initial states of the logs.
#[derive(Clone, Debug)]
pub struct Point {
    /// One value per unknown.
    pub values: Vec<f64>,
    /// One initial state per log.
    pub starts: Vec<State>,
}

/// Replays logs in a world, many points at once.
pub struct Replays {
    simulator: Box<dyn Simulator>,
    parameters: Vec<Parameter>,
    capacity: usize,
}

impl Replays {
    /// Prepares replays of up to `capacity` points at once.
    ///
    /// # Errors
    /// If the engine cannot set an unknown.
    pub fn new(world: &World, capacity: usize) -> Result<Self> {
        let parameters: Vec<Parameter> =
            world.unknowns.iter().map(|u| u.parameter.clone()).collect();
        Ok(Self {
            simulator: world.model.simulator(&BatchConfig {
                size: capacity,
                threads: 1,
                targets: parameters.iter().flat_map(|p| p.targets.clone()).collect(),
            })?,
            parameters,
            capacity,
        })
    }

    /// Predicted readings: for each point, for each log `rows x width`; NaN after a simulation has
    /// diverged.
    ///
    /// # Errors
    /// If a value is not physical or the engine fails.
    pub fn readings(&mut self, logs: &mut Logs, points: &[Point]) -> Result<Vec<Vec<Vec<f64>>>> {
        let mut all: Vec<Vec<Vec<f64>>> = vec![Vec::new(); points.len()];
        for (chunk, out) in points
            .chunks(self.capacity)
            .zip(all.chunks_mut(self.capacity))
        {
            let sims: Vec<usize> = (0..chunk.len()).collect();
            let columns: Vec<f64> = chunk.iter().flat_map(|p| self.columns(&p.values)).collect();
            for (l, log) in logs.logs.iter_mut().enumerate() {
                let states = || chunk.iter().map(|p| &p.starts[l]);
                let qpos: Vec<f64> = states().flat_map(|s| s.qpos.clone()).collect();
                let qvel: Vec<f64> = states().flat_map(|s| s.qvel.clone()).collect();
                self.simulator.reset(&sims)?;
                self.simulator.set_parameters(&sims, &columns)?;
                self.simulator.set_state(&sims, &qpos, &qvel)?;
                let size = log.replay.rows() * log.replay.width();
                let mut rows = vec![0.0; sims.len() * size];
                log.replay.run(&mut *self.simulator, &sims, &mut rows)?;
                for (point, rows) in out.iter_mut().zip(rows.chunks_exact(size)) {
                    point.push(rows.to_vec());
                }
            }
        }
        Ok(all)
    }

    fn columns(&self, values: &[f64]) -> Vec<f64> {
        let pairs = self.parameters.iter().zip(values);
        pairs
            .flat_map(|(p, &x)| std::iter::repeat_n(p.setting(x), p.targets.len()))
            .collect()
    }
}
