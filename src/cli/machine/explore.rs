//! `asid explore STUDY`: the most informative motion of any machine, as a command file.

mod unknown;

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use asid_algorithms::fisher::Objective;
use asid_core::Episode;
use asid_core::posterior::Direction;
use asid_core::signal::Signal;
use asid_report::number::significant;
use asid_sysid::design::{Designed, Designer};
use asid_sysid::method::Method;
use serde::Serialize;

use super::motion_config::Config;
use super::setup::Setup;
use super::{Subject, motion_page, sensors};
use crate::cli::options::Common;
use crate::cli::output::{OutFolder, write_json, write_text};
use crate::cli::progress::Bars;
use crate::cli::result::{CostResult, SCHEMA, figure};
use crate::cli::{failure, interrupt, view};
use unknown::{UnknownResult, unknown_results};

/// `result.json`.
#[derive(Serialize, schemars::JsonSchema)]
#[schemars(rename = "Motion")]
pub struct ExploreResult {
    pub schema: u32,
    pub machine: String,
    pub backend: String,
    pub engine: String,
    pub explorer: &'static str,
    pub objective: &'static str,
    pub seed: u64,
    pub seconds: f64,
    pub period: f64,
    pub unknowns: Vec<UnknownResult>,
    pub nuisance: Vec<String>,
    /// Combinations that neither logs nor motion see.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unseen: Vec<Direction>,
    /// Precision, relative to the value, that the repeats are counted for.
    pub precision: f64,
    /// Factor by which the motion was made smaller to keep all limits.
    pub scale: f64,
    /// The limit that a motion larger by a quarter would break.
    pub next_limit: Option<String>,
    /// What is broken where nothing could be kept; null where all limits hold.
    pub broken: Option<String>,
    pub noise: BTreeMap<String, f64>,
    pub notes: Vec<String>,
    pub cost: CostResult,
}

/// Designs a motion and writes it.
pub fn explore(
    (path, model): (&Path, Option<&Path>),
    common: &Common,
    given: &super::motion_config::Options,
) -> Result<()> {
    let clock = Instant::now();
    let mut config = Config::resolve(path, common, given)?;
    config.model = model.map(Path::to_path_buf).or(config.model);
    let mut notes = Vec::new();
    let engine = config.backend.as_deref();
    let subject = Subject::open_with(path, engine, config.model.as_deref())?;
    let subject = sensors::with_sensors(subject, &mut notes)?;
    let mut setup = Setup::new(&subject, &config, common.threads.unwrap_or(0))
        .map_err(|e| subject.as_written(e))?;
    notes.append(&mut setup.notes);
    let method = Method::named(&config.explorer)?;
    let objective: Objective = config.objective.parse()?;
    let out = OutFolder::claim(common.out.as_deref(), &format!("{}-explore", subject.name))?;
    interrupt::watch(&format!("the search for a motion of {}", subject.name))?;
    let bars = Bars::new(common.quiet);
    let found = setup
        .design(&config, method, config.seed, &bars)
        .map_err(|e| subject.as_written(e))?;
    setup.refuse_standstill(&found)?;
    let period = setup.period();
    let frames = found.commands.len() / setup.base.len().max(1);
    let (unknowns, nuisance) = setup.parameters.split_at(setup.sought);
    let broken = found.excess.worst.as_ref().map(|(what, _)| what.clone());
    let rows = unknown_results(
        unknowns,
        &setup.values,
        subject.study.as_ref().map(|_| &setup.known),
        &found,
        config.precision,
    );
    let names: Vec<String> = unknowns.iter().map(|p| p.name.clone()).collect();
    let result = ExploreResult {
        schema: SCHEMA,
        machine: subject.name.clone(),
        backend: subject.backend.name().to_owned(),
        engine: subject.engine(),
        explorer: method.name(),
        objective: objective.name(),
        seed: config.seed,
        seconds: frames as f64 * period,
        period,
        unknowns: rows,
        nuisance: nuisance.iter().map(|p| p.name.clone()).collect(),
        unseen: found.told.and(1.0, &setup.known).unseen(&names),
        precision: config.precision,
        scale: found.scale,
        next_limit: found.next_limit.clone(),
        broken,
        noise: setup
            .signals
            .iter()
            .map(|s| (s.sensor.clone(), s.noise))
            .collect(),
        notes,
        cost: CostResult {
            wall_s: clock.elapsed().as_secs_f64(),
            physics_steps: setup.player.steps(),
            env_steps: 0,
        },
    };
    let view = view::of_motion(&subject, &found.played.qpos, period)?;
    let page = motion_page::page(
        &result,
        &subject,
        &found,
        setup.player.limits(),
        view.as_ref(),
    );
    out.write(|folder| {
        write_json(&folder.join("result.json"), &result)?;
        write_text(&folder.join("config.toml"), &toml::to_string(&config)?)?;
        Episode::of_commands(&subject.plant.layout, found.commands.clone(), period)
            .write_csv(&folder.join("commands.csv"))?;
        predicted(&subject, &found, &setup.signals, period)
            .write_csv(&folder.join("predicted.csv"))?;
        write_text(&folder.join("report.html"), &page)?;
        if !subject.source.scene.xml().contains("file=") {
            write_text(&folder.join("model.xml"), subject.source.scene.xml())?;
        }
        Ok(())
    })?;
    out.tell(common.json, &result, &lines(&result))?;
    if let Some(what) = &result.broken {
        failure::warn(&format!(
            "no motion of this kind keeps all limits, not even the smallest: {what}; do not play it, and look at the limits \
             and at the posture that it begins in"
        ));
    }
    Ok(())
}

