//! Features that an engine of free bodies may refuse but must get right if it accepts them.
//!
//! These are inertia along other axes than the body's, sensors of any kind, masses as parameters,
//! and dampers on a free joint.

use asid_core::simulator::{ExternalForce, StepHook, StepView};
use asid_core::{Backend, Capabilities, Error, Result};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::check::Measure::{Figure, Taken};
use crate::check::{Check, Tolerance};
use crate::pair::{both, ends, pair};
use crate::rig::{Rig, STEP, largest, last, relative};
use crate::subject::GHOST;

const FREE: Capabilities = Capabilities::FREE_BODIES;
const MASS: Capabilities = Capabilities::MASS_PARAMETERS;
const ROUNDING: Tolerance = Tolerance::by_precision(1e-9, 1e-4);

/// The checks of this file.
pub const CHECKS: &[Check] = &[
    Check {
        name: "dynamics/turned-inertia",
        needs: FREE,
        unit: "",
        tolerance: Tolerance::same(0.027),
        reason: "a body tumbles by its <inertial quat> or fullinertia, where they are taken: first order in the step, as free-tumbling-momentum",
        measure: Taken(turned_inertia),
    },
    Check {
        name: "joints/damping-of-a-free-joint",
        needs: FREE,
        unit: "",
        tolerance: Tolerance::same(1.05e-3),
        reason: "where it is taken, on all six velocities alike: first order in the step, rate dt / 2 = 0.001 after one time constant",
        measure: Taken(damping),
    },
    Check {
        name: "parameters/mass-of-a-free-body",
        needs: FREE.union(MASS),
        unit: "",
        tolerance: ROUNDING,
        reason: "pushed or turned from rest, with the mass, inertia and centre that are set; the inertia grows with the mass: rounding",
        measure: Taken(masses),
    },
    Check {
        name: "claims/masses-of-a-free-body",
        needs: FREE,
        unit: "",
        tolerance: ROUNDING,
        reason: "a mass, inertia or centre that is taken acts as mass-of-a-free-body says, claimed or not: rounding",
        measure: Taken(masses),
    },
    Check {
        name: "frames/free-body-origin",
        needs: FREE,
        unit: "m/s",
        tolerance: Tolerance::by_precision(1e-11, 1e-5),
        reason: "qvel is of the origin in the world frame, framelinvel of a body of its centre of mass: w x r by hand, rounding",
        measure: Figure(origin_velocity),
    },
];

fn turn(w: f64, x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// Angular momentum about the centre of mass in the world, after one second without torque.
fn turned_inertia(backend: &dyn Backend) -> Result<Option<f64>> {
    let axes = turn(0.8, 0.0, 0.6, 0.0).to_rotation_matrix().into_inner();
    let inertia =
        axes * Matrix3::from_diagonal(&Vector3::new(0.01, 0.02, 0.025)) * axes.transpose();
    let full: Vec<String> = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
        .iter()
        .map(|place| format!("{:?}", inertia[*place]))
        .collect();
    let mut errors = Vec::new();
    for way in [
        r#"quat="0.8 0 0.6 0" diaginertia="0.01 0.02 0.025""#.to_owned(),
        format!(r#"fullinertia="{}""#, full.join(" ")),
    ] {
        let inside = format!(
            r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
            <inertial pos=".1 -.05 .2" mass="1" {way}/></body></worldbody>"#
        );
        let Ok(mut rig) = Rig::new(backend, &inside, &["qpos.b", "qvel.b"]) else {
            continue;
        };
        let rate = Vector3::new(1.0, 5.0, 1.0);
        rig.place(
            &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            &[0.0, 0.0, 0.0, rate.x, rate.y, rate.z],
        )?;
        let before = inertia * rate;
        let rows = rig.run(500, &[])?;
        let end = last(&rows)?;
        let attitude = turn(end[3], end[4], end[5], end[6]);
        let after = attitude * (inertia * Vector3::new(end[10], end[11], end[12]));
        errors.push((after - before).norm() / before.norm());
    }
    Ok((!errors.is_empty()).then(|| largest(errors)))
}

fn damping(backend: &dyn Backend) -> Result<Option<f64>> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b">
      <joint name="b" type="free" damping="0.5"/>
      <inertial pos="0 0 0" mass="0.5" diaginertia="0.5 0.5 0.5"/></body></worldbody>"#;
    let Ok(mut rig) = Rig::new(backend, inside, &["qvel.b"]) else {
        return Ok(None);
    };
    let start = [1.0, -2.0, 3.0, 0.5, 0.4, -0.6];
    rig.place(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], &start)?;
    let rows = rig.run(500, &[])?;
    let end = last(&rows)?;
    let left = (-1f64).exp();
    Ok(Some(largest(
        (0..6).map(|i| relative(end[i], left * start[i])),
    )))
}

/// A force along y through the centre of mass and a torque about z, which a hook adds at the body's
/// origin.
///
/// `center` is the position of the centre of mass along x, by row.
struct Push {
    force: f64,
    torque: f64,
    center: [f64; 2],
}

impl StepHook for Push {
    fn before_step(&self, row: usize, _: usize, view: &mut StepView<'_>) {
        view.force[1] = self.force;
        view.force[5] = self.torque + self.center[row] * self.force;
    }
}

