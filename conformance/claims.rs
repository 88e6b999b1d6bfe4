//! An engine must refuse what it does not claim, or act on it.
//!
//! If an engine silently ignores a part of a scene, its answer is wrong without any warning. The
//! checks therefore try each part on every engine. It may refuse the part, and it may support more
//! than it claims, but it must not ignore the part. And for each capability that an engine claims,
//! some check must be able to test it.

use asid_core::simulator::{ExternalForce, ParameterChange, StepHook, StepView};
use asid_core::{Backend, Capabilities, Error, Result};

use crate::check::Check;
use crate::check::Measure::Taken;
use crate::faults::{ANY, check};
use crate::parts::{Part, parts};
use crate::rig::{Extras, Rig, Rows, Size, differing_bits};
use crate::subject::falling;

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    check(
        "claims/something-moves",
        ANY,
        "FREE_BODIES or ARTICULATION is claimed: without either there is nothing to check",
        something_moves,
    ),
    check(
        "claims/every-bit-is-checked",
        ANY,
        "each bit that is claimed has a check that needs no bit which is not: bits without one",
        every_bit,
    ),
    probe(
        "claims/no-part-of-a-scene-is-left-out",
        "what a document says of joints, drives, equalities, shapes and the air is refused, or acts; softness is not asked for: silently left out",
        scenes,
    ),
    probe(
        "claims/no-part-of-a-rollout-is-left-out",
        "wrenches, changes and hooks are refused, or act: silently left out of three",
        rollouts,
    ),
    probe(
        "claims/no-target-is-left-out",
        "parameters of masses, joints and contacts are refused, or act: silently left out",
        targets,
    ),
];

const fn probe(
    name: &'static str,
    reason: &'static str,
    measure: fn(&dyn Backend) -> Result<Option<f64>>,
) -> Check {
    Check {
        measure: Taken(measure),
        ..check(name, ANY, reason, |_| Ok(0.0))
    }
}

fn something_moves(backend: &dyn Backend) -> Result<f64> {
    if backend.capabilities().intersects(crate::MOVES) {
        return Ok(0.0);
    }
    Err(Error::Failed(
        "claims neither FREE_BODIES nor ARTICULATION, so none of its motion can be checked: an engine claims at least one".into(),
    ))
}

/// Names what a claimed bit lacks, if every check of it needs more than is claimed.
fn unchecked(bit: Capabilities, claimed: Capabilities) -> Option<String> {
    let lacking: Vec<Capabilities> = crate::checks()
        .filter(|check| check.needs.contains(bit))
        .map(|check| check.needs - claimed)
        .collect();
    // The smallest number of bits that would enable a check. No check names a bit of arithmetic.
    let least = *lacking.iter().min_by_key(|bits| bits.bits().count_ones())?;
    let names = |bits: Capabilities| {
        let names: Vec<&str> = bits.iter_names().map(|(name, _)| name).collect();
        names.join(" and ")
    };
    (!least.is_empty()).then(|| {
        format!(
            "{} is claimed, but every check of it also needs {}",
            names(bit),
            names(least)
        )
    })
}

fn every_bit(backend: &dyn Backend) -> Result<f64> {
    let claimed = backend.capabilities();
    told(
        claimed
            .iter()
            .filter_map(|bit| unchecked(bit, claimed))
            .collect(),
        "",
    )
}

/// Zero, or an error that names what was found.
fn told(found: Vec<String>, before: &str) -> Result<f64> {
    if found.is_empty() {
        return Ok(0.0);
    }
    Err(Error::Failed(format!("{before}{}", found.join("; "))))
}

/// Readings of 50 steps of a document; `None` if the engine refuses it.
fn readings(backend: &dyn Backend, part: &Part, inside: &str) -> Result<Option<Rows>> {
    let Ok(mut rig) = Rig::new(backend, inside, &[part.channel]) else {
        return Ok(None);
    };
    if let Some((qpos, qvel)) = &part.state {
        rig.place(qpos, qvel)?;
    }
    rig.run(50, &rig.command(1.0)).map(Some)
}