/// The log that the simulator expects, without noise. Its first row is the first recorded one.
fn predicted(subject: &Subject, found: &Designed, signals: &[Signal], period: f64) -> Episode {
    let layout = &subject.plant.layout;
    let mut episode = Episode::of_commands(layout, found.commands.clone(), period);
    let channels = signals.iter().filter_map(|s| layout.sensor(&s.sensor).ok());
    episode.channels = channels
        .map(|s| asid_core::episode::ChannelColumns {
            name: s.name.clone(),
            len: s.len,
        })
        .collect();
    let width = episode.width();
    let missing = vec![f64::NAN; width];
    episode.readings = [missing, found.played.readings.clone()].concat();
    episode
        .readings
        .resize(episode.time.len() * width, f64::NAN);
    episode
}

/// Text of a deviation relative to its reference.
pub fn relative(deviation: f64, reference: f64) -> String {
    if reference == 0.0 {
        figure(deviation)
    } else {
        let percent = 100.0 * deviation / reference.abs();
        format!("{} %", significant(percent, 2))
    }
}

/// Text on an unknown before and after the motion, with the repeats needed for `wanted` percent.
fn told(u: &UnknownResult, wanted: f64) -> String {
    let to = |deviation: f64| relative(deviation, u.reference);
    let of = if u.value == 0.0 {
        " of half the width of its range"
    } else {
        " of its value"
    };
    let known = match (u.logs, u.both) {
        (Some(logs), Some(both)) => format!(
            "your logs so far tell it to {}{of}, one play of this motion to {}, both to {}",
            to(logs),
            to(u.motion),
            to(both)
        ),
        _ => format!(
            "the prior tells it to {}{of}, one play of this motion to {}",
            to(u.prior),
            to(u.motion)
        ),
    };
    let by_range = u.prior <= 0.01 * wanted * u.reference;
    let enough = match u.repeats {
        Some(0) if u.logs.is_none() || by_range => "its range is narrow enough".to_owned(),
        Some(0) => "your logs are enough".to_owned(),
        Some(1) => "one play is enough".to_owned(),
        Some(n) => format!("it takes {n} plays"),
        None => "no number of plays is enough".to_owned(),
    };
    format!("{}: {known}; {enough} for the wanted {wanted:.1} %", u.name)
}

/// Text on how contact limits what the motion tells of an unknown; `None` where it does not.
fn limited(u: &UnknownResult) -> Option<String> {
    let by_slopes = relative(u.by_slopes?, u.reference);
    Some(format!(
        "{}: contact limits it. Slopes alone would promise {by_slopes}, but a contact that comes a time step earlier makes readings jump, \
         and no identification finds a value by jumps",
        u.name
    ))
}

/// The answer on the terminal.
pub fn lines(result: &ExploreResult) -> Vec<String> {
    let mut all = Vec::new();
    all.extend(
        result
            .unknowns
            .iter()
            .map(|u| told(u, 100.0 * result.precision)),
    );
    all.extend(result.unknowns.iter().filter_map(limited));
    for direction in &result.unseen {
        let parts: Vec<String> = direction
            .weights
            .iter()
            .map(|(n, w)| format!("{w:+.2} {n}"))
            .collect();
        all.push(format!(
            "stays unseen (in prior deviations): {}",
            parts.join(" ")
        ));
    }
    all.extend(result.notes.iter().cloned());
    all.push(match &result.broken {
        None => {
            let entries = result.unknowns.len() + result.nuisance.len();
            let mut line = format!("all limits hold, {}", Designer::checked_at(entries));
            if let Some(next) = &result.next_limit {
                line += &format!("; a motion larger by a quarter would break: {next}");
            }
            line
        }
        Some(what) => format!("LIMITS BROKEN: {what}"),
    });
    all.push(format!(
        "{} by {}, {:.1} s of motion, found in {:.0} s",
        result.objective, result.explorer, result.seconds, result.cost.wall_s
    ));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Symptom: "your logs are enough" of an unknown of a model without logs. Cause: no play was
    /// needed, and the words did not tell a narrow range from informative logs.
    #[test]
    fn a_range_within_the_precision_is_not_called_logs() {
        let scale = |prior: f64, logs: Option<f64>| UnknownResult {
            name: "body/link/mass".into(),
            unit: "kg".into(),
            value: 1.0,
            reference: 1.0,
            prior,
            logs,
            motion: 1e-3,
            by_slopes: None,
            both: logs,
            repeats: Some(0),
        };
        // The deviation of a uniform range of 0.99 to 1.01 is its width over the root of twelve.
        let narrow = 0.02 / 12.0_f64.sqrt();
        for u in [scale(narrow, None), scale(narrow, Some(narrow))] {
            let said = told(&u, 1.0);
            assert!(said.contains("its range is narrow enough"), "{said}");
        }
        let said = told(&scale(0.3, Some(narrow)), 1.0);
        assert!(said.contains("your logs are enough"), "{said}");
    }
}
