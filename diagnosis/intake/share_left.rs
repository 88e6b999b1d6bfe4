//! How much of the residuals a corrected wiring leaves, before any fit.

use asid_core::Result;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

use super::Intake;
use super::estimated_short::place_of;
use super::open_loop::OpenLoop;
use crate::machine::Machine;
use crate::study::Study;

/// Residual power of the columns concerned with the corrected wiring, relative to that with the
/// wiring `as_given`.
///
/// It is taken from replays of the model as given. The geometric mean over the columns needs no
/// noise and weights them equally.
pub(super) fn share_left(intake: &Intake, as_given: &Study, machine: &Machine) -> Result<f64> {
    let [mended, given] = [&intake.study, as_given].map(|s| open_loop_power(s, machine));
    let (mended, given) = (mended?, given?);
    let sensors: Vec<&str> = mended.iter().map(|(name, _)| &**name).collect();
    let columns = || intake.wiring.iter().flat_map(|w| &w.columns);
    let concerned: Vec<Vec<bool>> = columns()
        .map(|column| shown_in(&machine.plant, column, &sensors))
        .collect();
    let pairs = mended.iter().zip(&given).enumerate();
    let own = pairs.filter(|(sensor, _)| concerned.iter().any(|c| c[*sensor]));
    let powers = own.map(|(_, ((_, m), (_, g)))| (*m, *g));
    let logs: Vec<f64> = powers
        .filter(|(m, g)| *m > 0.0 && *g > 0.0)
        .map(|(m, g)| (m / g).ln())
        .collect();
    Ok((logs.iter().sum::<f64>() / logs.len().max(1) as f64).exp())
}

/// Whether each sensor shows a fault of a column: its own, that of an entry, or a command of its
/// joint.
///
/// A command of a joint that no sensor reads shows in all of them.
fn shown_in(plant: &Plant, column: &str, sensors: &[&str]) -> Vec<bool> {
    let Some(actuator) = column.strip_prefix("ctrl.") else {
        let own = sensors.iter().map(|s| place_of(column, s).is_some());
        return own.collect();
    };
    let joint = plant.drive(actuator).ok().map(|(_, drive)| drive.joint);
    let reads = |sensor: &&str| {
        let place = plant.layout.sensors.iter().position(|s| s.name == **sensor);
        match place.map(|p| plant.sensors[p]) {
            Some(Reads::Joint(read)) => joint == Some(read),
            _ => false,
        }
    };
    let own: Vec<bool> = sensors.iter().map(reads).collect();
    if own.contains(&true) {
        own
    } else {
        vec![true; sensors.len()]
    }
}

/// Mean squared residual of each sensor's training readings in replays of the model as given, in
/// its unit squared.
fn open_loop_power(study: &Study, machine: &Machine) -> Result<Vec<(String, f64)>> {
    let replayed = OpenLoop::of(study, machine)?;
    let (logs, residuals) = (replayed.logs(), replayed.residuals());
    let of_sensor = |(sensor, name): (usize, String)| {
        let entries = logs.entries.iter().enumerate();
        let own = entries.filter(|(_, e)| e.sensor == sensor);
        let readings = own.flat_map(|(j, _)| {
            let each = residuals.iter();
            each.flat_map(move |r| r.iter().skip(j).step_by(logs.entries.len()))
        });
        let squares: Vec<f64> = readings.map(|r| r * r).filter(|p| p.is_finite()).collect();
        (
            name,
            squares.iter().sum::<f64>() / squares.len().max(1) as f64,
        )
    };
    let names = logs.sensors.iter().map(|s| s.name.clone());
    Ok(names.enumerate().map(of_sensor).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::tests::study;

    /// Symptom: logs with a doubted fault of a command or of an entry of a vector were always
    /// diagnosed as given first, however much the correction removes.
    ///
    /// Cause: their columns are no sensors by name, so that no power was compared.
    #[test]
    fn a_fault_of_an_entry_or_of_a_command_shows_in_sensors() {
        let folder = tempfile::tempdir().unwrap();
        let study = study(folder.path(), &[]);
        let plant = Plant::of(&study.scene).unwrap();
        let both = ["q", "tip"];
        assert_eq!(shown_in(&plant, "q", &both), [true, false]);
        assert_eq!(shown_in(&plant, "tip.1", &both), [false, true]);
        assert_eq!(shown_in(&plant, "ctrl.m", &both), [true, false]);
        assert_eq!(shown_in(&plant, "ctrl.m", &["tip"]), [true]);
    }
}
