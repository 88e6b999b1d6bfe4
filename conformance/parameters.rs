//! Rules of parameters: nominal values, separate values per simulation, changes, and refusals.

use asid_core::simulator::ParameterChange;
use asid_core::{Backend, Capabilities, Result};

use crate::check::Measure::Figure;
use crate::check::{Check, Tolerance};
use crate::faults::ANY;
use crate::pair::{both, ends, pair};
use crate::rig::{G, Rig, STEP, Size, differing_bits, largest, relative, saves};
use crate::subject::{GHOST, NOMINAL, falling, stirred};

const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "parameters/gravity",
        needs: ANY,
        unit: "",
        tolerance: ROUNDING,
        reason: "speed of fall along each axis: rounding",
        measure: Figure(gravity),
    },
    Check {
        name: "parameters/nominal-is-of-the-document",
        needs: ANY,
        unit: "",
        tolerance: Tolerance::by_precision(1e-12, 1e-6),
        reason: "what the document says, or follows from it by hand, for whatever is claimed: rounding",
        measure: Figure(nominal),
    },
    Check {
        name: "parameters/own-simulation-only",
        needs: ANY,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "readings of a neighbour that differ in any bit",
        measure: Figure(own_simulation),
    },
    Check {
        name: "parameters/setting-moves-nothing",
        needs: ANY,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "positions and velocities stay, and nominal values set again change nothing: readings that differ in any bit",
        measure: Figure(moves_nothing),
    },
    Check {
        name: "parameters/survive-reset-and-load",
        needs: ANY,
        unit: "",
        tolerance: ROUNDING,
        reason: "acceleration by the parameter after reset, set_state, load and copy: rounding",
        measure: Figure(survive),
    },
    Check {
        name: "parameters/change-at-their-frame",
        needs: Capabilities::PARAMETER_CHANGES,
        unit: "",
        tolerance: ROUNDING,
        reason: "speed grows by the old gravity up to the frame and by the new from it on: rounding",
        measure: Figure(change_in_rollout),
    },
    Check {
        name: "parameters/one-mass-of-a-body",
        needs: Capabilities::ARTICULATION.union(Capabilities::MASS_PARAMETERS),
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "the mass of a body beside that of its geom has no clear meaning, in either order: accepted of two",
        measure: Figure(one_mass),
    },
    Check {
        name: "parameters/nonsense-is-refused",
        needs: ANY,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "an error each for targets that are not there and values that are not physical, of whatever is taken: accepted of up to ten",
        measure: Figure(nonsense),
    },
];

fn gravity(backend: &dyn Backend) -> Result<f64> {
    let field = [1.5, -2.5, -3.0];
    let targets = ["option/gravity/0", "option/gravity/1", "option/gravity/2"];
    let parameters: Vec<(&str, f64)> = targets.into_iter().zip(field).collect();
    let body = falling(backend);
    let mut rig = pair(backend, body.inside, body.velocity, &parameters)?;
    let [nominal, changed] = ends(&rig.run(50, &[])?)?;
    let time = 50.0 * STEP;
    let parts = (0..3).map(|i| relative(changed[i], field[i] * time));
    Ok(largest(parts.chain([relative(nominal[2], -G * time)])))
}

