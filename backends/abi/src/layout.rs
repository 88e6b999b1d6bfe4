//! Names and indices across the ABI.

use std::ffi::{CString, c_char};

use asid_core::layout::{Actuator, Joint, JointKind, Keyframe, Layout, Sensor, sensor_len};
use asid_core::{Error, Result};

use crate::slices::read;
use crate::table::{self, joint_kind};
use crate::text;

/// Reads an engine's layout and checks its consistency.
///
/// # Errors
/// What is missing or does not fit.
///
/// # Safety
/// `layout` points to a structure as the header describes it.
pub unsafe fn decode(layout: *const table::Layout) -> Result<Layout> {
    // SAFETY: as the caller promises; its size comes first in every version.
    let size = unsafe { (*layout).size };
    if usize::try_from(size).unwrap_or(0) < size_of::<table::Layout>() {
        return Err(Error::Failed(format!("its `size` is {size} bytes")));
    }
    // SAFETY: large enough, as just seen.
    let layout = unsafe { &*layout };
    if !(layout.timestep.is_finite() && layout.timestep > 0.0) {
        return Err(Error::Failed(format!(
            "the time step is {}",
            layout.timestep
        )));
    }
    // SAFETY: for this and the other lists, the header promises `n` entries, and
    // zero-terminated names in them.
    let names = |list: *const *const c_char, n: u64, what: &str| unsafe {
        read(list, n, what)?
            .iter()
            .map(|&name| text::read(name, what))
            .collect::<Result<Vec<String>>>()
    };
    let bodies = names(layout.bodies, layout.nbody, "a body's name")?;
    if bodies.first().map(String::as_str) != Some("world") {
        return Err(Error::Failed("its first body is not `world`".into()));
    }
    let geoms = names(layout.geoms, layout.ngeom, "a geom's name")?;
    // SAFETY: see above.
    let (joints, [nq, nv]) = unsafe { decode_joints(layout)? };
    let mut actuators = Vec::new();
    // SAFETY: see above.
    for actuator in unsafe { read(layout.actuators, layout.nactuator, "the actuators")? } {
        actuators.push(Actuator {
            // SAFETY: see above.
            name: unsafe { text::read(actuator.name, "an actuator's name")? },
            ctrl_range: (actuator.ctrl_limited != 0).then_some(actuator.ctrl_range),
        });
    }
    // SAFETY: see above.
    let sensors = unsafe { decode_sensors(layout)? };
    let mut keyframes = Vec::new();
    // SAFETY: see above.
    for key in unsafe { read(layout.keyframes, layout.nkeyframe, "the keyframes")? } {
        // SAFETY: a keyframe has `nq`, `nv` and `nu` numbers.
        let row = |numbers, n: usize| unsafe { read(numbers, n as u64, "a keyframe") };
        keyframes.push(Keyframe {
            // SAFETY: see above.
            name: unsafe { text::read(key.name, "a keyframe's name")? },
            qpos: row(key.qpos, nq)?.to_vec(),
            qvel: row(key.qvel, nv)?.to_vec(),
            ctrl: row(key.ctrl, actuators.len())?.to_vec(),
        });
    }
    Ok(Layout {
        timestep: layout.timestep,
        nq,
        nv,
        bodies,
        geoms,
        joints,
        actuators,
        sensors,
        keyframes,
    })
}

/// The joints, and the total numbers of their positions and velocities.
///
/// # Safety
/// As for [`decode`].
unsafe fn decode_joints(layout: &table::Layout) -> Result<(Vec<Joint>, [usize; 2])> {
    let (mut nq, mut nv) = (0, 0);
    let mut joints = Vec::new();
    // SAFETY: as the caller promises.
    for joint in unsafe { read(layout.joints, layout.njoint, "the joints")? } {
        let kind = match joint.kind {
            joint_kind::FREE => JointKind::Free,
            joint_kind::BALL => JointKind::Ball,
            joint_kind::HINGE => JointKind::Hinge,
            joint_kind::SLIDE => JointKind::Slide,
            other => return Err(Error::Failed(format!("a joint is of kind {other}"))),
        };
        joints.push(Joint {
            // SAFETY: as the caller promises.
            name: unsafe { text::read(joint.name, "a joint's name")? },
            // SAFETY: as the caller promises.
            body: unsafe { text::read(joint.body, "a joint's body")? },
            kind,
            qpos: nq,
            qvel: nv,
        });
        nq += kind.qpos_len();
        nv += kind.qvel_len();
    }
    Ok((joints, [nq, nv]))
}

/// The sensors, in order.
///
/// # Safety
/// As for [`decode`].
unsafe fn decode_sensors(layout: &table::Layout) -> Result<Vec<Sensor>> {
    let mut sensors = Vec::new();
    let mut address = 0;
    // SAFETY: as the caller promises.
    for sensor in unsafe { read(layout.sensors, layout.nsensor, "the sensors")? } {
        // SAFETY: as the caller promises.
        let (name, kind) = unsafe {
            (
                text::read(sensor.name, "a sensor's name")?,
                text::read(sensor.kind, "a sensor's kind")?,
            )
        };
        let len = sensor_len(&kind);
        if sensor.length != len as u64 {
            return Err(Error::Failed(format!(
                "sensor `{name}` ({kind}) has {} entries where {len} are right",
                sensor.length
            )));
        }
        sensors.push(Sensor {
            name,
            kind,
            address,
            len,
        });
        address += len;
    }
    Ok(sensors)
}

