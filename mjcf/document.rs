//! The layout of a scene in MuJoCo's order, read from the parsed document.
//!
//! It serves engines that have no compiler of their own.

use mjcf_rs::Model;
use mjcf_rs::body::JointType;

use asid_core::error::{Error, Result};
use asid_core::layout::{Actuator, Joint, JointKind, Keyframe, Layout, Sensor, sensor_len};
use asid_core::scene::Scene;

/// Names and indices of a parsed scene.
///
/// # Errors
/// When a keyframe's lengths do not fit.
pub fn layout(scene: &Scene, model: &Model) -> Result<Layout> {
    let mut bodies = Vec::new();
    let mut geoms = Vec::new();
    let mut joints = Vec::new();
    let (mut nq, mut nv) = (0, 0);
    for (i, entry) in model.bodies.iter().enumerate() {
        let fallback = if i == 0 {
            "world".into()
        } else {
            format!("body{i}")
        };
        let name = if i == 0 {
            None
        } else {
            entry.body.name.clone()
        };
        let body = name.unwrap_or(fallback);
        for joint in &entry.body.joints {
            let kind = joint_kind(joint.type_);
            joints.push(Joint {
                name: joint
                    .name
                    .clone()
                    .unwrap_or(format!("joint{}", joints.len())),
                kind,
                body: body.clone(),
                qpos: nq,
                qvel: nv,
            });
            nq += kind.qpos_len();
            nv += kind.qvel_len();
        }
        for geom in &entry.body.geoms {
            geoms.push(geom.name.clone().unwrap_or(format!("geom{}", geoms.len())));
        }
        bodies.push(body);
    }
    let actuators = model.actuators.iter().enumerate().map(|(i, a)| {
        let range = range(a.ctrl_range);
        let limited = a
            .ctrl_limited
            .resolve(model.compiler.autolimits, range.is_some());
        Actuator {
            name: a.name.clone().unwrap_or(format!("actuator{i}")),
            ctrl_range: range.filter(|_| limited),
        }
    });
    let actuators: Vec<_> = actuators.collect();
    let mut address = 0;
    let sensors = model.sensors.iter().enumerate().map(|(i, s)| {
        let len = sensor_len(&s.kind);
        address += len;
        Sensor {
            name: s.name.clone().unwrap_or(format!("sensor{i}")),
            kind: s.kind.clone(),
            address: address - len,
            len,
        }
    });
    let sensors = sensors.collect();
    let mut layout = Layout {
        timestep: model.option.timestep,
        nq,
        nv,
        bodies,
        geoms,
        joints,
        actuators,
        sensors,
        keyframes: Vec::new(),
    };
    layout.keyframes = keyframes(scene, model, &layout)?;
    Ok(layout)
}

/// The keyframes of a parsed scene, with every row complete and quaternions of length 1.
fn keyframes(scene: &Scene, model: &Model, layout: &Layout) -> Result<Vec<Keyframe>> {
    let default = default_qpos(model, layout);
    let quaternions = layout.quaternions();
    let mut keyframes = Vec::with_capacity(model.keyframes.len());
    for (i, key) in model.keyframes.iter().enumerate() {
        let name = key.name.clone().unwrap_or(format!("key{i}"));
        let fill = |values: &[f64], default: Vec<f64>, what: &str| {
            if values.is_empty() {
                Ok(default)
            } else if values.len() == default.len() {
                Ok(values.to_vec())
            } else {
                Err(Error::Scene {
                    scene: scene.name().to_owned(),
                    message: format!(
                        "keyframe `{name}` has {} {what} values where {} are needed",
                        values.len(),
                        default.len()
                    ),
                })
            }
        };
        let mut qpos = fill(&key.qpos, default.clone(), "qpos")?;
        for &at in &quaternions {
            normalise(&mut qpos[at..at + 4]);
        }
        keyframes.push(Keyframe {
            qpos,
            qvel: fill(&key.qvel, vec![0.0; layout.nv], "qvel")?,
            ctrl: fill(&key.ctrl, vec![0.0; layout.actuators.len()], "ctrl")?,
            name,
        });
    }
    Ok(keyframes)
}

/// Smallest length of a quaternion that has a direction, and largest difference of a length from 1
/// that is rounding; the same as MuJoCo's (`mjEPS`).
const ROUNDING: f64 = 1e-14;

