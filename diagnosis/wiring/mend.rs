//! Corrects the wiring of a study as its logs show it, with the lines for the study file.

use asid_core::parameter::Scale;
use asid_core::{Layout, Parameter, Result, Target};
use asid_logs::episode::{ColumnMapping, angles, remapped};
use asid_mjcf::Plant;
use asid_mjcf::plant::DriveLaw;

use crate::machine::Machine;
use crate::result::WiringResult;
use crate::study::Study;

use super::evidence::Settings;
use super::hypotheses::{Fault, LATEST, Quantity, quantities, view_of};
use super::record::Recorded;
use super::search::{Found, Outcome, Search};
use super::some_logs::{OfSomeLogs, of_some_logs};
use super::view::{View, mapping};
use super::windows::{FEW, WINDOWS, Windows};

/// A study after the check of its wiring.
pub struct Mended {
    /// The study with the mappings applied to its logs.
    pub study: Study,
    /// The faults that were found.
    pub wiring: Vec<WiringResult>,
    /// The mappings that correct it, for the columns as the study reads them.
    pub mappings: Vec<ColumnMapping>,
    /// Whether all faults are in doubt: each one resembles effects or is uncertain.
    pub doubted: bool,
    /// Logarithm of the factor by which each fault shrinks the misses of predictions, summed over
    /// columns.
    pub shrinkage: Vec<f64>,
    /// The most likely fault that is not named.
    pub nearest: Option<Nearest>,
    /// Fault of some logs alone, which is not corrected.
    pub apart: Option<OfSomeLogs>,
}

/// A fault that is not named.
#[derive(Clone, Debug)]
pub struct Nearest {
    /// Kind.
    pub fault: &'static str,
    /// Columns.
    pub columns: Vec<String>,
    /// See [`Mended::shrinkage`].
    pub shrinkage: f64,
}

/// Sensors that some of the logs read, in the scene's order.
fn logged(study: &Study, machine: &Machine) -> Vec<String> {
    let reads = |name: &str| {
        study.train.iter().any(|(_, e)| {
            e.channel(name).is_some_and(|r| {
                (0..e.rows()).any(|k| e.reading(k)[r.clone()].iter().any(|x| x.is_finite()))
            })
        })
    };
    let sensors = machine.plant.layout.sensors.iter();
    sensors
        .filter(|s| reads(&s.name))
        .map(|s| s.name.clone())
        .collect()
}

/// Checks the wiring of a study's logs, and reads them with what it found.
///
/// # Errors
/// When the engine fails.
pub fn mend(study: &Study, machine: &Machine, settings: &Settings) -> Result<Mended> {
    let unchanged = || Mended {
        study: study.clone(),
        wiring: Vec::new(),
        mappings: Vec::new(),
        doubted: false,
        shrinkage: Vec::new(),
        nearest: None,
        apart: None,
    };
    let layout = &machine.plant.layout;
    let sensors = logged(study, machine);
    let record = study
        .train
        .iter()
        .map(|(_, e)| Recorded::of(layout, &sensors, e))
        .collect::<Result<Vec<_>>>()?;
    let windows = |count| Windows::new(machine, &record, (&sensors, &study.parameters), count);
    let (Some(few), Some(many)) = (windows(FEW)?, windows(WINDOWS)?) else {
        return Ok(unchanged());
    };
    let all = quantities(&machine.plant, &sensors);
    let dampings = dampings(machine, &study.parameters)?;
    let with_damping = [&study.parameters[..], &dampings].concat();
    let damped = if dampings.is_empty() {
        None
    } else {
        Windows::new(machine, &record, (&sensors, &with_damping), WINDOWS)?
    };
    let search = Search {
        few,
        all: many,
        damped,
        record: &record,
        quantities: &all,
        settings,
    };
    let Outcome { found, view, next } = search.run()?;
    let nearest = next.map(|n| Nearest {
        fault: n.fault.name(),
        columns: n.quantities.iter().map(|&q| all[q].name.clone()).collect(),
        shrinkage: n.shrinkage,
    });
    let apart = of_some_logs(study, machine, (&sensors, &all), (&view, settings))?;
    if found.is_empty() {
        return Ok(Mended {
            nearest,
            apart,
            ..unchanged()
        });
    }
    let mappings = mappings(&all, &view);
    let mut mended = study.clone();
    apply(&mut mended, layout, &mappings)?;
    let mut wiring: Vec<WiringResult> = found
        .iter()
        .map(|f| WiringResult {
            fault: f.fault.name().to_owned(),
            columns: match f.fault {
                Fault::Clock => sensors.clone(),
                _ => f.quantities.iter().map(|&q| all[q].name.clone()).collect(),
            },
            probability: f.probability,
            mend: String::new(),
        })
        .collect();
    write_lines(&mut wiring, study, layout, &mappings);
    let in_doubt = |f: &Found| f.fault.is_imitable() || f.probability < settings.certain;
    Ok(Mended {
        study: mended,
        wiring,
        mappings,
        doubted: found.iter().all(in_doubt),
        shrinkage: found.iter().map(|f| f.shrinkage).collect(),
        nearest,
        apart,
    })
}