/// A layout in the form for the other side; owns everything that the structure points to.
pub struct LayoutTable {
    table: table::Layout,
    // The targets of `table`'s pointers; vectors and strings keep their place on the heap.
    _names: Vec<CString>,
    _lists: [Vec<*const c_char>; 2],
    _joints: Vec<table::LayoutJoint>,
    _actuators: Vec<table::LayoutActuator>,
    _sensors: Vec<table::LayoutSensor>,
    _keyframes: Vec<table::Keyframe>,
    _numbers: Vec<Vec<f64>>,
}

// SAFETY: everything that the pointers lead to is owned by the value and never changes once it is
// made.
unsafe impl Send for LayoutTable {}
// SAFETY: as above.
unsafe impl Sync for LayoutTable {}

impl LayoutTable {
    /// Writes a layout.
    #[must_use]
    pub fn new(layout: &Layout) -> Self {
        let mut names: Vec<CString> = Vec::new();
        let mut name = |text: &str| {
            // Take the address where the string stays: moving a box invalidates what was borrowed
            // from it.
            names.push(text::owned(text));
            names.last().map_or(std::ptr::null(), |n| n.as_ptr())
        };
        let bodies: Vec<_> = layout.bodies.iter().map(|n| name(n)).collect();
        let geoms: Vec<_> = layout.geoms.iter().map(|n| name(n)).collect();
        let joints: Vec<_> = layout
            .joints
            .iter()
            .map(|j| table::LayoutJoint {
                name: name(&j.name),
                body: name(&j.body),
                kind: match j.kind {
                    JointKind::Free => joint_kind::FREE,
                    JointKind::Ball => joint_kind::BALL,
                    JointKind::Hinge => joint_kind::HINGE,
                    JointKind::Slide => joint_kind::SLIDE,
                },
                padding: 0,
            })
            .collect();
        let actuators: Vec<_> = layout
            .actuators
            .iter()
            .map(|a| table::LayoutActuator {
                name: name(&a.name),
                ctrl_limited: i32::from(a.ctrl_range.is_some()),
                padding: 0,
                ctrl_range: a.ctrl_range.unwrap_or_default(),
            })
            .collect();
        let sensors: Vec<_> = layout
            .sensors
            .iter()
            .map(|s| table::LayoutSensor {
                name: name(&s.name),
                kind: name(&s.kind),
                length: s.len as u64,
            })
            .collect();
        let mut numbers = Vec::new();
        let mut row = |values: &[f64]| {
            let values = values.to_vec();
            let pointer = values.as_ptr();
            numbers.push(values);
            pointer
        };
        let keyframes: Vec<_> = layout
            .keyframes
            .iter()
            .map(|k| table::Keyframe {
                name: name(&k.name),
                qpos: row(&k.qpos),
                qvel: row(&k.qvel),
                ctrl: row(&k.ctrl),
            })
            .collect();
        Self {
            table: table::Layout {
                size: size_of::<table::Layout>() as u64,
                timestep: layout.timestep,
                nbody: bodies.len() as u64,
                bodies: bodies.as_ptr(),
                ngeom: geoms.len() as u64,
                geoms: geoms.as_ptr(),
                njoint: joints.len() as u64,
                joints: joints.as_ptr(),
                nactuator: actuators.len() as u64,
                actuators: actuators.as_ptr(),
                nsensor: sensors.len() as u64,
                sensors: sensors.as_ptr(),
                nkeyframe: keyframes.len() as u64,
                keyframes: keyframes.as_ptr(),
            },
            _names: names,
            _lists: [bodies, geoms],
            _joints: joints,
            _actuators: actuators,
            _sensors: sensors,
            _keyframes: keyframes,
            _numbers: numbers,
        }
    }

    /// The structure; its pointers are valid as long as `self` lives.
    #[must_use]
    pub fn table(&self) -> &table::Layout {
        &self.table
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> Layout {
        Layout {
            timestep: 0.002,
            nq: 8,
            nv: 7,
            bodies: vec!["world".into(), "arm".into(), "ball".into()],
            geoms: vec!["geom0".into()],
            joints: vec![
                Joint {
                    name: "hinge".into(),
                    kind: JointKind::Hinge,
                    body: "arm".into(),
                    qpos: 0,
                    qvel: 0,
                },
                Joint {
                    name: "joint1".into(),
                    kind: JointKind::Free,
                    body: "ball".into(),
                    qpos: 1,
                    qvel: 1,
                },
            ],
            actuators: vec![Actuator {
                name: "servo".into(),
                ctrl_range: Some([-1.0, 1.0]),
            }],
            sensors: vec![Sensor {
                name: "where".into(),
                kind: "framepos".into(),
                address: 0,
                len: 3,
            }],
            keyframes: vec![Keyframe {
                name: "home".into(),
                qpos: vec![0.5; 8],
                qvel: vec![0.0; 7],
                ctrl: vec![0.1],
            }],
        }
    }

    #[test]
    fn layouts_survive() {
        let layout = example();
        let table = LayoutTable::new(&layout);
        // SAFETY: the structure was just made.
        assert_eq!(unsafe { decode(table.table()) }.unwrap(), layout);
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let mut layout = example();
        layout.sensors[0].len = 2;
        let table = LayoutTable::new(&layout);
        // SAFETY: the structure was just made.
        let error = unsafe { decode(table.table()) }.unwrap_err().to_string();
        assert_eq!(
            error,
            "sensor `where` (framepos) has 2 entries where 3 are right"
        );

        let table = LayoutTable::new(&example());
        let mut broken = *table.table();
        broken.joints = std::ptr::null();
        // SAFETY: null is what is being checked.
        let error = unsafe { decode(&broken) }.unwrap_err().to_string();
        assert_eq!(error, "the joints: 2 entries at NULL");
        broken.size = 8;
        // SAFETY: as above.
        assert!(unsafe { decode(&broken) }.is_err());
    }
}
