//! Parts of a document that an engine must refuse or follow, each with and without it.

use asid_core::Capabilities;

use crate::subject::GHOST;

/// A document with and without one part.
pub struct Part {
    /// Description of the part, for a reader of the report.
    pub name: String,
    /// Channel that is read.
    pub channel: &'static str,
    /// Initial positions and velocities; `None` stands for those of the document.
    pub state: Option<(Vec<f64>, Vec<f64>)>,
    /// The document with the part.
    pub with: String,
    /// The document without the part.
    pub without: String,
}

/// The parts whose effect is visible on what an engine claims to move.
pub fn parts(capabilities: Capabilities) -> Vec<Part> {
    let mut parts = Vec::new();
    if capabilities.contains(Capabilities::ARTICULATION) {
        let motor = r#"<actuator><motor joint="j"/></actuator>"#;
        let lock = r#"<equality><joint joint1="j"/></equality>"#;
        parts.extend([
            wheel("damping of a hinge", r#"damping="0.2""#, ""),
            wheel("stiffness of a hinge", r#"stiffness="2""#, ""),
            wheel("armature of a hinge", r#"armature="0.2" damping="0.2""#, ""),
            wheel("frictionloss of a hinge", r#"frictionloss="0.2""#, ""),
            wheel("range of a hinge", r#"range="-0.1 0.1""#, ""),
            wheel("<motor>", "", motor),
            driven("damping of a <motor>", r#"damping="0.2""#, ""),
            driven("armature of a <motor>", r#"armature="0.2""#, ""),
            driven(
                "<option actuatorgroupdisable>",
                "",
                r#"<option actuatorgroupdisable="0"/>"#,
            ),
            grouped(
                "of a hinge",
                r#"<joint name="j" axis="0 1 0"/>"#,
                (vec![0.3], vec![0.0]),
            ),
            wheel("<equality><joint>", "", lock),
            wheel("<equality><weld>", "", WELD),
        ]);
        let slide = r#"<joint name="j" type="slide" axis="0 0 1"/>"#;
        parts.extend(falls("on a slide", slide, (vec![1.0], vec![-3.0])));
    }
    if capabilities.contains(Capabilities::FREE_BODIES) {
        let push = r#"<actuator><motor joint="j" gear="1 0 0 0 0 0"/></actuator>"#;
        parts.extend([
            stone("damping of a free joint", r#"damping="0.2""#, ""),
            stone("armature of a free joint", r#"armature="0.2""#, ""),
            stone("frictionloss of a free joint", r#"frictionloss="0.2""#, ""),
            stone("stiffness of a free joint", r#"stiffness="2""#, ""),
            stone("<motor> of a free joint", "", push),
            stone("<equality><weld> of a free body", "", WELD),
            stone("<equality><connect> of a free body", "", CONNECT),
        ]);
        let free = r#"<freejoint name="j"/>"#;
        let state = (
            vec![0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0],
            vec![0.5, 0.0, -3.0, 0.3, 0.2, 0.1],
        );
        parts.push(grouped("of a free body", free, state.clone()));
        parts.extend(falls("of a free body", free, state));
    }
    parts
}

const WELD: &str = r#"<equality><weld body1="b"/></equality>"#;
const CONNECT: &str = r#"<equality><connect body1="b" anchor="0 0 0"/></equality>"#;

/// A wheel that turns at 2 rad/s, with an attribute of its joint or an element beside it.
fn wheel(name: &str, joint: &str, beside: &str) -> Part {
    let document = |joint: &str, beside: &str| {
        format!(
            r#"<option gravity="0 0 0"/><worldbody><body name="b"><joint name="j" axis="0 0 1" {joint}/>
            <inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/></body></worldbody>{beside}"#
        )
    };
    // Other attributes beside the part are present without it as well.
    let rest = joint.split_once(' ').map_or("", |(_, rest)| rest);
    Part {
        name: name.to_owned(),
        channel: "qpos.j",
        state: Some((vec![0.0], vec![2.0])),
        with: document(joint, beside),
        without: document(if joint.contains("armature") { rest } else { "" }, ""),
    }
}

/// A wheel with a motor, with an attribute of the motor or an element beside it.
fn driven(name: &str, motor: &str, beside: &str) -> Part {
    let document = |motor: &str, beside: &str| {
        format!(
            r#"<option gravity="0 0 0"/>{beside}<worldbody><body name="b"><joint name="j" axis="0 0 1"/>
            <inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/></body></worldbody>
            <actuator><motor joint="j" {motor}/></actuator>"#
        )
    };
    Part {
        name: name.to_owned(),
        channel: "qpos.j",
        state: Some((vec![0.0], vec![2.0])),
        with: document(motor, beside),
        without: document("", ""),
    }
}

/// A body of two balls, of which the groups that have mass may leave one out.
fn grouped(whose: &str, joint: &str, state: (Vec<f64>, Vec<f64>)) -> Part {
    let document = |compiler: &str| {
        format!(
            r#"{compiler}<worldbody><body name="b">{joint}
            <geom type="sphere" size=".05" pos=".2 0 0" mass="1"{GHOST}/>
            <geom type="sphere" size=".05" pos="0 .1 .3" mass="1" group="2"{GHOST}/></body></worldbody>"#
        )
    };
    Part {
        name: format!("<compiler inertiagrouprange> {whose}"),
        channel: "qpos.j",
        state: Some(state),
        with: document(r#"<compiler inertiagrouprange="0 0"/>"#),
        without: document(""),
    }
}

/// A body that falls and tumbles, with an attribute of its free joint or an element beside it.
fn stone(name: &str, joint: &str, beside: &str) -> Part {
    let document = |joint: &str, beside: &str| {
        format!(
            r#"<worldbody><body name="b"><joint name="j" type="free" {joint}/>
            <inertial pos="0 0 0" mass="1" diaginertia=".1 .2 .25"/></body></worldbody>{beside}"#
        )
    };
    Part {
        name: name.to_owned(),
        channel: "qpos.j",
        state: Some((
            vec![0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            vec![1.0, 0.5, 0.0, 0.3, 0.2, 0.1],
        )),
        with: document(joint, beside),
        without: document("", ""),
    }
}

/// A body that falls: through a medium, onto the floor, or held by something.
fn falls(whose: &str, joint: &str, state: (Vec<f64>, Vec<f64>)) -> Vec<Part> {
    let document = |option: &str, body: &str, geom: &str, floor: &str, beside: &str| {
        format!(
            r#"{option}<worldbody>{floor}<site name="hook" pos="0 0 3"/>
            <body name="b"{body}>{joint}<geom {geom}/><site name="eye"/></body></worldbody>{beside}"#
        )
    };
    let ball = r#"type="sphere" size=".1" mass="1""#;
    let ghost = format!("{ball}{GHOST}");
    let in_air = |name: &str, option: &str, body: &str, beside: &str| Part {
        name: format!("{name} {whose}"),
        channel: "qpos.j",
        state: Some(state.clone()),
        with: document(option, body, &ghost, "", beside),
        without: document("", "", &ghost, "", ""),
    };
    // It falls onto the floor from a height of 5 mm.
    let mut low = state.clone();
    low.1.fill(0.0);
    let height = if low.0.len() > 1 { 2 } else { 0 };
    low.0[height] = 1.005;
    let lands = |name: &str, geom: &str, assets: &str| {
        let plane = r#"<geom type="plane" size="5 5 .1"/>"#;
        let still = format!(r#"<geom type="plane" size="5 5 .1"{GHOST}/>"#);
        Part {
            name: format!("contact of {name} {whose}"),
            channel: "qpos.j",
            state: Some(low.clone()),
            with: document(assets, "", geom, plane, ""),
            without: document(assets, "", &format!("{geom}{GHOST}"), &still, ""),
        }
    };
    let mesh = r#"<asset><mesh name="m" vertex="-1 -1 -1 1 -1 -1 0 1 -1 0 0 1"/></asset>"#;
    let spring = r#"<tendon><spatial stiffness="10"><site site="hook"/><site site="eye"/></spatial></tendon>"#;
    vec![
        in_air("<option density>", r#"<option density="50"/>"#, "", ""),
        in_air("<option viscosity>", r#"<option viscosity="5"/>"#, "", ""),
        in_air(
            "<option wind>",
            r#"<option density="50" wind="0 0 9"/>"#,
            "",
            "",
        ),
        in_air(
            "<flag gravity>",
            r#"<option><flag gravity="disable"/></option>"#,
            "",
            "",
        ),
        in_air("gravcomp", "", r#" gravcomp="0.5""#, ""),
        in_air("<tendon>", "", "", spring),
        lands("a ball", r#"type="sphere" size="1" mass="1""#, ""),
        lands("a mesh", r#"type="mesh" mesh="m" mass="1""#, mesh),
    ]
}
