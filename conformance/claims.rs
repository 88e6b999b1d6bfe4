//! What an engine does not claim, it refuses; what it takes, acts.
//!
//! A part of a scene that is silently left out gives a wrong answer without a
//! word. So each capability that an engine lacks is asked of it all the same: it
//! may refuse, and it may do more than it claims, but it may not go on as if
//! nothing had been said.

use asid_core::simulator::{ExternalForce, ParameterChange, StepHook, StepView};
use asid_core::{Backend, Capabilities, Result};

use crate::check::Check;
use crate::faults::{ANY, check};
use crate::rig::{Extras, Rig, Rows, Size, differing_bits};
use crate::subject::{GHOST, falling};

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check(
        "claims/no-part-of-a-scene-is-left-out",
        ANY,
        "what is not claimed is refused, or acts; softness is not asked for: silently left out of up to twelve",
        scenes,
    ),
    check(
        "claims/no-part-of-a-rollout-is-left-out",
        ANY,
        "wrenches, changes and hooks that are not claimed are refused, or act: silently left out of up to three",
        rollouts,
    ),
    check(
        "claims/no-target-is-left-out",
        ANY,
        "parameters that are not claimed are refused, or act: silently left out of up to four",
        targets,
    ),
];

/// Readings of 50 steps from a state, `None` where the engine refuses the document.
fn readings(
    backend: &dyn Backend,
    inside: &str,
    channel: &str,
    speed: f64,
) -> Result<Option<Rows>> {
    let Ok(mut rig) = Rig::new(backend, inside, &[channel]) else {
        return Ok(None);
    };
    if speed != 0.0 {
        rig.place(&[0.0], &[speed])?;
    }
    rig.run(50, &rig.command(1.0)).map(Some)
}

/// A part of a document: with it and without it.
struct Part {
    bits: Capabilities,
    channel: &'static str,
    speed: f64,
    with: String,
    without: String,
}

/// A wheel, turning at 2 rad/s, with something on its joint or beside it.
fn wheel(bits: Capabilities, joint: &str, beside: &str) -> Part {
    let document = |joint: &str, beside: &str| {
        format!(
            r#"<option gravity="0 0 0"/><worldbody><body name="b"><joint name="j" axis="0 0 1" {joint}/>
            <inertial pos="0 0 0" mass="1" diaginertia=".1 .1 .1"/></body></worldbody>{beside}"#
        )
    };
    Part {
        bits,
        channel: "qpos.j",
        speed: 2.0,
        with: document(joint, beside),
        without: document("", ""),
    }
}

/// A body that falls onto the floor from 5 mm.
fn lands(bits: Capabilities, joint: &str, geom: &str, assets: &str) -> Part {
    let document = |touch: &str| {
        format!(
            r#"{assets}<worldbody><geom type="plane" size="5 5 .1"{touch}/>
            <body name="b" pos="0 0 1.005">{joint}<geom {geom}{touch}/></body></worldbody>"#
        )
    };
    Part {
        bits,
        channel: "qpos.j",
        speed: 0.0,
        with: document(""),
        without: document(GHOST),
    }
}

