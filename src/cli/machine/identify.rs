//! `asid identify STUDY`: the parameters of a study from its logs.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Result;
use asid_algorithms::optimise::GaussNewtonSettings;
use asid_core::posterior::Direction;
use asid_core::{Parameter, Streams, Target};
use asid_diagnosis::intake::Intake;
use asid_effects::RefinedModel;
use asid_mjcf::native::way;
use asid_report::run::{NamedText, RealWorld, RunReport};
use asid_sysid::dataset::Dataset;
use asid_sysid::fit::{Identified, fit, smooth};
use asid_sysid::gap::{gap, too_short};
use serde::{Deserialize, Serialize};

use super::Subject;
use crate::cli::diagnose::machine;
use crate::cli::options::Common;
use crate::cli::output::{OutFolder, write_json, write_text};
use crate::cli::progress::Bars;
use crate::cli::result::{
    CostResult, ParameterResult, SCHEMA, UNEXPLAINED, Versions, caveats, parameter_line,
};
use crate::cli::settings::{given, parsed};
use crate::cli::{failure, interrupt, run, trace};

/// `config.toml`.
#[derive(Clone, Debug, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// The study that is fitted.
    study: String,
    /// The model in place of the study's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    model: Option<PathBuf>,
    /// Engine; the default one where nothing is said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    backend: Option<String>,
    /// Seed of all random numbers.
    #[serde(default)]
    seed: u64,
    /// How widely is searched.
    #[serde(default = "smooth")]
    gauss_newton: GaussNewtonSettings,
}

/// Gaps in units of the noise.
// Not a number, null in JSON, where logs are too short for one.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "FitGap")]
struct GapResult {
    /// With the model as given, on logs held out.
    nominal: f64,
    /// With the parameters fitted, on logs held out.
    identified: f64,
    /// The same on the logs that were fitted.
    nominal_fitted: f64,
    identified_fitted: f64,
}

/// `result.json`.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "StudyIdentification")]
pub struct IdentifyResult {
    schema: u32,
    study: String,
    backend: String,
    identifier: &'static str,
    seed: u64,
    parameters: Vec<ParameterResult>,
    /// Combinations of unknowns that the logs do not see.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    unseen: Vec<Direction>,
    /// Root mean square of the residuals at the best fit, in standard deviations of the noise.
    residual: f64,
    /// Root mean square of the residuals at the best fit, in standard deviations of noise and of
    /// the simulator's roughness together.
    misfit: f64,
    gap: GapResult,
    logs: Vec<String>,
    held_out: Vec<String>,
    /// What was left out of the logs, and how their stamps were read where that is in doubt.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    left_out: Vec<String>,
    cost: CostResult,
    versions: Versions,
}

impl GapResult {
    /// What it is on the logs held out.
    fn sentence(&self) -> String {
        if self.nominal.is_nan() || self.identified.is_nan() {
            return too_short("held out");
        }
        format!(
            "gap on logs held out, in units of the noise: {:.2} as given, {:.2} identified",
            self.nominal, self.identified
        )
    }
}

impl Config {
    /// Resolves the settings: a file, then single values, then options.
    pub fn resolve(path: &Path, model: Option<&Path>, common: &Common) -> Result<Self> {
        let mut table = given(common)?;
        table.insert("study".into(), path.display().to_string().into());
        let mut config: Self = parsed(table)?;
        config.model = model.map(Path::to_path_buf).or(config.model);
        config.backend = common.backend.clone().or(config.backend);
        config.seed = common.seed.unwrap_or(config.seed);
        config.gauss_newton.check("gauss_newton")?;
        Ok(config)
    }
}

