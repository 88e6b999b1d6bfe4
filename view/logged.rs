//! The positions of a machine in a log.

use asid_core::Episode;
use asid_core::layout::JointKind;
use asid_mjcf::Plant;
use asid_mjcf::plant::Reads;

/// Positions `qpos` at the rows of a log, `rows x nq`, and the joints without a sensor.
///
/// The latter take the values of `otherwise` (`rows x nq`), which a simulation of the same commands
/// gave. Between two readings of a slow sensor positions are interpolated. `None` where no sensor
/// reads any position.
#[must_use]
pub fn positions(
    plant: &Plant,
    log: &Episode,
    otherwise: &[f64],
) -> Option<(Vec<f64>, Vec<String>)> {
    let nq = plant.layout.nq;
    let mut qpos = otherwise.to_vec();
    let mut read = vec![false; plant.layout.joints.len()];
    for (sensor, reads) in plant.layout.sensors.iter().zip(&plant.sensors) {
        let Some(range) = log.channel(&sensor.name) else {
            continue;
        };
        let joint = match (*reads, &*sensor.kind) {
            (Reads::Joint(j), "jointpos") => Some((j, 0)),
            (Reads::Body(b), "framepos") => plant.free_joint(b).map(|j| (j, 0)),
            (Reads::Body(b), "framequat") => plant.free_joint(b).map(|j| (j, 3)),
            _ => None,
        };
        let Some((joint, offset)) = joint else {
            continue;
        };
        let place = &plant.layout.joints[joint];
        let fits = match (place.kind, offset) {
            (JointKind::Hinge | JointKind::Slide, 0) => range.len() == 1,
            (JointKind::Free, 0) => range.len() == 3,
            (JointKind::Free, _) => range.len() == 4,
            _ => false,
        };
        if !fits {
            continue;
        }
        let column =
            |c: usize| -> Vec<f64> { (0..log.rows()).map(|k| log.reading(k)[c]).collect() };
        let mut columns: Vec<Vec<f64>> = range.map(column).collect();
        if offset == 3 {
            bring_together(&mut columns);
        }
        for (i, readings) in columns.iter().enumerate() {
            let Some(filled) = filled(&log.time, readings) else {
                continue;
            };
            read[joint] = true;
            for (row, x) in qpos.chunks_exact_mut(nq).zip(filled) {
                row[place.qpos + offset + i] = x;
            }
        }
    }
    let unread = plant
        .layout
        .joints
        .iter()
        .zip(&read)
        .filter(|(_, read)| !**read);
    let unread = unread.map(|(j, _)| j.name.clone()).collect();
    read.contains(&true).then_some((qpos, unread))
}

/// A remark on joints without a sensor; `None` if there are none.
#[must_use]
pub fn remark(unread: &[String]) -> Option<String> {
    // Nobody reads more names than this.
    const NAMED: usize = 8;
    let (named, more) = unread.split_at(unread.len().min(NAMED));
    let more = match more.len() {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    (!unread.is_empty()).then(|| {
        format!(
            "No sensor of the log reads {}{more}: the machine as logged has the simulated position there.",
            named.join(", ")
        )
    })
}

/// Gives each quaternion, of four columns, the sign with which it lies nearer to the one before.
///
/// Both signs are the same orientation, but values between two of them are not. A quaternion with a
/// missing component is missing as a whole.
fn bring_together(columns: &mut [Vec<f64>]) {
    let rows = columns.first().map_or(0, Vec::len);
    let mut before: Option<usize> = None;
    for k in 0..rows {
        if columns.iter().any(|c| !c[k].is_finite()) {
            columns.iter_mut().for_each(|c| c[k] = f64::NAN);
            continue;
        }
        if let Some(before) = before
            && columns.iter().map(|c| c[before] * c[k]).sum::<f64>() < 0.0
        {
            columns.iter_mut().for_each(|c| c[k] = -c[k]);
        }
        before = Some(k);
    }
}

/// Readings with missing values interpolated, and held before the first and after the last; `None`
/// if there are none.
fn filled(time: &[f64], readings: &[f64]) -> Option<Vec<f64>> {
    let there: Vec<usize> = (0..readings.len())
        .filter(|&k| readings[k].is_finite())
        .collect();
    let (&first, &last) = (there.first()?, there.last()?);
    let mut next = 0;
    let at = (0..readings.len()).map(|k| {
        while next < there.len() && there[next] < k {
            next += 1;
        }
        if k <= first || k >= last {
            return readings[k.clamp(first, last)];
        }
        let (a, b) = (there[next - 1], there[next]);
        let share = (time[k] - time[a]) / (time[b] - time[a]);
        readings[a] + share * (readings[b] - readings[a])
    });
    Some(at.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::Scene;
    use asid_core::episode::ChannelColumns;

    #[test]
    fn sensors_say_where_the_machine_was_and_the_simulation_the_rest() {
        let xml = r#"<mujoco><worldbody><body><joint name="seen"/><geom size="1"/>
          <body><joint name="hidden"/><geom size="1"/></body></body></worldbody>
          <sensor><jointpos name="angle" joint="seen"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("two", xml, &[]).unwrap()).unwrap();
        let nan = f64::NAN;
        let mut log = Episode {
            time: vec![0.0, 1.0, 2.0, 4.0, 5.0],
            channels: vec![ChannelColumns {
                name: "angle".into(),
                len: 1,
            }],
            readings: vec![nan, 1.0, nan, 7.0, nan],
            ..Episode::default()
        };
        let (qpos, unread) = positions(&plant, &log, &[9.0; 10]).unwrap();
        assert_eq!(qpos, [1.0, 9.0, 1.0, 9.0, 3.0, 9.0, 7.0, 9.0, 7.0, 9.0]);
        assert_eq!(unread, ["hidden"]);
        log.readings.fill(nan);
        assert!(positions(&plant, &log, &[9.0; 10]).is_none());
    }

    /// Symptom: a body that turned half a turn was shown half a turn off between two readings of a
    /// slow tracker.
    ///
    /// Cause: each number of its quaternion was interpolated, across the change of sign of a
    /// tracker that gives `w >= 0`.
    #[test]
    fn an_orientation_is_interpolated_along_the_shorter_way() {
        let xml = r#"<mujoco><worldbody><body name="b"><freejoint/><geom size="1"/></body></worldbody>
          <sensor><framequat name="q" objtype="xbody" objname="b"/></sensor></mujoco>"#;
        let plant = Plant::of(&Scene::from_xml("free", xml, &[]).unwrap()).unwrap();
        // Turned about z by 178 degrees, then not read, then by 182 degrees.
        let [w, z] = [89.0_f64.to_radians().cos(), 89.0_f64.to_radians().sin()];
        let log = Episode {
            time: vec![0.0, 1.0, 2.0],
            channels: vec![ChannelColumns {
                name: "q".into(),
                len: 4,
            }],
            readings: [[w, 0.0, 0.0, z], [f64::NAN; 4], [w, 0.0, 0.0, -z]].concat(),
            ..Episode::default()
        };
        let (qpos, _) = positions(&plant, &log, &[0.0; 21]).unwrap();
        // Half a turn about z, up to the length of the quaternion.
        let between = &qpos[7 + 3..7 + 7];
        assert!(between[0].abs() < 1e-12, "{between:?}");
        assert!(between[3].abs() > 0.9, "{between:?}");
    }
}