/// Velocities of a box of 2 kg after a push from rest, with nominal and with other masses.
fn masses(backend: &dyn Backend) -> Result<Option<f64>> {
    let capabilities = backend.capabilities();
    let wrenches = capabilities.contains(Capabilities::EXTERNAL_FORCES);
    if !wrenches && !capabilities.contains(Capabilities::STEP_HOOKS) {
        return Ok(None);
    }
    // An engine must not refuse what it claims.
    let claimed = capabilities.contains(MASS);
    let center = 0.2;
    let nominal = [
        0.4 * 0.4 + 0.6 * 0.6,
        0.2 * 0.2 + 0.6 * 0.6,
        0.2 * 0.2 + 0.4 * 0.4,
    ]
    .map(|squares| 2.0 * squares / 12.0);
    let inside = format!(
        r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
        <geom type="box" size=".1 .2 .3" pos="{center} 0 0" mass="2"{GHOST}/></body></worldbody>"#
    );
    // A force through the centre of mass along y and a torque about it along z, from rest.
    let ask = |target: &str, value: f64, force: f64, torque: f64, center: [f64; 2]| {
        let mut rig = pair(backend, &inside, &["qvel.b"], &[(target, value)])?;
        let wrench = [0.0, force, 0.0, 0.0, 0.0, torque].repeat(2);
        // The same wrench, applied at the origin by a hook.
        let hook = Push {
            force,
            torque,
            center,
        };
        let rows = rig.run_with(1, 1, &[], |extras| {
            if wrenches {
                let wrench = &wrench[..];
                extras.forces.push(ExternalForce { body: 1, wrench });
            } else {
                extras.hook = Some(&hook);
            }
        })?;
        ends(&rows)
    };
    let mut errors = Vec::new();
    let mut ask_about = |target: &str, measure: &dyn Fn() -> Result<f64>| {
        let taken = Rig::with(
            backend,
            &inside,
            &[],
            crate::rig::Size {
                sims: 1,
                threads: 1,
                targets: &[target],
            },
        );
        match taken {
            Err(error) if claimed => return Err(error),
            Err(_) => {}
            Ok(_) => errors.push(measure()?),
        }
        Ok::<(), Error>(())
    };
    ask_about("body/b/mass", &|| {
        let pushed = ask("body/b/mass", 6.0, 3.0, 0.0, [center; 2])?;
        let turned = ask("body/b/mass", 6.0, 0.0, 0.5, [center; 2])?;
        let speeds = [3.0 / 2.0 * STEP, 3.0 / 6.0 * STEP];
        let rates = [0.5 / nominal[2] * STEP, 0.5 / (3.0 * nominal[2]) * STEP];
        Ok(largest([
            both([pushed[0][1], pushed[1][1]], speeds),
            both([turned[0][5], turned[1][5]], rates),
        ]))
    })?;
    ask_about("body/b/inertia/2", &|| {
        let turned = ask("body/b/inertia/2", 0.05, 0.0, 0.5, [center; 2])?;
        let rates = [0.5 / nominal[2] * STEP, 0.5 / 0.05 * STEP];
        Ok(both([turned[0][5], turned[1][5]], rates))
    })?;
    ask_about("body/b/ipos/0", &|| {
        let centers = [center, 0.35];
        let turned = ask("body/b/ipos/0", 0.35, 0.0, 0.5, centers)?;
        // The centre of mass stays at rest, so the origin moves the other way.
        let origin = centers.map(|c| -c * 0.5 / nominal[2] * STEP);
        let pushed = ask("body/b/ipos/0", 0.35, 3.0, 0.0, centers)?;
        Ok(largest([
            both([turned[0][1], turned[1][1]], origin),
            both([pushed[0][1], pushed[1][1]], [3.0 / 2.0 * STEP; 2]),
        ]))
    })?;
    Ok((!errors.is_empty()).then(|| largest(errors)))
}

fn origin_velocity(backend: &dyn Backend) -> Result<f64> {
    let inside = r#"<option gravity="0 0 0"/><worldbody><body name="b"><freejoint name="b"/>
      <inertial pos=".3 -.2 .1" mass="1" diaginertia="0.1 0.2 0.25"/></body></worldbody>
      <sensor><framelinvel name="com" objtype="body" objname="b"/></sensor>"#;
    let mut rig = Rig::new(backend, inside, &["com", "qvel.b"])?;
    let attitude = turn(0.6, 0.0, 0.8, 0.0);
    let (velocity, rate) = (Vector3::new(1.0, 2.0, -1.0), Vector3::new(0.5, -1.5, 2.0));
    rig.place(
        &[
            0.0, 0.0, 0.0, attitude.w, attitude.i, attitude.j, attitude.k,
        ],
        &[velocity.as_slice(), rate.as_slice()].concat(),
    )?;
    let read = rig.read()?.swap_remove(0);
    let center = velocity + attitude * rate.cross(&Vector3::new(0.3, -0.2, 0.1));
    let theory = [center.as_slice(), velocity.as_slice(), rate.as_slice()].concat();
    Ok(largest(read.iter().zip(&theory).map(|(a, b)| a - b)))
}