fn parts(capabilities: Capabilities) -> Vec<Part> {
    let mut parts = Vec::new();
    if capabilities.contains(Capabilities::ARTICULATION) {
        let motor = r#"<actuator><motor joint="j"/></actuator>"#;
        let lock = r#"<equality><joint joint1="j"/></equality>"#;
        parts.extend([
            wheel(Capabilities::JOINT_IMPEDANCE, r#"damping="0.2""#, ""),
            wheel(Capabilities::JOINT_IMPEDANCE, r#"stiffness="2""#, ""),
            wheel(Capabilities::JOINT_FRICTION, r#"frictionloss="0.2""#, ""),
            wheel(Capabilities::JOINT_LIMITS, r#"range="-0.1 0.1""#, ""),
            wheel(Capabilities::ACTUATORS, "", motor),
            wheel(Capabilities::EQUALITY, "", lock),
        ]);
    }
    let falls = [
        (
            Capabilities::ARTICULATION,
            r#"<joint name="j" type="slide" axis="0 0 1"/>"#,
        ),
        (Capabilities::FREE_BODIES, r#"<freejoint name="j"/>"#),
    ];
    let ball = r#"type="sphere" size="1" mass="1""#;
    let mesh = r#"<asset><mesh name="m" vertex="-1 -1 -1 1 -1 -1 0 1 -1 0 0 1"/></asset>"#;
    for (bits, joint) in falls {
        if capabilities.contains(bits) {
            let shape = r#"type="mesh" mesh="m" mass="1""#;
            parts.push(lands(Capabilities::CONTACT, joint, ball, ""));
            parts.push(lands(Capabilities::MESHES, joint, shape, mesh));
        }
    }
    parts
}

fn scenes(backend: &dyn Backend) -> Result<f64> {
    let capabilities = backend.capabilities();
    let mut left_out = 0.0;
    for part in parts(capabilities) {
        if capabilities.contains(part.bits) {
            continue;
        }
        let with = readings(backend, &part.with, part.channel, part.speed)?;
        let without = readings(backend, &part.without, part.channel, part.speed)?;
        if let (Some(with), Some(without)) = (with, without) {
            left_out += f64::from(u8::from(differing_bits(&with, &without) == 0.0));
        }
    }
    // A body on a joint of a kind that is not known must not stand still.
    let body = |joint: &str| {
        format!(
            r#"<worldbody><body name="b">{joint}
            <inertial pos=".3 0 0" mass="1" diaginertia=".1 .1 .1"/></body></worldbody>"#
        )
    };
    for (bits, joint, channel) in [
        (
            Capabilities::FREE_BODIES,
            "<freejoint name=\"f\"/>",
            "qpos.f",
        ),
        (
            Capabilities::ARTICULATION,
            "<joint name=\"j\" axis=\"0 1 0\"/>",
            "qpos.j",
        ),
        (
            Capabilities::ARTICULATION,
            "<joint name=\"j\" type=\"ball\"/>",
            "qpos.j",
        ),
    ] {
        if !capabilities.contains(bits)
            && let Some(rows) = readings(backend, &body(joint), channel, 0.0)?
        {
            left_out += f64::from(u8::from(rows.first() == rows.last()));
        }
    }
    Ok(left_out)
}

struct Stops;

impl StepHook for Stops {
    fn before_step(&self, _: usize, _: usize, view: &mut StepView<'_>) {
        view.force.fill(5.0);
    }
}

/// True where a rollout goes through and is that of a body that merely falls.
fn ignores<'a>(backend: &dyn Backend, change: impl FnOnce(&mut Extras<'a>)) -> Result<bool> {
    let body = falling(backend);
    let size = Size {
        sims: 1,
        threads: 1,
        targets: &["option/gravity/2"],
    };
    let rig = || Rig::with(backend, body.inside, body.velocity, size);
    let plain = rig()?.run(3, &[])?;
    let rows = rig()?.run_with(3, 1, &[], change);
    Ok(rows.is_ok_and(|rows| differing_bits(&rows, &plain) == 0.0))
}

fn rollouts(backend: &dyn Backend) -> Result<f64> {
    let lacks = |bits: Capabilities| !backend.capabilities().contains(bits);
    let wrench = [5.0; 18];
    let mut left_out = 0;
    if lacks(Capabilities::EXTERNAL_FORCES) {
        left_out += usize::from(ignores(backend, |extras| {
            extras.forces.push(ExternalForce {
                body: 1,
                wrench: &wrench,
            });
        })?);
    }
    if lacks(Capabilities::PARAMETER_CHANGES) {
        left_out += usize::from(ignores(backend, |extras| {
            extras.changes.push(ParameterChange {
                frame: 1,
                column: 0,
                values: &[-1.0],
            });
        })?);
    }
    if lacks(Capabilities::STEP_HOOKS) {
        left_out += usize::from(ignores(backend, |extras| extras.hook = Some(&Stops))?);
    }
    Ok(left_out as f64)
}

fn targets(backend: &dyn Backend) -> Result<f64> {
    const TREE: Capabilities = Capabilities::ARTICULATION;
    const TOUCHING: Capabilities = Capabilities::FREE_BODIES.union(Capabilities::CONTACT);
    let arm = r#"<worldbody><body name="b"><joint name="j" axis="0 1 0"/>
        <inertial pos=".3 0 0" mass="1" diaginertia=".1 .1 .1"/></body></worldbody>"#;
    let ball = r#"<worldbody><geom type="plane" size="5 5 .1"/><body pos="0 0 .0999">
        <freejoint name="j"/><geom name="g" type="sphere" size=".1" mass="1"/></body></worldbody>"#;
    let run = |inside: &str, target: &str, value: f64| -> Result<Option<Rows>> {
        let size = Size {
            sims: 1,
            threads: 1,
            targets: &[target],
        };
        let Ok(mut rig) = Rig::with(backend, inside, &["qvel.j"], size) else {
            return Ok(None);
        };
        if rig.set(&[value]).is_err() {
            return Ok(None);
        }
        rig.run(20, &[]).map(Some)
    };
    let capabilities = backend.capabilities();
    let mut left_out = 0;
    for (needs, bit, inside, target, values) in [
        (
            TREE,
            Capabilities::MASS_PARAMETERS,
            arm,
            "body/b/ipos/0",
            [0.3, 0.6],
        ),
        (
            TREE,
            Capabilities::JOINT_IMPEDANCE,
            arm,
            "joint/j/damping",
            [0.0, 0.5],
        ),
        (
            TREE,
            Capabilities::JOINT_FRICTION,
            arm,
            "joint/j/frictionloss",
            [0.0, 0.5],
        ),
        (
            TOUCHING,
            Capabilities::CONTACT_STIFFNESS,
            ball,
            "geom/g/solref/0",
            [0.02, 0.1],
        ),
    ] {
        if capabilities.contains(bit) || !capabilities.contains(needs) {
            continue;
        }
        let both = (
            run(inside, target, values[0])?,
            run(inside, target, values[1])?,
        );
        if let (Some(one), Some(two)) = both {
            left_out += usize::from(differing_bits(&one, &two) == 0.0);
        }
    }
    Ok(left_out as f64)
}
