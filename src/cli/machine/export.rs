//! `asid export STUDY --mjcf FILE`: a refined model as plain MJCF, checked against the logs.

use std::io::Write as _;
use std::path::Path;

use anyhow::Result;
use asid_core::episode::InitialState;
use asid_core::problem::home;
use asid_core::{Capabilities, Episode, Error, Layout, Scene};
use asid_diagnosis::study::Study;
use asid_effects::native::{PlainModel, plain};
use asid_effects::{Native, RefinedModel};
use asid_mjcf::Plant;
use asid_sysid::dataset::Dataset;
use asid_sysid::gap::{gap, too_short};
use serde::Serialize;

use super::Subject;
use crate::cli::export::create;
use crate::cli::result::SCHEMA;

/// Relative difference between a written and a compiled value that counts as rounding in the
/// engine's derivations.
const ROUNDING: f64 = 1e-6;

/// The request.
pub struct Request<'a> {
    /// Study or model.
    pub path: &'a Path,
    /// The document to write.
    pub out: &'a Path,
    /// Engine; the default one where none is named.
    pub backend: Option<&'a str>,
    /// Whether to print JSON.
    pub json: bool,
}

/// How an effect was written.
#[derive(Serialize)]
struct EffectRow {
    effect: String,
    /// `whole`, `nearly` or `left-out`.
    native: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    sentence: Option<String>,
}

/// Gaps of both models on the same logs, in units of the noise.
#[derive(Serialize)]
struct GapRow {
    logs: &'static str,
    refined: f64,
    exported: f64,
}

#[derive(Serialize)]
struct ExportResult {
    schema: u32,
    file: String,
    engine: String,
    effects: Vec<EffectRow>,
    left_out: Vec<String>,
    /// Why the engine, which lacks some of MJCF, did not simulate the document.
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
    gap: Vec<GapRow>,
}

/// What the document gives in the engine.
#[derive(Default)]
struct Comparison {
    /// Values that it does not reproduce, a sentence each.
    differing: Vec<String>,
    refused: Option<String>,
    gap: Vec<GapRow>,
}

/// Writes the document and reports how exactly it reproduces the model.
pub fn export(request: &Request<'_>) -> Result<()> {
    let subject = Subject::open(request.path, request.backend)?;
    if request.out.exists() {
        // Check this before any work.
        return create(request.out, "");
    }
    let folder = request.out.parent().unwrap_or(Path::new(""));
    let written = plain(&*subject.backend, &subject.source, folder)?;
    let name = request.out.display().to_string();
    let scene = Scene::from_xml(&name, &written.xml, &[])?.in_directory(Some(folder.to_owned()));
    let Comparison {
        differing,
        refused,
        gap,
    } = compared(&subject, &written, scene)?;
    let left_out = [&written.left_out[..], &differing].concat();
    create(request.out, &written.xml)?;
    let effects = written.effects.iter();
    let result = ExportResult {
        schema: SCHEMA,
        file: name,
        engine: subject.engine(),
        effects: effects
            .map(|e| EffectRow {
                effect: e.effect.to_string(),
                native: match e.native {
                    Native::Whole => "whole",
                    Native::Nearly(_) => "nearly",
                    Native::LeftOut(_) => "left-out",
                },
                sentence: e.sentence(),
            })
            .collect(),
        left_out,
        refused,
        gap,
    };
    let mut stdout = std::io::stdout().lock();
    if request.json {
        writeln!(stdout, "{}", serde_json::to_string_pretty(&result)?)?;
        return Ok(());
    }
    let count = |native: &str| result.effects.iter().filter(|e| e.native == native).count();
    writeln!(
        stdout,
        "wrote {}: {}; effects: {} whole, {} nearly, {} left out",
        result.file,
        asid_results::naming::count(written.values.len(), "value"),
        count("whole"),
        count("nearly"),
        count("left-out"),
    )?;
    let sentences = result.effects.iter().filter_map(|e| e.sentence.as_ref());
    for sentence in sentences.chain(&result.left_out).chain(&result.refused) {
        writeln!(stdout, "  {sentence}")?;
    }
    for row in &result.gap {
        if row.refined.is_nan() || row.exported.is_nan() {
            writeln!(stdout, "{}", too_short(row.logs))?;
            continue;
        }
        writeln!(
            stdout,
            "gap on the logs {}, in units of the noise: {:.3} refined, {:.3} exported",
            row.logs, row.refined, row.exported
        )?;
    }
    Ok(())
}

