//! Rules of parameters: nominal values, whose they are, when they change, what
//! is refused.

use asid_core::simulator::ParameterChange;
use asid_core::{Backend, Capabilities, Result};

use crate::check::{Check, Tolerance};
use crate::pair::{both, ends, pair};
use crate::rig::{G, Rig, STEP, Size, broken, differing_bits, largest, relative};

const CONTACT: Capabilities = Capabilities::CONTACT;
const DRIVEN: Capabilities = Capabilities::ARTICULATION.union(Capabilities::ACTUATORS);
const IMPEDANCE: Capabilities = DRIVEN.union(Capabilities::JOINT_IMPEDANCE);
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);

/// The checks of this family.
pub const CHECKS: &[Check] = &[
    Check {
        name: "parameters/gravity",
        needs: CONTACT,
        unit: "",
        tolerance: Tolerance::by_precision(1e-9, 1e-4),
        reason: "speed of fall along each axis: rounding",
        measure: gravity,
    },
    Check {
        name: "parameters/nominal-is-of-the-document",
        needs: IMPEDANCE.union(CONTACT).union(Capabilities::JOINT_FRICTION),
        unit: "",
        tolerance: Tolerance::by_precision(1e-12, 1e-6),
        reason: "what the document says, or follows from it by hand: rounding",
        measure: nominal,
    },
    Check {
        name: "parameters/own-simulation-only",
        needs: DRIVEN,
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "readings of a neighbour that differ in any bit",
        measure: own_simulation,
    },
    Check {
        name: "parameters/survive-reset-and-load",
        needs: DRIVEN,
        unit: "",
        tolerance: ROUNDING,
        reason: "acceleration by the parameter after reset, set_state, load and copy: rounding",
        measure: survive,
    },
    Check {
        name: "parameters/change-at-their-frame",
        needs: CONTACT.union(Capabilities::PARAMETER_CHANGES),
        unit: "",
        tolerance: ROUNDING,
        reason: "speed grows by the old gravity up to the frame and by the new from it on: rounding",
        measure: change_in_rollout,
    },
    Check {
        name: "parameters/nonsense-is-refused",
        needs: DRIVEN.union(CONTACT),
        unit: "",
        tolerance: Tolerance::same(0.0),
        reason: "an error each for five targets and four values: accepted of nine",
        measure: nonsense,
    },
];

const FALLING: &str = r#"<worldbody><body name="b"><freejoint name="b"/>
    <geom type="sphere" size=".1" mass="1"/></body></worldbody>"#;

fn gravity(backend: &dyn Backend) -> Result<f64> {
    let field = [1.5, -2.5, -3.0];
    let targets = ["option/gravity/0", "option/gravity/1", "option/gravity/2"];
    let parameters: Vec<(&str, f64)> = targets.into_iter().zip(field).collect();
    let mut rig = pair(backend, FALLING, &["qvel.b"], &parameters)?;
    let [nominal, changed] = ends(&rig.run(50, &[])?)?;
    let time = 50.0 * STEP;
    let parts = (0..3).map(|i| relative(changed[i], field[i] * time));
    Ok(largest(parts.chain([relative(nominal[2], -G * time)])))
}

fn nominal(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody>
      <geom name="floor" type="plane" size="5 5 .1" friction="0.7 0.02 0.003"/>
      <body name="arm"><joint name="j" axis="0 1 0" damping="0.3" frictionloss="0.04" stiffness="1.5" armature="0.02"/>
        <geom name="near" type="sphere" size=".05" pos=".2 .1 0" mass="1"/>
        <geom name="far" type="sphere" size=".05" pos=".6 .1 0" mass="3"/></body>
      <body name="lump" pos="0 0 1"><freejoint name="l"/><inertial pos=".01 .02 .03" mass=".7" diaginertia=".03 .04 .05"/>
        <geom type="sphere" size=".1"/></body></worldbody>
      <actuator><position name="p" joint="j" kp="30" kv="4"/><motor name="m" joint="j" gear="6"/></actuator>"#;
    let model = backend.load(&crate::rig::scene(inside)?)?;
    let expected = [
        ("geom/floor/friction/0", 0.7),
        ("geom/floor/friction/1", 0.02),
        ("geom/floor/friction/2", 0.003),
        ("geom/near/pos/1", 0.1),
        ("geom/far/mass", 3.0),
        ("body/arm/mass", 4.0),
        ("body/arm/ipos/0", 0.5),
        ("body/lump/mass", 0.7),
        ("body/lump/ipos/2", 0.03),
        ("body/lump/inertia/1", 0.04),
        ("joint/j/damping", 0.3),
        ("joint/j/frictionloss", 0.04),
        ("joint/j/stiffness", 1.5),
        ("joint/j/armature", 0.02),
        ("actuator/p/kp", 30.0),
        ("actuator/p/kv", 4.0),
        ("actuator/m/gear", 6.0),
        ("option/gravity/2", -9.81),
    ];
    let mut errors = Vec::new();
    for (target, value) in expected {
        errors.push(relative(model.nominal(&target.parse()?)?, value));
    }
    Ok(largest(errors))
}

