//! Applies a perturbation to a scene, by means that any scene supports: another time step,
//! parameter values, effects of the catalogue, and the world's own tracker.

use std::sync::Arc;

use crate::TrackerErrors;
use asid_core::registry::find;
use asid_core::signal::Signal;
use asid_core::{Backend, Capabilities, Model, Parameter, Result, Scene, Target};
use asid_effects::catalogue::{command_dynamics, mass};
use asid_effects::refined::{Refined, as_compiled, needs};
use asid_effects::{EffectEntry, EffectSpec};
use asid_mjcf::Plant;

use crate::Perturbation;

/// Effect for the command lag of a servo, and its parameter.
const LAG: [&str; 2] = [command_dynamics::LAG, "time_constant"];

/// Effect for a mass, and its parameter.
const MASS: [&str; 2] = [mass::MASS, "factor"];

/// A scene in a perturbed world.
pub struct Perturbed {
    /// The compiled world.
    pub model: Arc<dyn Model>,
    /// Its tracker.
    pub tracker: TrackerErrors,
    /// Parts of the perturbation that this engine or scene does not support, with the reasons.
    pub left_out: Vec<String>,
}

/// Compiles `scene`, which already has `values` and `effects`, with a perturbation.
///
/// Unknowns keep their values: those are the truth.
///
/// # Errors
/// When the engine refuses the scene.
pub fn perturb(
    backend: &dyn Backend,
    scene: &Scene,
    (values, effects): (&[(Target, f64)], &[EffectSpec]),
    unknowns: &[Parameter],
    signals: &[Signal],
    drawn: &Perturbation,
) -> Result<Perturbed> {
    let step = Plant::of(scene)?.layout.timestep / drawn.steps.max(1) as f64;
    let scene = scene.with_timestep(step)?;
    // The plant of the scene with the finer step, since a lag counts its steps.
    let model = backend.load(&scene)?;
    let plant = Arc::new(as_compiled(&Plant::of(&scene)?, &*model, scene.name())?);
    let mut left_out = Vec::new();
    let mut all_values = values.to_vec();
    let soft = softness(backend, &*model, &plant, (values, unknowns), drawn);
    match soft {
        Ok(more) => all_values.extend(more),
        Err(why) => left_out.push(format!("contact softness: {why}")),
    }
    let mut all_effects = effects.to_vec();
    if drawn.servo_lag > 0.0 {
        let all = plant.layout.actuators.iter().map(|a| a.name.clone());
        let lags = all.map(|site| spec(LAG, site, drawn.servo_lag)).collect();
        add(backend, LAG[0], lags, &mut all_effects, &mut left_out)?;
    }
    let masses = masses(&plant, unknowns, drawn)?;
    if masses.is_empty() && drawn.mass.values().any(|f| *f != 1.0) {
        left_out.push("mass: what lies free has none that is known".into());
    }
    add(backend, MASS[0], masses, &mut all_effects, &mut left_out)?;
    let model = if all_values.is_empty() && all_effects.is_empty() {
        model
    } else {
        Refined::new(backend, model, plant, &all_values, &all_effects)?
    };
    let offsets = signals.iter().map(|s| drawn.tracker.offset.get(&s.sensor));
    let mut offset: Vec<f64> = offsets.flatten().flatten().copied().collect();
    if offset.iter().all(|x| *x == 0.0) {
        // Without an offset a reading stays bit-identical.
        offset.clear();
    }
    let tracker = TrackerErrors {
        latency: drawn.tracker.latency,
        offset,
        every: drawn.tracker.every,
        dropout: drawn.tracker.dropout,
    };
    Ok(Perturbed {
        model,
        tracker,
        left_out,
    })
}

fn spec([effect, parameter]: [&str; 2], site: String, value: f64) -> EffectSpec {
    EffectSpec {
        name: effect.to_owned(),
        site,
        values: vec![(parameter.to_owned(), value)],
    }
}

