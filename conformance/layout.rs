//! The layout that follows from a document alone, and the initial state of its keyframe.

use asid_core::layout::{Actuator, Joint, JointKind, Keyframe, Sensor};
use asid_core::{Backend, Capabilities, Layout, Result};

use crate::rig::{Rig, STEP, broken, largest, state_channels};
use crate::subject::GHOST;

/// A document of what an engine claims, with the expected layout and initial state.
struct Expected {
    inside: String,
    layout: Layout,
    qpos: Vec<f64>,
    qvel: Vec<f64>,
}

impl Expected {
    fn joint(&mut self, name: &str, kind: JointKind, body: &str, qpos: &[f64]) {
        let layout = &mut self.layout;
        layout.joints.push(Joint {
            name: name.into(),
            kind,
            body: body.into(),
            qpos: layout.nq,
            qvel: layout.nv,
        });
        layout.nq += kind.qpos_len();
        layout.nv += kind.qvel_len();
        self.qpos.extend(qpos);
        let next = self.qvel.len();
        self.qvel.extend((next..layout.nv).map(|i| 1.0 + i as f64));
    }

    fn sensor(&mut self, name: &str, kind: &str, len: usize) {
        self.layout.sensors.push(Sensor {
            name: name.into(),
            kind: kind.into(),
            address: self.layout.nsensordata(),
            len,
        });
    }

    fn actuator(&mut self, name: &str, ctrl_range: Option<[f64; 2]>) {
        self.layout.actuators.push(Actuator {
            name: name.into(),
            ctrl_range,
        });
    }
}

fn expected(backend: &dyn Backend) -> Expected {
    let has = |bits: Capabilities| backend.capabilities().contains(bits);
    let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    let (mut bodies, mut sensors, mut actuators) = (String::new(), String::new(), "");
    let mut expected = Expected {
        inside: String::new(),
        layout: Layout {
            timestep: STEP,
            nq: 0,
            nv: 0,
            bodies: names(&["world"]),
            geoms: Vec::new(),
            joints: Vec::new(),
            actuators: Vec::new(),
            sensors: Vec::new(),
            keyframes: Vec::new(),
        },
        qpos: Vec::new(),
        qvel: Vec::new(),
    };
    if has(Capabilities::ARTICULATION) {
        bodies += &format!(
            r#"<body name="arm" pos="0 0 3"><joint name="swing" axis="0 1 0"/>
              <geom type="sphere" size=".05" mass="1"{GHOST}/>
              <body name="hand" pos=".3 0 0"><joint name="reach" type="slide" axis="1 0 0"/>
                <geom name="finger" type="sphere" size=".05" mass="1"{GHOST}/></body>
              <body pos="0 .3 0"><joint name="wrist" type="ball"/>
                <geom type="sphere" size=".05" mass="1"{GHOST}/></body></body>"#
        );
        sensors += r#"<jointpos name="angle" joint="swing"/>"#;
        expected
            .layout
            .bodies
            .extend(names(&["arm", "hand", "body3"]));
        expected
            .layout
            .geoms
            .extend(names(&["geom0", "finger", "geom2"]));
        expected.joint("swing", JointKind::Hinge, "arm", &[0.5]);
        expected.joint("reach", JointKind::Slide, "hand", &[0.1]);
        expected.joint("wrist", JointKind::Ball, "body3", &[0.6, 0.8, 0.0, 0.0]);
        expected.sensor("angle", "jointpos", 1);
    }
    if has(Capabilities::FREE_BODIES) {
        bodies += &format!(
            r#"<body name="box" pos="2 0 1"><freejoint name="box"/>
              <geom type="box" size=".1 .1 .1" mass="1"{GHOST}/></body>"#
        );
        sensors += r#"<framepos name="place" objtype="body" objname="box"/>
            <framequat name="attitude" objtype="body" objname="box"/>"#;
        let geom = format!("geom{}", expected.layout.geoms.len());
        expected.layout.bodies.push("box".into());
        expected.layout.geoms.push(geom);
        let turned = [2.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0];
        expected.joint("box", JointKind::Free, "box", &turned);
        expected.sensor("place", "framepos", 3);
        expected.sensor("attitude", "framequat", 4);
    }
    if has(Capabilities::ARTICULATION) {
        sensors += r#"<jointvel name="speed" joint="reach"/>"#;
        expected.sensor("speed", "jointvel", 1);
    }
    if has(Capabilities::ARTICULATION.union(Capabilities::ACTUATORS)) {
        actuators = r#"<actuator><motor name="push" joint="reach" ctrlrange="-2 3"/>
            <motor name="turn" joint="swing"/></actuator>"#;
        expected.actuator("push", Some([-2.0, 3.0]));
        expected.actuator("turn", None);
    }
    let written = |values: &[f64]| values.iter().map(|v| format!("{v} ")).collect::<String>();
    // A quaternion of a key may have any length.
    let mut stated = expected.qpos.clone();
    let joints = expected.layout.joints.iter();
    for joint in joints.filter(|j| j.kind == JointKind::Free) {
        let quaternion = &mut stated[joint.qpos + 3..joint.qpos + 7];
        quaternion.iter_mut().for_each(|x| *x *= 2.0);
    }
    expected.inside = format!(
        r#"<worldbody>{bodies}</worldbody>{actuators}<sensor>{sensors}</sensor>
        <keyframe><key name="up" qpos="{}" qvel="{}"/></keyframe>"#,
        written(&stated),
        written(&expected.qvel)
    );
    expected.layout.keyframes.push(Keyframe {
        name: "up".into(),
        qpos: expected.qpos.clone(),
        qvel: expected.qvel.clone(),
        ctrl: vec![0.0; expected.layout.nu()],
    });
    expected
}

/// Number of parts of the layout that differ from the document.
pub fn layout(backend: &dyn Backend) -> Result<f64> {
    let expected = expected(backend);
    let rig = Rig::new(backend, &expected.inside, &[])?;
    let (found, theory) = (rig.simulator.layout(), &expected.layout);
    Ok(broken([
        found.timestep == theory.timestep,
        found.nq == theory.nq && found.nv == theory.nv,
        found.bodies == theory.bodies,
        found.geoms == theory.geoms,
        found.joints == theory.joints,
        found.actuators == theory.actuators,
        found.sensors == theory.sensors,
        found.keyframes == theory.keyframes,
        found == rig.model.layout(),
    ]))
}

/// Distance between the state after a reset and the first keyframe.
pub fn keyframe(backend: &dyn Backend) -> Result<f64> {
    let expected = expected(backend);
    let channels = state_channels(&expected.layout);
    let channels: Vec<&str> = channels.iter().map(String::as_str).collect();
    let found = Rig::new(backend, &expected.inside, &channels)?.read()?;
    let theory = expected.qpos.iter().chain(&expected.qvel);
    Ok(largest(
        (found[0].iter().zip(theory)).map(|(a, b)| (a - b) / b.abs().max(1.0)),
    ))
}