fn own_simulation(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><body name="b"><joint name="j" axis="0 1 0" damping="0.1"/>
      <geom name="g" type="sphere" size=".05" pos=".2 0 0" mass="1"/></body></worldbody>"#;
    let targets = ["geom/g/mass", "geom/g/pos/0", "option/gravity/2"];
    let size = Size {
        sims: 3,
        threads: 2,
        targets: &targets,
    };
    let mut rig = Rig::with(backend, inside, &["qpos.j"], size)?;
    let nominal = [1.0, 0.2, -9.81];
    rig.set(&nominal.repeat(3))?;
    let mut alone = Rig::with(backend, inside, &["qpos.j"], size)?;
    alone.set(&nominal.repeat(3))?;
    rig.simulator.set_parameters(&[1], &[2.0, 0.1, -3.0])?;
    let (rows, plain) = (rig.run(100, &[])?, alone.run(100, &[])?);
    let differ = |sim: usize| {
        let range = 100 * sim..100 * (sim + 1);
        differing_bits(&rows[range.clone()], &plain[range])
    };
    if differ(1) == 0.0 {
        return Ok(f64::NAN);
    }
    Ok(differ(0) + differ(2))
}

fn survive(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pair(backend, FALLING, &["qvel.b"], &[("option/gravity/2", -3.0)])?;
    let start = rig.simulator.save(&[0])?;
    let mut errors = Vec::new();
    for way in 0..4 {
        match way {
            0 => rig.simulator.reset(&[0, 1])?,
            1 => rig.simulator.load(&start, &[0, 0], &[0, 1])?,
            2 => rig.place(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &[0.0; 6])?,
            _ => {
                rig.simulator.reset(&[0])?;
                rig.simulator.copy_state(&[0], &[1])?;
            }
        }
        let [nominal, changed] = ends(&rig.run(20, &[])?)?;
        let time = 20.0 * STEP;
        errors.push(both([nominal[2], changed[2]], [-G * time, -3.0 * time]));
    }
    Ok(largest(errors))
}

fn change_in_rollout(backend: &dyn Backend) -> Result<f64> {
    let mut rig = pair(backend, FALLING, &["qvel.b"], &[("option/gravity/2", -3.0)])?;
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

fn nonsense(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<worldbody><geom name="floor" type="plane" size="1 1 .1"/>
      <body name="b"><joint name="j"/><geom name="g" type="sphere" size=".1" mass="1"/></body></worldbody>
      <actuator><motor name="m" joint="j"/></actuator>"#;
    let refused = |target: &str| {
        let size = Size {
            sims: 1,
            threads: 1,
            targets: &[target],
        };
        Rig::with(backend, inside, &[], size).is_err()
    };
    let forbidden = |target: &str, value: f64| {
        let size = Size {
            sims: 1,
            threads: 1,
            targets: &[target],
        };
        Rig::with(backend, inside, &[], size).map(|mut rig| rig.set(&[value]).is_err())
    };
    Ok(broken([
        refused("geom/missing/mass"),
        refused("geom/g/colour"),
        refused("geom/g/friction/3"),
        refused("body/world/mass"),
        refused("actuator/m/kp"),
        forbidden("body/b/mass", -1.0)?,
        forbidden("geom/g/friction/0", -0.1)?,
        forbidden("joint/j/damping", -0.1)?,
        forbidden("option/gravity/2", f64::INFINITY)?,
    ]))
}