/// Simulates the document in the model's engine.
///
/// An engine that claims less than MJCF may refuse what is right. One that claims all of it refuses
/// only what is wrong.
fn compared(subject: &Subject, written: &PlainModel, scene: Scene) -> Result<Comparison> {
    let compare = || -> Result<Comparison> {
        let exported = Subject::of_scene(scene, subject)?;
        Ok(Comparison {
            differing: values_that_differ(written, &exported)?,
            refused: None,
            gap: match &subject.study {
                Some(study) => gaps(study, subject, &exported)?,
                None => Vec::new(),
            },
        })
    };
    let lacks = subject.backend.capabilities() != Capabilities::all();
    compare().or_else(|error| match error.downcast_ref::<Error>() {
        Some(Error::Scene { .. } | Error::Incapable { .. }) if lacks => Ok(Comparison {
            refused: Some(format!("the gaps are not measured: {error}")),
            ..Comparison::default()
        }),
        _ => Err(error),
    })
}

impl Subject {
    /// A plain document on the engine of another subject.
    fn of_scene(scene: Scene, like: &Self) -> Result<Self> {
        let model = like.backend.load(&scene)?;
        // The reader of documents does not handle polynomial joint couplings. The tree is that of
        // the source unless joints were added.
        let mut plant = match Plant::of(&scene) {
            Ok(plant) => plant,
            Err(_) if model.layout().nq == like.plant.layout.nq => like.plant.clone(),
            Err(error) => return Err(error.into()),
        };
        plant.layout = model.layout().clone();
        Ok(Self {
            name: like.name.clone(),
            file: scene.name().into(),
            source: RefinedModel {
                scene,
                parameters: Vec::new(),
                effects: Vec::new(),
            },
            study: None,
            backend: super::super::session::backend(like.backend.name())?,
            model,
            plant,
        })
    }
}

/// Values that the compiled document does not reproduce, one sentence each.
fn values_that_differ(written: &PlainModel, exported: &Subject) -> Result<Vec<String>> {
    let mut sentences = Vec::new();
    for (target, wanted) in &written.values {
        // A value that is now part of another element (a geom's mass in a body's inertia) is
        // checked by the replays.
        let Ok(found) = exported.model.nominal(target) else {
            continue;
        };
        let scale = wanted.abs().max(found.abs());
        let moved = written
            .effects
            .iter()
            .any(|e| !e.effect.site.is_empty() && e.effect.site == target.name);
        if !moved && (found - wanted).abs() > ROUNDING * scale {
            sentences.push(format!(
                "{target} is {found} in the document and {wanted} in the model"
            ));
        }
    }
    Ok(sentences)
}

/// The replay gaps of both models.
fn gaps(study: &Study, refined: &Subject, exported: &Subject) -> Result<Vec<GapRow>> {
    let mut rows = Vec::new();
    let noise = Dataset::new(&refined.plant, &study.train, &study.noise)?.noise();
    for (logs, episodes) in [("fitted", &study.train), ("held out", &study.test)] {
        if episodes.is_empty() {
            continue;
        }
        let of = |subject: &Subject| -> Result<f64> {
            let episodes: Vec<(String, Episode)> = episodes
                .iter()
                .map(|(name, e)| {
                    let (from, to) = (&refined.plant.layout, &subject.plant.layout);
                    Ok((name.clone(), with_places(e, from, to)?))
                })
                .collect::<Result<_>>()?;
            let data = Dataset::new(&subject.plant, &episodes, &noise)?;
            Ok(gap(&*subject.model, &[], &[], &data, 0)?.value)
        };
        rows.push(GapRow {
            logs,
            refined: of(refined)?,
            exported: of(exported)?,
        });
    }
    Ok(rows)
}

/// A log whose given start is rearranged to the `qpos` and `qvel` of another layout, by joint
/// names.
fn with_places(episode: &Episode, from: &Layout, to: &Layout) -> Result<Episode> {
    let mut episode = episode.clone();
    if from.nq == to.nq {
        return Ok(episode);
    }
    let Some(given) = episode.initial.take() else {
        return Ok(episode);
    };
    let (mut qpos, mut qvel) = home(to);
    for joint in &to.joints {
        let Some(old) = from.joints.iter().find(|j| j.name == joint.name) else {
            continue;
        };
        let (p, v) = (joint.kind.qpos_len(), joint.kind.qvel_len());
        if old.kind != joint.kind {
            return Err(Error::Failed(format!("joint `{}` is of another kind", joint.name)).into());
        }
        qpos[joint.qpos..joint.qpos + p].copy_from_slice(&given.qpos[old.qpos..old.qpos + p]);
        qvel[joint.qvel..joint.qvel + v].copy_from_slice(&given.qvel[old.qvel..old.qvel + v]);
    }
    episode.initial = Some(InitialState { qpos, qvel });
    Ok(episode)
}