/// Adds effects of one kind where the engine supports them and the site does not already have that
/// effect.
fn add(
    backend: &dyn Backend,
    name: &str,
    specs: Vec<EffectSpec>,
    to: &mut Vec<EffectSpec>,
    left_out: &mut Vec<String>,
) -> Result<()> {
    let effect = (find::<EffectEntry>(name)?.make)();
    let lacking = needs(&*effect) - backend.capabilities();
    if !specs.is_empty() && !lacking.is_empty() {
        left_out.push(format!("{name}: {}", lacks(backend, lacking)));
        return Ok(());
    }
    let label = |e: &EffectSpec| e.label();
    let given: Vec<String> = to.iter().map(label).collect();
    let new = specs.into_iter().filter(|e| !given.contains(&e.label()));
    to.extend(new);
    Ok(())
}

fn lacks(backend: &dyn Backend, lacking: Capabilities) -> String {
    let names: Vec<String> = lacking
        .iter_names()
        .map(|(n, _)| n.to_lowercase().replace('_', " "))
        .collect();
    format!("engine `{}` lacks {}", backend.name(), names.join(", "))
}

/// Perturbed contact softness of all geoms that can touch, as MJCF writes it; unknowns and given
/// values are left out.
///
/// All geoms change alike, since a contact mixes the numbers of its two geoms.
fn softness(
    backend: &dyn Backend,
    model: &dyn Model,
    plant: &Plant,
    (values, unknowns): (&[(Target, f64)], &[Parameter]),
    drawn: &Perturbation,
) -> std::result::Result<Vec<(Target, f64)>, String> {
    let (time, damping) = (drawn.contact_time, drawn.contact_damping);
    if time == 1.0 && damping == 1.0 {
        return Ok(Vec::new());
    }
    let lacking = Capabilities::CONTACT_STIFFNESS - backend.capabilities();
    if !lacking.is_empty() {
        return Err(lacks(backend, lacking));
    }
    let mut geoms: Vec<usize> = plant.contacts.iter().flatten().copied().collect();
    geoms.sort_unstable();
    geoms.dedup();
    let mut softer = Vec::with_capacity(2 * geoms.len());
    for geom in geoms {
        for index in [0, 1] {
            let target = Target {
                element: "geom".into(),
                name: plant.layout.geoms[geom].clone(),
                attribute: "solref".into(),
                index,
            };
            let unknown = unknowns.iter().any(|p| p.targets.contains(&target));
            if unknown || values.iter().any(|(t, _)| *t == target) {
                continue;
            }
            let nominal = model.nominal(&target).map_err(|e| e.to_string())?;
            // (time constant, damping ratio) where positive, else (-stiffness, -damping). Stiffness
            // is proportional to 1 / (time x ratio)^2, damping to 1 / time.
            let change = match (index, nominal > 0.0) {
                (0, true) => time,
                (0, false) => (time * damping).powi(-2),
                (_, true) => damping,
                (_, false) => time.recip(),
            };
            softer.push((target, change * nominal));
        }
    }
    Ok(softer)
}

/// Mass effects of free bodies, each with everything attached to it; unknowns are left out.
fn masses(plant: &Plant, unknowns: &[Parameter], drawn: &Perturbation) -> Result<Vec<EffectSpec>> {
    let effect = (find::<EffectEntry>(MASS[0])?.make)();
    let root = |mut body: usize| {
        while body != 0 && plant.free_joint(body).is_none() {
            body = plant.bodies[body].parent;
        }
        body
    };
    let body_of = |site: &str| {
        let geom = plant.geom(site).ok().filter(|&g| plant.geoms[g].has_mass);
        geom.map(|g| plant.geoms[g].body)
            .or_else(|| plant.layout.bodies.iter().position(|b| b == site))
    };
    let is_unknown = |site: &str| {
        let targets = unknowns.iter().flat_map(|p| &p.targets);
        let mut masses = targets.filter(|t| t.attribute == "mass");
        masses.any(|t| t.name == site)
    };
    let sites = effect.sites(plant).into_iter();
    Ok(sites
        .filter(|site| !is_unknown(site))
        .filter_map(|site| {
            let body = plant.layout.bodies.get(root(body_of(&site)?))?;
            let factor = *drawn.mass.get(body)?;
            (factor != 1.0).then(|| spec(MASS, site, factor))
        })
        .collect())
}
