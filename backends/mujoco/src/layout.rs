//! Names and indices of a compiled model.

use asid_core::layout::{Actuator, Joint, JointKind, Keyframe, Layout, Sensor};
use asid_core::{Error, Result};
use mujoco_rs::mujoco_c::{mjtDisableBit, mjtJoint, mjtSensor};
use mujoco_rs::wrappers::mj_model::{MjModel, MjtObjBase};

/// Reads the layout of a model compiled from the scene `name`.
///
/// # Errors
/// [`Error::Scene`] for actuators with several inputs or outputs, which do not fit a control row.
pub fn layout(name: &str, model: &MjModel) -> Result<Layout> {
    if model.nactuator() != model.nu() || model.nout() != model.nu() {
        return Err(Error::Scene {
            scene: name.to_owned(),
            message: "an actuator has several inputs or outputs; only actuators with one command and one force are supported".into(),
        });
    }
    let named = |kind, prefix: &str, id: usize| match model.id_to_name(kind, id) {
        Some(name) if !name.is_empty() => name.to_owned(),
        _ => format!("{prefix}{id}"),
    };
    let count = |n: i64| 0..usize::try_from(n).unwrap_or(0);
    let bodies: Vec<String> = count(model.nbody())
        .map(|i| match i {
            0 => "world".to_owned(),
            i => named(MjtObjBase::mjOBJ_BODY, "body", i),
        })
        .collect();
    let joints = count(model.njnt())
        .map(|i| Joint {
            name: named(MjtObjBase::mjOBJ_JOINT, "joint", i),
            kind: match model.jnt_type()[i] {
                mjtJoint::mjJNT_FREE => JointKind::Free,
                mjtJoint::mjJNT_BALL => JointKind::Ball,
                mjtJoint::mjJNT_SLIDE => JointKind::Slide,
                mjtJoint::mjJNT_HINGE => JointKind::Hinge,
            },
            body: bodies[model.jnt_bodyid()[i] as usize].clone(),
            qpos: model.jnt_qposadr()[i] as usize,
            qvel: model.jnt_dofadr()[i] as usize,
        })
        .collect();
    let clamps = model.opt().disableflags & mjtDisableBit::mjDSBL_CLAMPCTRL as i32 == 0;
    let actuators = count(model.nu())
        .map(|i| Actuator {
            name: named(MjtObjBase::mjOBJ_ACTUATOR, "actuator", i),
            ctrl_range: (clamps && model.actuator_ctrllimited()[i])
                .then(|| model.actuator_ctrlrange()[i]),
        })
        .collect();
    let sensors = count(model.nsensor())
        .map(|i| Sensor {
            name: named(MjtObjBase::mjOBJ_SENSOR, "sensor", i),
            kind: sensor_kind(model.sensor_type()[i]).to_owned(),
            address: model.sensor_adr()[i] as usize,
            len: model.sensor_dim()[i] as usize,
        })
        .collect();
    let (nq, nv, nu) = (
        model.nq() as usize,
        model.nv() as usize,
        model.nu() as usize,
    );
    let keyframes = count(model.nkey())
        .map(|i| Keyframe {
            name: named(MjtObjBase::mjOBJ_KEY, "key", i),
            qpos: key_row(model.key_qpos(), i, nq),
            qvel: key_row(model.key_qvel(), i, nv),
            ctrl: key_row(model.key_ctrl(), i, nu),
        })
        .collect();
    Ok(Layout {
        timestep: model.opt().timestep,
        nq,
        nv,
        geoms: count(model.ngeom())
            .map(|i| named(MjtObjBase::mjOBJ_GEOM, "geom", i))
            .collect(),
        bodies,
        joints,
        actuators,
        sensors,
        keyframes,
    })
}

fn key_row(all: &[f64], key: usize, len: usize) -> Vec<f64> {
    all[key * len..(key + 1) * len].to_vec()
}

/// The MJCF element of a sensor.
fn sensor_kind(kind: mjtSensor) -> &'static str {
    use mjtSensor as S;
    match kind {
        S::mjSENS_TOUCH => "touch",
        S::mjSENS_ACCELEROMETER => "accelerometer",
        S::mjSENS_VELOCIMETER => "velocimeter",
        S::mjSENS_GYRO => "gyro",
        S::mjSENS_FORCE => "force",
        S::mjSENS_TORQUE => "torque",
        S::mjSENS_MAGNETOMETER => "magnetometer",
        S::mjSENS_RANGEFINDER => "rangefinder",
        S::mjSENS_CAMPROJECTION => "camprojection",
        S::mjSENS_JOINTPOS => "jointpos",
        S::mjSENS_JOINTVEL => "jointvel",
        S::mjSENS_TENDONPOS => "tendonpos",
        S::mjSENS_TENDONVEL => "tendonvel",
        S::mjSENS_ACTUATORPOS => "actuatorpos",
        S::mjSENS_ACTUATORVEL => "actuatorvel",
        S::mjSENS_ACTUATORFRC => "actuatorfrc",
        S::mjSENS_JOINTACTFRC => "jointactuatorfrc",
        S::mjSENS_TENDONACTFRC => "tendonactuatorfrc",
        S::mjSENS_BALLQUAT => "ballquat",
        S::mjSENS_BALLANGVEL => "ballangvel",
        S::mjSENS_JOINTLIMITPOS => "jointlimitpos",
        S::mjSENS_JOINTLIMITVEL => "jointlimitvel",
        S::mjSENS_JOINTLIMITFRC => "jointlimitfrc",
        S::mjSENS_TENDONLIMITPOS => "tendonlimitpos",
        S::mjSENS_TENDONLIMITVEL => "tendonlimitvel",
        S::mjSENS_TENDONLIMITFRC => "tendonlimitfrc",
        S::mjSENS_FRAMEPOS => "framepos",
        S::mjSENS_FRAMEQUAT => "framequat",
        S::mjSENS_FRAMEXAXIS => "framexaxis",
        S::mjSENS_FRAMEYAXIS => "frameyaxis",
        S::mjSENS_FRAMEZAXIS => "framezaxis",
        S::mjSENS_FRAMELINVEL => "framelinvel",
        S::mjSENS_FRAMEANGVEL => "frameangvel",
        S::mjSENS_FRAMELINACC => "framelinacc",
        S::mjSENS_FRAMEANGACC => "frameangacc",
        S::mjSENS_SUBTREECOM => "subtreecom",
        S::mjSENS_SUBTREELINVEL => "subtreelinvel",
        S::mjSENS_SUBTREEANGMOM => "subtreeangmom",
        S::mjSENS_INSIDESITE => "insidesite",
        S::mjSENS_GEOMDIST => "distance",
        S::mjSENS_GEOMNORMAL => "normal",
        S::mjSENS_GEOMFROMTO => "fromto",
        S::mjSENS_CONTACT => "contact",
        S::mjSENS_E_POTENTIAL => "e_potential",
        S::mjSENS_E_KINETIC => "e_kinetic",
        S::mjSENS_CLOCK => "clock",
        S::mjSENS_TACTILE => "tactile",
        S::mjSENS_PLUGIN => "plugin",
        S::mjSENS_USER => "user",
    }
}
