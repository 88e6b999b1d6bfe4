//! Tries the proposed mapping in the model.
//!
//! Sensors that some logs lack or that never change are reported. Faults that the wiring check
//! finds are corrected before the study is written.

use std::collections::BTreeMap;

use anyhow::Result;
use asid_core::Episode;
use asid_diagnosis::intake::{Absent, Unchanging, absent, pass_over};
use asid_diagnosis::machine::Machine;
use asid_diagnosis::study::Study;
use asid_diagnosis::wiring::{Settings, mend};
use asid_logs::RawLog;
use asid_logs::episode::ColumnMapping;
use asid_logs::propose::Proposal;
use serde::Deserialize;

use super::super::machine::Subject;
use super::super::session::backend;
use super::{Imported, episode};

/// A fault that may just as well be an effect, so it is left to the diagnosis.
const CLOCK: &str = "wiring-clock";

/// The lines that correct a fault.
#[derive(Deserialize)]
struct Lines {
    column: Vec<ColumnMapping>,
}

/// The episodes as a study.
pub(super) fn study(subject: &Subject, imported: &[Imported], proposal: &Proposal) -> Study {
    let source = &subject.source;
    let logs = |test: bool| -> Vec<(String, Episode)> {
        let own = imported.iter().filter(|i| i.test == test);
        let name = |i: &Imported| i.path.display().to_string();
        own.map(|i| (name(i), i.episode.clone())).collect()
    };
    Study {
        name: subject.name.clone(),
        model: subject.file.clone(),
        scene: source.scene.clone(),
        fixed: source.parameters.clone(),
        effects: source.effects.clone(),
        parameters: Vec::new(),
        train: logs(false),
        test: logs(true),
        noise: BTreeMap::new(),
        columns: proposal.mappings(),
        notes: Vec::new(),
        wired: false,
    }
}

/// Checks the sensors and the wiring of the episodes; `whole` is all logs as one.
///
/// Corrections go into the proposal and the episodes. Returns a sentence for each finding.
pub(super) fn look(
    subject: &Subject,
    imported: &mut [Imported],
    proposal: &mut Proposal,
    whole: &RawLog,
) -> Result<Vec<String>> {
    let source = &subject.source;
    let mut study = study(subject, imported, proposal);
    let machine = Machine::new(
        backend(subject.backend.name())?.into(),
        &source.scene,
        &source.parameters,
        &source.effects,
        0,
    )?;
    let sensors = subject.plant.layout.sensors.iter().map(|s| &*s.name);
    let mut said: Vec<String> = absent(&study, sensors).iter().map(Absent::line).collect();
    said.extend(
        pass_over(&mut study, &machine)?
            .iter()
            .map(Unchanging::line),
    );
    let mended = mend(&study, &machine, &Settings::default())?;
    let is_late = mended.wiring.iter().any(|fault| fault.fault == CLOCK);
    for fault in &mended.wiring {
        if fault.fault == CLOCK {
            said.push(format!(
                "tried in the model, readings are late against the commands (probability {:.2}): a clock or a delay of the \
                 machine, which is left to asid diagnose",
                fault.probability
            ));
            continue;
        }
        let lines = toml::from_str::<Lines>(&fault.mend).map_or_else(|_| Vec::new(), |l| l.column);
        let place = |m: &ColumnMapping| proposal.matches.iter().position(|f| f.name == m.name);
        let places: Option<Vec<usize>> = lines.iter().map(place).collect();
        let then = if places.is_some() {
            "the mapping has the lines that mend it"
        } else {
            "asid diagnose mends it and has the lines"
        };
        said.push(format!(
            "tried in the model, {} of {} is likely (probability {:.2}): {then}",
            fault.fault,
            fault.columns.join(", "),
            fault.probability
        ));
        for (place, mut mapping) in places.into_iter().flatten().zip(lines) {
            let found = &mut proposal.matches[place];
            // A clock is left to the diagnosis as a whole: all columns are late, or none.
            if is_late {
                mapping.delay = found.mapping.as_ref().map_or(0.0, |own| own.delay);
            }
            found
                .reasons
                .push(format!("tried in the model: {}", fault.fault));
            found.remap(mapping, whole);
        }
    }
    if !mended.wiring.is_empty() {
        let mappings = proposal.mappings();
        for one in imported {
            (one.episode, _) = episode(&one.path, &one.raw, &subject.plant, &mappings)?;
        }
    }
    Ok(said)
}