/// A document of what an engine claims, and targets in it with their values.
fn claimed(backend: &dyn Backend) -> (String, Vec<(&'static str, f64)>) {
    let has = |bits: Capabilities| backend.capabilities().contains(bits);
    let tree = has(Capabilities::ARTICULATION);
    let mut values = vec![("option/gravity/2", -9.81)];
    let mut bodies = String::new();
    let mut actuators = "";
    let touch = if has(Capabilities::CONTACT) {
        let mut friction = "0.7".to_owned();
        for (bit, target, value) in [
            (
                Capabilities::TORSIONAL_FRICTION,
                "geom/floor/friction/1",
                0.02,
            ),
            (
                Capabilities::ROLLING_FRICTION,
                "geom/floor/friction/2",
                0.003,
            ),
        ] {
            friction += &format!(" {}", if has(bit) { value } else { 0.0 });
            if has(bit) {
                values.push((target, value));
            }
        }
        bodies += &format!(
            r#"<geom name="floor" type="plane" size="5 5 .1" friction="{friction}" condim="6"/>"#
        );
        values.push(("geom/floor/friction/0", 0.7));
        ""
    } else {
        GHOST
    };
    if tree {
        let mut joint = String::new();
        if has(Capabilities::JOINT_IMPEDANCE) {
            joint += r#" damping="0.3" stiffness="1.5" armature="0.02""#;
            values.extend([
                ("joint/j/damping", 0.3),
                ("joint/j/stiffness", 1.5),
                ("joint/j/armature", 0.02),
            ]);
        }
        if has(Capabilities::JOINT_FRICTION) {
            joint += r#" frictionloss="0.04""#;
            values.push(("joint/j/frictionloss", 0.04));
        }
        if has(Capabilities::ACTUATORS) {
            actuators = r#"<actuator><position name="p" joint="j" kp="30" kv="4"/>
                <motor name="m" joint="j" gear="6"/></actuator>"#;
            values.extend([
                ("actuator/p/kp", 30.0),
                ("actuator/p/kv", 4.0),
                ("actuator/m/gear", 6.0),
            ]);
        }
        if has(Capabilities::MASS_PARAMETERS) {
            values.extend([
                ("geom/near/pos/1", 0.1),
                ("geom/far/mass", 3.0),
                ("body/arm/mass", 4.0),
                ("body/arm/ipos/0", 0.5),
            ]);
        }
        bodies += &format!(
            r#"<body name="arm" pos="0 0 3"><joint name="j" axis="0 1 0"{joint}/>
            <geom name="near" type="sphere" size=".05" pos=".2 .1 0" mass="1"{touch}/>
            <geom name="far" type="sphere" size=".05" pos=".6 .1 0" mass="3"{touch}/></body>"#
        );
    }
    let free = has(Capabilities::FREE_BODIES);
    if has(Capabilities::MASS_PARAMETERS) {
        values.extend([
            ("body/lump/mass", 0.7),
            ("body/lump/ipos/2", 0.03),
            ("body/lump/inertia/1", 0.04),
        ]);
    }
    bodies += &format!(
        r#"<body name="lump" pos="0 0 1">{}<inertial pos=".01 .02 .03" mass=".7" diaginertia=".03 .04 .05"/>
        <geom name="g" type="sphere" size=".1"{touch}/></body>"#,
        if free {
            r#"<freejoint name="l"/>"#
        } else {
            r#"<joint name="l" axis="1 0 0"/>"#
        }
    );
    (
        format!("<worldbody>{bodies}</worldbody>{actuators}"),
        values,
    )
}

fn nominal(backend: &dyn Backend) -> Result<f64> {
    let (inside, expected) = claimed(backend);
    let model = backend.load(&crate::rig::scene(&inside)?)?;
    let mut errors = Vec::new();
    for (target, value) in expected {
        errors.push(relative(model.nominal(&target.parse()?)?, value));
    }
    Ok(largest(errors))
}

fn own_simulation(backend: &dyn Backend) -> Result<f64> {
    let mut rig = stirred(backend, 3, 2)?;
    let mut alone = stirred(backend, 3, 2)?;
    rig.simulator.set_parameters(&[1], &[-3.0, 0.5])?;
    let ctrl = rig.command(0.4);
    let (rows, plain) = (rig.run(100, &ctrl)?, alone.run(100, &ctrl)?);
    let differ = |sim: usize| {
        let range = 100 * sim..100 * (sim + 1);
        differing_bits(&rows[range.clone()], &plain[range])
    };
    if differ(1) == 0.0 {
        return Ok(f64::NAN);
    }
    Ok(differ(0) + differ(2))
}

fn moves_nothing(backend: &dyn Backend) -> Result<f64> {
    let (mut rig, mut other) = (stirred(backend, 2, 1)?, stirred(backend, 2, 1)?);
    let ctrl = rig.command(0.4);
    rig.run(30, &ctrl)?;
    other.run(30, &ctrl)?;
    let before = rig.read()?;
    rig.set(&[-3.0, 0.5, -4.0, 1.0])?;
    let moved = differing_bits(&before, &rig.read()?);
    rig.set(&NOMINAL.repeat(2))?;
    let after = differing_bits(&rig.run(30, &ctrl)?, &other.run(30, &ctrl)?);
    Ok(moved + after)
}

fn survive(backend: &dyn Backend) -> Result<f64> {
    let body = falling(backend);
    let parameter = ("option/gravity/2", -3.0);
    let mut rig = pair(backend, body.inside, body.velocity, &[parameter])?;
    let start = saves(backend)
        .then(|| rig.simulator.save(&[0]))
        .transpose()?;
    let mut errors = Vec::new();
    for way in 0..4 {
        match (way, &start) {
            (0, _) => rig.simulator.reset(&[0, 1])?,
            (1, Some(start)) => rig.simulator.load(start, &[0, 0], &[0, 1])?,
            (2, _) => rig.place(body.origin, body.rest)?,
            (_, Some(_)) => {
                rig.simulator.reset(&[0])?;
                rig.simulator.copy_state(&[0], &[1])?;
            }
            // Without snapshots there are two ways.
            _ => continue,
        }
        let [nominal, changed] = ends(&rig.run(20, &[])?)?;
        let time = 20.0 * STEP;
        errors.push(both([nominal[2], changed[2]], [-G * time, -3.0 * time]));
    }
    Ok(largest(errors))
}

fn change_in_rollout(backend: &dyn Backend) -> Result<f64> {
    let body = falling(backend);
    let parameter = ("option/gravity/2", -3.0);
    let mut rig = pair(backend, body.inside, body.velocity, &[parameter])?;
    let rows = rig.run_with(10, 2, &[], |extras| {
        extras.changes.push(ParameterChange {
            frame: 6,
            column: 0,
            values: &[-1.0, -2.0],
        });
    })?;
    let frame = 2.0 * STEP;
    Ok(largest([
        relative(rows[5][2], -6.0 * G * frame),
        relative(rows[9][2], (-6.0 * G - 4.0) * frame),
        relative(rows[15][2], -18.0 * frame),
        relative(rows[19][2], -26.0 * frame),
    ]))
}

fn one_mass(backend: &dyn Backend) -> Result<f64> {
    let (inside, _) = claimed(backend);
    let (geom, body) = ("geom/far/mass", "body/arm/mass");
    let orders = [[geom, body], [body, geom]];
    let accepted = orders.iter().filter(|targets| {
        let size = Size {
            sims: 1,
            threads: 1,
            targets: &targets[..],
        };
        Rig::with(backend, &inside, &[], size).is_ok()
    });
    Ok(accepted.count() as f64)
}

fn nonsense(backend: &dyn Backend) -> Result<f64> {
    let (inside, known) = claimed(backend);
    let rig = |target: &str| {
        let size = Size {
            sims: 1,
            threads: 1,
            targets: &[target],
        };
        Rig::with(backend, &inside, &[], size)
    };
    let targets = [
        "geom/missing/mass",
        "geom/g/colour",
        "geom/g/friction/3",
        "body/world/mass",
        "actuator/missing/kp",
    ];
    let mut accepted = targets.iter().filter(|t| rig(t).is_ok()).count();
    for (target, value) in [
        ("body/lump/mass", -1.0),
        ("body/lump/inertia/1", -1.0),
        ("geom/floor/friction/0", -0.1),
        ("joint/j/damping", -0.1),
        ("option/gravity/2", f64::INFINITY),
    ] {
        let claimed = known.iter().any(|(t, _)| *t == target);
        match rig(target) {
            Ok(mut rig) => accepted += usize::from(rig.set(&[value]).is_ok()),
            Err(error) if claimed => return Err(error),
            Err(_) => {}
        }
    }
    Ok(accepted as f64)
}