fn scenes(backend: &dyn Backend) -> Result<Option<f64>> {
    let capabilities = backend.capabilities();
    let mut left_out = Vec::new();
    let parts = parts(capabilities);
    if parts.is_empty() {
        return Ok(None);
    }
    for part in &parts {
        let with = readings(backend, part, &part.with)?;
        let without = readings(backend, part, &part.without)?;
        if let (Some(with), Some(without)) = (with, without)
            && differing_bits(&with, &without) == 0.0
        {
            left_out.push(part.name.clone());
        }
    }
    // A body on a joint of an unsupported kind must not stand still.
    for (bits, name, joint) in [
        (
            Capabilities::FREE_BODIES,
            "<freejoint>",
            r#"<freejoint name="j"/>"#,
        ),
        (
            Capabilities::ARTICULATION,
            "a hinge",
            r#"<joint name="j" axis="0 1 0"/>"#,
        ),
        (
            Capabilities::ARTICULATION,
            "a ball joint",
            r#"<joint name="j" type="ball"/>"#,
        ),
    ] {
        let inside = format!(
            r#"<worldbody><body name="b">{joint}
            <inertial pos=".3 0 0" mass="1" diaginertia=".1 .1 .1"/></body></worldbody>"#
        );
        if !capabilities.contains(bits)
            && let Ok(mut rig) = Rig::new(backend, &inside, &["qpos.j"])
        {
            let rows = rig.run(50, &[])?;
            if rows.first() == rows.last() {
                left_out.push(name.to_owned());
            }
        }
    }
    told(left_out, "silently left out: ").map(Some)
}

struct Stops;

impl StepHook for Stops {
    fn before_step(&self, _: usize, _: usize, view: &mut StepView<'_>) {
        view.force.fill(5.0);
    }
}

/// Whether a rollout succeeds and equals that of a body that only falls.
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

fn rollouts(backend: &dyn Backend) -> Result<Option<f64>> {
    if Rig::new(backend, falling(backend).inside, &[]).is_err()
        && !backend.capabilities().intersects(crate::MOVES)
    {
        return Ok(None);
    }
    let wrench = [5.0; 18];
    let mut left_out = Vec::new();
    if ignores(backend, |extras| {
        extras.forces.push(ExternalForce {
            body: 1,
            wrench: &wrench,
        });
    })? {
        left_out.push("wrenches on bodies".to_owned());
    }
    if ignores(backend, |extras| {
        extras.changes.push(ParameterChange {
            frame: 1,
            column: 0,
            values: &[-1.0],
        });
    })? {
        left_out.push("changes of parameters".to_owned());
    }
    if ignores(backend, |extras| extras.hook = Some(&Stops))? {
        left_out.push("hooks".to_owned());
    }
    told(left_out, "silently left out: ").map(Some)
}

/// A parameter in a scene in which it acts: capabilities that the scene needs, the target, two
/// values.
type Probe = (Capabilities, &'static str, &'static str, [f64; 2]);

const ARM: &str = r#"<worldbody><body name="b"><joint name="j" axis="0 1 0"/>
    <inertial pos=".3 0 0" mass="1" diaginertia=".1 .1 .1"/></body></worldbody>"#;
const BALL: &str = r#"<worldbody><geom type="plane" size="5 5 .1"/><body pos="0 0 .0999">
    <freejoint name="j"/><geom name="g" type="sphere" size=".1" mass="1"/></body></worldbody>"#;
/// A body that tumbles.
const STONE: &str = r#"<worldbody><body name="b"><freejoint name="j"/>
    <inertial pos=".3 0 0" mass="1" diaginertia=".1 .2 .25"/></body></worldbody>
    <keyframe><key qvel="0 0 0 1 2 3" qpos="0 0 0 1 0 0 0"/></keyframe>"#;

const TREE: Capabilities = Capabilities::ARTICULATION;
const FREE: Capabilities = Capabilities::FREE_BODIES;
const TARGETS: [Probe; 10] = [
    (TREE, ARM, "body/b/ipos/0", [0.3, 0.6]),
    (TREE, ARM, "body/b/inertia/1", [0.1, 0.6]),
    (TREE, ARM, "joint/j/damping", [0.0, 0.5]),
    (TREE, ARM, "joint/j/stiffness", [0.0, 0.5]),
    (TREE, ARM, "joint/j/armature", [0.0, 0.5]),
    (TREE, ARM, "joint/j/frictionloss", [0.0, 0.5]),
    (FREE, STONE, "body/b/ipos/0", [0.3, 0.6]),
    (FREE, STONE, "body/b/inertia/1", [0.2, 0.3]),
    (FREE, STONE, "joint/j/damping", [0.0, 0.5]),
    (
        FREE.union(Capabilities::CONTACT),
        BALL,
        "geom/g/solref/0",
        [0.02, 0.1],
    ),
];

fn targets(backend: &dyn Backend) -> Result<Option<f64>> {
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
    let mut asked = false;
    let mut left_out = Vec::new();
    for (needs, inside, target, values) in TARGETS {
        if !backend.capabilities().contains(needs) {
            continue;
        }
        asked = true;
        let both = (
            run(inside, target, values[0])?,
            run(inside, target, values[1])?,
        );
        if let (Some(one), Some(two)) = both
            && differing_bits(&one, &two) == 0.0
        {
            left_out.push(target.to_owned());
        }
    }
    let found = told(left_out, "silently left out: ")?;
    Ok(asked.then_some(found))
}