/// Gives a quaternion w x y z length 1, as MuJoCo does with those of keyframes.
///
/// One without a direction becomes no rotation.
fn normalise(q: &mut [f64]) {
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length < ROUNDING {
        q.copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
    } else if (length - 1.0).abs() > ROUNDING {
        q.iter_mut().for_each(|x| *x /= length);
    }
}

/// The range of an actuator; `None` where its ends do not differ, such as `0 0`, which is no limit.
#[must_use]
pub fn range(stated: Option<[f64; 2]>) -> Option<[f64; 2]> {
    stated.filter(|[low, high]| low < high)
}

/// Whether a stiffness or damping has more coefficients than the linear one.
#[must_use]
pub fn is_of_higher_order(text: &str) -> bool {
    let mut higher = text.split_whitespace().skip(1);
    higher.any(|x| x.parse::<f64>() != Ok(0.0))
}

/// Kind of a joint of the document.
#[must_use]
pub fn joint_kind(kind: JointType) -> JointKind {
    match kind {
        JointType::Free => JointKind::Free,
        JointType::Ball => JointKind::Ball,
        JointType::Hinge => JointKind::Hinge,
        JointType::Slide => JointKind::Slide,
    }
}

/// MuJoCo's `qpos0`, length `nq`.
///
/// Free bodies have their declared pose, ball joints no rotation, and hinges and slides their
/// `ref`.
#[must_use]
pub fn default_qpos(model: &Model, layout: &Layout) -> Vec<f64> {
    let mut qpos = vec![0.0; layout.nq];
    let mut next = layout.joints.iter();
    for entry in &model.bodies {
        for joint in &entry.body.joints {
            let Some(place) = next.next() else { break };
            let q = &mut qpos[place.qpos..place.qpos + place.kind.qpos_len()];
            match place.kind {
                JointKind::Free => {
                    let (p, r) = (entry.body.pose.translation, entry.body.pose.rotation);
                    q.copy_from_slice(&[p.x, p.y, p.z, r.w, r.x, r.y, r.z]);
                }
                JointKind::Ball => q[0] = 1.0,
                JointKind::Hinge | JointKind::Slide => q[0] = joint.ref_,
            }
        }
    }
    qpos
}

#[cfg(test)]
mod tests {
    use super::*;
    use asid_core::simulator::{Control, ExternalForce, Rollout};

    /// Symptom: on engines without a compiler of their own, an episode began beside the pose of its
    /// keyframe. Cause: a quaternion such as 0.7 0 0 0.7 was passed on with its length of 0.99.
    #[test]
    fn quaternions_of_keyframes_have_length_one() {
        let xml = r#"<mujoco><worldbody><body><freejoint/><geom size="1"/></body>
            <body><joint type="ball"/><geom size="1"/></body></worldbody><keyframe>
            <key qpos="1 2 3 0.7 0 0 0.7 0 3 0 4"/><key qpos="0 0 0 0 0 0 0 1 0 0 0"/></keyframe></mujoco>"#;
        let scene = Scene::from_xml("keys", xml, &[]).unwrap();
        let layout = layout(&scene, &scene.description().unwrap()).unwrap();
        let half = 0.5f64.sqrt();
        let theory = [1.0, 2.0, 3.0, half, 0.0, 0.0, half, 0.0, 0.6, 0.0, 0.8];
        for (found, theory) in layout.keyframes[0].qpos.iter().zip(theory) {
            assert!((found - theory).abs() < 1e-15, "{found} for {theory}");
        }
        assert_eq!(layout.keyframes[1].qpos[3..7], [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn a_body_has_one_external_force() {
        let xml = r#"<mujoco><worldbody><body name="a"><freejoint/><geom size="1"/></body>
            <body name="b"><freejoint/><geom size="1"/></body></worldbody></mujoco>"#;
        let scene = Scene::from_xml("two", xml, &[]).unwrap();
        let layout = layout(&scene, &scene.description().unwrap()).unwrap();
        let record = layout.recording::<&str>(&[]).unwrap();
        let wrench = [1.0; 6];
        let check = |bodies: [usize; 2]| {
            let forces = bodies.map(|body| ExternalForce {
                body,
                wrench: &wrench,
            });
            let rollout = Rollout {
                forces: &forces,
                ..Rollout::new(&[0], 1, 1, Control::Shared(&[]), &record)
            };
            rollout.check(&layout, 1, 0, &[]).map_err(|e| e.to_string())
        };
        assert_eq!(check([1, 2]), Ok(()));
        assert_eq!(
            check([2, 2]),
            Err("external forces name body 2 twice".into())
        );
    }
}