/// Fits and writes the result; `model` replaces the study's own where given.
pub fn identify(path: &Path, model: Option<&Path>, common: &Common) -> Result<()> {
    let clock = Instant::now();
    let config = Config::resolve(path, model, common)?;
    let engine = config.backend.as_deref();
    let subject = Subject::open_with(path, engine, config.model.as_deref())?;
    let study = subject.needs_study()?;
    let out = OutFolder::claim(common.out.as_deref(), &format!("{}-identify", study.name))?;
    interrupt::watch(&format!("the identification of {}", study.name))?;
    let threads = common.threads.unwrap_or(0);
    let machine = machine(study, subject.backend.name(), threads)?;
    let intake = Intake::as_wired(study, &machine)?;
    let study = &intake.study;
    let progress = Bars::new(common.quiet);
    let train = Dataset::new(&subject.plant, &study.train, &study.noise)?;
    let test = Dataset::new(&subject.plant, &study.test, &train.noise())?;
    let found = fit(
        &*subject.model,
        &study.parameters,
        &train,
        (&config.gauss_newton, Streams::new(config.seed)),
        threads,
        &progress,
    )
    .map_err(|e| subject.as_written(e))?;
    let measure = |parameters: &[Parameter], values: &[f64], data: &Dataset| {
        gap(&*subject.model, parameters, values, data, threads).map(|g| g.value)
    };
    let gap = GapResult {
        nominal: measure(&[], &[], &test)?,
        identified: measure(&study.parameters, &found.values, &test)?,
        nominal_fitted: measure(&[], &[], &train)?,
        identified_fitted: measure(&study.parameters, &found.values, &train)?,
    };
    let wall_s = clock.elapsed().as_secs_f64();
    let names =
        |logs: &[(String, asid_core::Episode)]| logs.iter().map(|(n, _)| n.clone()).collect();
    let result = IdentifyResult {
        schema: SCHEMA,
        study: study.name.clone(),
        backend: subject.backend.name().to_owned(),
        identifier: "gauss-newton",
        seed: config.seed,
        parameters: ParameterResult::all(&found.posterior, None),
        unseen: found.posterior.unseen.clone(),
        residual: found.residual,
        misfit: found.misfit,
        gap,
        logs: names(&study.train),
        held_out: names(&study.test),
        left_out: intake.lines(),
        cost: CostResult {
            wall_s,
            physics_steps: found.physics_steps,
            env_steps: 0,
        },
        versions: Versions::with(subject.engine()),
    };
    let caveats = caveats(&study.parameters, &found.posterior, widen);
    let mut lines: Vec<String> = found
        .posterior
        .marginals
        .iter()
        .map(parameter_line)
        .collect();
    let sentence = result.gap.sentence();
    lines.push(sentence.clone());
    lines.extend(caveats.iter().cloned());
    lines.extend(result.left_out.iter().map(|line| format!("logs: {line}")));
    let mut report = report(&subject, &study.parameters, &found, &config, wall_s);
    report.answer = sentence;
    report.notes = caveats;
    report.notes.extend(result.left_out.iter().cloned());
    let warning = warning(&result);
    report.notes.extend(warning.clone());
    out.write(|folder| {
        write_json(&folder.join("result.json"), &result)?;
        write_text(&folder.join("config.toml"), &toml::to_string(&config)?)?;
        write_json(&folder.join("posterior.json"), &found.posterior)?;
        write_text(
            &folder.join("refined.toml"),
            &refined((&subject, &out.path()), &study.parameters, &found)?,
        )?;
        for (kind, logs) in [("train", &study.train), ("test", &study.test)] {
            for (i, (_, episode)) in logs.iter().enumerate() {
                let path = folder.join(format!("{kind}-{}.csv", i + 1));
                episode.write_csv_with_start(&path, &subject.plant.layout)?;
            }
        }
        report.write(folder)?;
        Ok(())
    })?;
    out.tell(common.json, &result, &lines)?;
    if let Some(warning) = &warning {
        failure::warn(warning);
    }
    Ok(())
}

/// Warning of a fit that does not help on logs held out, or that leaves more than noise and
/// roughness explain.
fn warning(result: &IdentifyResult) -> Option<String> {
    // Below the noise one fit is as good as another.
    if result.gap.identified > result.gap.nominal.max(1.0) {
        return Some(
            "the fitted model replays the logs held out worse than the model as given: something else differs; \
             `asid diagnose` looks for what"
                .into(),
        );
    }
    (result.misfit > UNEXPLAINED).then(|| {
        format!(
            "the fitted model leaves {:.1} times the sensors' noise and its own roughness together: something else \
             differs, and the intervals hold only as far as the model is right; `asid diagnose` looks for what",
            result.misfit
        )
    })
}

/// How the range of a study's unknown of this name is widened.
fn widen(name: &str) -> String {
    format!("give `{name}` a wider `range` in [[parameter]] of the study")
}

/// The model with the fitted values, as a file in the folder `home` that finds its document when
/// both have moved together.
fn refined(
    (subject, home): (&Subject, &Path),
    parameters: &[Parameter],
    found: &Identified,
) -> Result<String> {
    let mut values: Vec<(Target, f64)> = subject.source.parameters.clone();
    for (parameter, value) in parameters.iter().zip(&found.values) {
        for target in &parameter.targets {
            values.retain(|(t, _)| t != target);
            values.push((target.clone(), parameter.setting(*value)));
        }
    }
    let file = way(home, Path::new(subject.source.scene.name()));
    // An effect keeps its own values.
    let mut effects = subject.source.effects.clone();
    values.retain(|(target, value)| {
        let own = effects
            .iter_mut()
            .find(|e| target.element == "effect" && e.label() == target.name);
        let Some(effect) = own else { return true };
        effect.values.retain(|(name, _)| *name != target.attribute);
        effect.values.push((target.attribute.clone(), *value));
        false
    });
    Ok(RefinedModel::text(&file, &values, &effects)?)
}

/// The page.
fn report(
    subject: &Subject,
    parameters: &[Parameter],
    found: &Identified,
    config: &Config,
    wall_s: f64,
) -> RunReport {
    RunReport {
        stage: "identify".into(),
        task: subject.name.clone(),
        backend: subject.backend.name().to_owned(),
        identifier: "gauss-newton".into(),
        seed: config.seed,
        real_world: RealWorld {
            engine: "logs".into(),
            ..RealWorld::default()
        },
        parameters: trace::parameters_of(parameters, None, &found.posterior, None),
        wall_s,
        physics_steps: found.physics_steps,
        versions: vec![
            NamedText {
                name: "asid".into(),
                value: env!("CARGO_PKG_VERSION").into(),
            },
            NamedText {
                name: "engine".into(),
                value: subject.engine(),
            },
        ],
        command: run::command_line(),
        files: trace::files(&[
            ("result.json", "the figures"),
            (
                "refined.toml",
                "the model with the fitted values, for a study's `model` and `asid export`",
            ),
            ("posterior.json", "the posterior"),
            ("config.toml", "all settings, for `--config`"),
            ("trace.json", "the data of this report"),
        ]),
        ..RunReport::default()
    }
}