/// The damping of each joint that a position servo drives, as a parameter.
///
/// Its range begins at the model's damping and ends where the servo lags as much as the latest
/// clock. Excluded are those among the study's own `parameters`, and those that the engine does not
/// set.
fn dampings(machine: &Machine, parameters: &[Parameter]) -> Result<Vec<Parameter>> {
    let layout = &machine.plant.layout;
    let model = machine.with(&[])?;
    let mut found: Vec<Parameter> = Vec::new();
    for drive in machine.plant.drives.iter().flatten() {
        let DriveLaw::Position { kp, .. } = drive.law else {
            continue;
        };
        let target = Target {
            element: "joint".into(),
            name: layout.joints[drive.joint].name.clone(),
            attribute: "damping".into(),
            index: 0,
        };
        let Ok(given) = model.nominal(&target) else {
            continue;
        };
        let lags = kp * drive.gear * drive.gear * LATEST;
        let mut before = parameters.iter().chain(&found);
        if lags > 0.0 && !before.any(|p| p.targets.contains(&target)) {
            found.push(Parameter {
                name: format!("damping of {}", target.name),
                targets: vec![target],
                range: [given, given + lags],
                scale: Scale::Linear,
                unit: String::new(),
            });
        }
    }
    Ok(found)
}

/// Reads the logs of a study with further mappings.
///
/// # Errors
/// When a mapping does not fit the logs.
pub fn apply(study: &mut Study, layout: &Layout, mappings: &[ColumnMapping]) -> Result<()> {
    let angles = angles(&Plant::of(&study.scene)?, &[]);
    for (_, episode) in study.train.iter_mut().chain(&mut study.test) {
        *episode = remapped(episode, layout, (mappings, &angles))?;
    }
    Ok(())
}

/// Sets the lines for the study file in each fault: those of the mappings that concern its columns.
///
/// A mapping has the corrections of all faults of its column. It is written once, with the first of
/// them. A clock concerns every sensor, so its turn is last.
pub fn write_lines(
    wiring: &mut [WiringResult],
    study: &Study,
    layout: &Layout,
    mappings: &[ColumnMapping],
) {
    let mut faults: Vec<&mut WiringResult> = wiring.iter_mut().collect();
    faults.sort_by_key(|f| f.fault == Fault::Clock.name());
    let mut left: Vec<&ColumnMapping> = mappings.iter().collect();
    for fault in faults {
        let (own, others): (Vec<_>, Vec<_>) = left
            .into_iter()
            .partition(|m| concerns_any(m, &fault.columns));
        left = others;
        let composed = own.into_iter().flat_map(|m| study.composed(m, layout));
        let lines: Vec<String> = composed.map(|m| m.lines()).collect();
        fault.mend = lines.join("\n");
    }
}

/// Whether a mapping concerns any of these columns.
pub fn concerns_any(mapping: &ColumnMapping, columns: &[String]) -> bool {
    columns.iter().any(|c| concerns(mapping, c))
}

/// Whether a mapping concerns a column, one of its entries, or the vector that it belongs to.
fn concerns(mapping: &ColumnMapping, column: &str) -> bool {
    let entry = |of: &str, vector: &str| {
        of.strip_prefix(vector)
            .and_then(|rest| rest.strip_prefix('.'))
            .is_some_and(|i| i.parse::<usize>().is_ok())
    };
    mapping.name == column || entry(&mapping.name, column) || entry(column, &mapping.name)
}

/// Mappings of a view: one for each quantity that changes, or one for a vector whose entries change
/// alike.
fn mappings(all: &[Quantity], view: &View) -> Vec<ColumnMapping> {
    let names = |command: bool| -> Vec<String> {
        let own = all.iter().filter(|q| q.command == command);
        own.map(|q| q.name.clone()).collect()
    };
    let (readings, commands) = (names(false), names(true));
    let mut found: Vec<ColumnMapping> = Vec::new();
    for vector in all.chunk_by(|a, b| a.whole == b.whole && a.command == b.command) {
        let entries = vector.iter().filter_map(|q| {
            let columns = if q.command { &commands } else { &readings };
            mapping(&q.name, q.place, view_of(view, q), columns, &q.units)
        });
        let entries: Vec<ColumnMapping> = entries.collect();
        let whole = |m: &ColumnMapping| ColumnMapping {
            name: vector[0].whole.clone(),
            ..m.clone()
        };
        let alike = entries.len() == vector.len()
            && entries
                .iter()
                .all(|m| m.from.is_none() && whole(m) == whole(&entries[0]));
        if alike {
            found.push(whole(&entries[0]));
        } else {
            found.extend(entries);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::tests::study;

    /// Symptom: pasted into the study file, the lines of the diagnosis were refused, since two
    /// `[[column]]` had one name. An import wrote the delay of a clock into a single column.
    ///
    /// Cause: each fault had all lines of its columns, and a clock has the columns of all others.
    #[test]
    fn the_lines_of_two_faults_of_a_column_are_one_study_file() {
        let folder = tempfile::tempdir().unwrap();
        let study = study(folder.path(), &[]);
        let layout = asid_mjcf::Plant::of(&study.scene).unwrap().layout;
        let late = |name: &str, sign: f64| ColumnMapping {
            sign,
            delay: 0.06,
            ..ColumnMapping::of(name)
        };
        let mappings = [late("q", -1.0), late("tip", 1.0)];
        let fault = |fault: Fault, columns: &[&str]| WiringResult {
            fault: fault.name().into(),
            columns: columns.iter().map(|c| (*c).to_owned()).collect(),
            ..WiringResult::default()
        };
        let [clock, sign] = [
            fault(Fault::Clock, &["q", "tip"]),
            fault(Fault::Sign, &["q"]),
        ];
        for mut wiring in [[clock.clone(), sign.clone()], [sign, clock]] {
            write_lines(&mut wiring, &study, &layout, &mappings);
            let of = |kind: Fault| wiring.iter().find(|w| w.fault == kind.name()).unwrap();
            assert_eq!(of(Fault::Sign).mend, mappings[0].lines());
            assert_eq!(of(Fault::Clock).mend, mappings[1].lines());
        }
    }
}
